"""Ledgers to tidy tables, statistics, figures and reports."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.statistics.apa import apa_f, apa_p, apa_t
    from analysis.statistics.between import anova
    from analysis.statistics.pairwise import pairwise_tests
    from analysis.statistics.refusals import StatisticsError
    from analysis.statistics.within import rm_anova

__all__ = ["StatisticsError", "anova", "apa_f", "apa_p", "apa_t", "pairwise_tests", "rm_anova"]

# No module of this room may be named like one of these: importing it would hide the function.
_HOMES = {
    "StatisticsError": "refusals",
    "anova": "between",
    "apa_f": "apa",
    "apa_p": "apa",
    "apa_t": "apa",
    "pairwise_tests": "pairwise",
    "rm_anova": "within",
}


def __getattr__(name: str) -> Any:
    """Import a public call only when it is asked for, so that importing the room costs nothing."""
    if name in _HOMES:
        return getattr(import_module(f"analysis.statistics.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'analysis' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
