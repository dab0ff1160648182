"""Numbers and lists as a report writes them: a true minus, no leading zero below one, and no p of zero."""

from __future__ import annotations

import math

from palpate.analysis.statistics.apa import number, p_value
from palpate.protocols.wording import count, phrase

__all__ = ["NONE", "count", "degrees", "fixed", "p_cell", "phrase", "share"]

NONE = "–"


def fixed(value: float | None, decimals: int = 2) -> str:
    """A number with so many decimals, in powers of ten where these would not do; a dash where there is none."""
    return NONE if value is None or math.isnan(value) else number(value, decimals)


def share(value: float | None) -> str:
    """A number that cannot exceed 1 (an eta squared, an epsilon) to three decimals, without its leading zero."""
    if value is None or math.isnan(value):
        return NONE
    if 0 < value < 0.0005:
        return "< .001"
    return f"{value:.3f}".removeprefix("0")


def p_cell(value: float | None) -> str:
    """A p value to three decimals, as the APA writes it: never 0."""
    return NONE if value is None else p_value(value)


def degrees(value: float | None) -> str:
    """Degrees of freedom: whole where they are whole, else two decimals."""
    if value is None or math.isnan(value):
        return NONE
    return f"{value:.0f}" if value == int(value) else f"{value:.2f}"
