"""Numbers as a report writes them: a true minus, no leading zero below one, no p of zero, a dash for none."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from palpate.analysis.statistics.apa import number, p_value

NONE = "–"


def fixed(value: float | None, decimals: int = 2) -> str:
    """Return a number with so many decimals, in powers of ten where these would not do."""
    return NONE if value is None or math.isnan(value) else number(value, decimals)


def share(value: float | None) -> str:
    """Return a number that cannot exceed 1 (an eta squared, an epsilon) to three decimals, without its leading zero."""
    if value is None or math.isnan(value):
        return NONE
    if 0 < value < 0.0005:
        return "< .001"
    return f"{value:.3f}".removeprefix("0")


def p_cell(value: float | None) -> str:
    """Return a p value to three decimals, as the APA writes it: never 0."""
    return NONE if value is None else p_value(value)


def degrees(value: float | None) -> str:
    """Return degrees of freedom: whole where they are whole, else with two decimals."""
    if value is None or math.isnan(value):
        return NONE
    return f"{value:.0f}" if value == int(value) else f"{value:.2f}"


def written(value: Any, form: str) -> str:
    """Return a value as text: "text", "int", "share", "s", "ms", "bytes", "tiny", or digits after the point."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return NONE
    if form in ("text", "words"):
        return str(value)
    return _FORMS[form](float(value)).replace("-", "−")


def in_seconds(value: float) -> str:
    """Return a time in the unit that keeps it short."""
    if value >= 120:
        return f"{value / 60:.0f} min"
    return f"{value:.0f} s" if value >= 10 else f"{value:.1f} s" if value >= 0.1 else f"{value * 1e3:.1f} ms"


_FORMS: Mapping[str, Callable[[float], str]] = {
    "int": lambda value: f"{value:,.0f}",
    "share": lambda value: f"{value:.1%}",
    "0": lambda value: f"{value:.0f}",
    "1": lambda value: f"{value:.1f}",
    "2": lambda value: f"{value:.2f}",
    "3": lambda value: f"{value:.3f}",
    "s": in_seconds,
    "ms": lambda value: f"{value:.2f}" if value < 10 else f"{value:.0f}",
    "bytes": lambda value: f"{value / 1e6:.1f} MB" if value >= 1e6 else f"{value / 1e3:.0f} kB",
    "tiny": lambda value: "0" if value == 0 else f"{value:.0e}",
}
