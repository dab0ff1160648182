"""The implementations that are compared, and functions that read the numbers from their results."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, TypeAlias

import pandas as pd

from benchmarks.statistics.inputs import Input
from palpate.analysis.crosschecking import packages
from palpate.analysis.statistics.anova import anova, rm_anova
from palpate.analysis.statistics.exact import ExactEffect, exact_within
from palpate.analysis.statistics.refusals import StatisticsError

Numbers: TypeAlias = dict[tuple[str, str], float]
"""A method's numbers by (effect, kind of number); empty for a refusal."""


@dataclass(frozen=True)
class Method:
    """One implementation: `run` is timed, `read` turns its result into numbers and is not timed."""

    name: str
    run: Callable[[Input], Any]
    read: Callable[[Any], Numbers]
    package: str = "pandas"

    @property
    def installed(self) -> bool:
        """Whether its package can be imported; the packages compared with Palpate are optional."""
        return find_spec(self.package) is not None


_KINDS = {"p_unc": "p", "p_GG_corr": "p_GG"}


def _run_ours(table: Input) -> pd.DataFrame | None:
    try:
        return rm_anova(table.table, "y", table.within, table.subject, aggregate=table.aggregate)
    except StatisticsError:
        return None


def _read_ours(table: pd.DataFrame | None) -> Numbers:
    """Return Palpate's numbers; none for a refusal, or if every row has a note instead of F."""
    if table is None or table["F"].isna().all():
        return {}
    kinds = {"F": "F", "p": "p_unc", "p_GG": "p_GG_corr", "eps": "eps", "np2": "np2", "ng2": "ng2"}
    return packages.read_table(table, table["Source"], kinds)


def _run_pingouin(table: Input) -> pd.DataFrame:
    return packages.pingouin_within(table.averaged, "y", table.within, table.subject)


def _read_pingouin(table: pd.DataFrame) -> Numbers:
    return _by_kind(packages.read_pingouin_anova(table))


def _by_kind(numbers: Numbers) -> Numbers:
    return {(source, _KINDS.get(column, column)): value for (source, column), value in numbers.items()}


def _run_anova_rm(table: Input) -> pd.DataFrame:
    return packages.statsmodels_within(table.averaged, "y", table.within, table.subject)


def _read_anova_rm(table: pd.DataFrame) -> Numbers:
    return _by_kind(packages.read_statsmodels_within(table))


def _run_exact(table: Input) -> list[ExactEffect]:
    return exact_within(table.cells.ravel().tolist(), table.cells.shape, table.within)


def _read_exact(effects: list[ExactEffect]) -> Numbers:
    kinds = (("F", "f"), ("eps", "eps"), ("np2", "np2"), ("ng2", "ng2"))
    values = ((effect.source, kind, getattr(effect, name)) for effect in effects for kind, name in kinds)
    return {(source, kind): math.nan if value is None else float(value) for source, kind, value in values}


def _read_ours_reported(table: pd.DataFrame | None) -> Numbers:
    """Return the p that Palpate's sentences show: always corrected."""
    return {key: value for key, value in _read_ours(table).items() if key[1] == "p_GG"}


def _run_pingouin_auto(table: Input) -> pd.DataFrame:
    import pingouin

    result: pd.DataFrame = pingouin.rm_anova(table.table, dv="y", within=table.within[0], subject=table.subject)
    return result


def _read_pingouin_reported(table: pd.DataFrame) -> Numbers:
    """Return the p that pingouin's user sees: corrected only where its test of sphericity fails."""
    corrected = "p_GG_corr" in table and not table["sphericity"].iloc[0]
    return {(str(table["Source"].iloc[0]), "p_GG"): float(table["p_GG_corr" if corrected else "p_unc"].iloc[0])}


def _run_pingouin_between(table: Input) -> pd.DataFrame:
    return packages.pingouin_between(table.table, "y", ["group"])


def _read_between(table: pd.DataFrame) -> Numbers:
    return {("group", "F"): float(table["F"].iloc[0])}


OURS, PINGOUIN = "palpate", "pingouin"
EXACT = Method("exact fractions", _run_exact, _read_exact)
ORDINARY = (
    Method(OURS, _run_ours, _read_ours),
    Method(PINGOUIN, _run_pingouin, _read_pingouin, "pingouin"),
    Method("statsmodels AnovaRM", _run_anova_rm, _read_anova_rm, "statsmodels"),
)
REPORTED = (
    Method(OURS, _run_ours, _read_ours_reported),
    Method(PINGOUIN, packages.quietly(_run_pingouin_auto), _read_pingouin_reported, "pingouin"),
)
BETWEEN = (
    Method(OURS, lambda data: anova(data.table, "y", "group"), _read_between),
    Method(PINGOUIN, _run_pingouin_between, _read_between, "pingouin"),
)
