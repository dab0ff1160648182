"""Figures of what accompanies the one-way ANOVA: mixed designs, sphericity, equivalence, all pairs, exact checks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from importlib.util import find_spec
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from benchmarks.statistics.inputs import extended_answer, long_table, random_cells
from benchmarks.statistics.measuring import worst_relative_error
from palpate.analysis.crosschecking import packages
from palpate.analysis.statistics.anova import rm_anova
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.equivalence import equivalence_tests
from palpate.analysis.statistics.exact import self_check
from palpate.analysis.statistics.mixed_anova import mauchly_tests, mixed_anova
from palpate.analysis.statistics.pairwise import pairwise_tests
from palpate.analysis.statistics.references import reference_table, reference_values
from palpate.protocols.bench import Case

AREA = "statistics"
OURS, PINGOUIN = "palpate", "pingouin"
Numbers: TypeAlias = dict[tuple[str, str], float]
Run: TypeAlias = Callable[[], Any]
Read: TypeAlias = Callable[[Any], Numbers]
Methods: TypeAlias = Mapping[str, tuple[str, Run, Read]]
"""By name: the package that a method needs, the function to time, and the reader of its numbers."""

TOST_R = {("m30-m36", "p_low"): 0.0200601723658991, ("m30-m36", "p_high"): 0.000350899904947969}
"""R 4.2.2: t.test(m30, m36, paired = TRUE, mu = -10, alternative = "greater") and mu = 8, "less"; set md_15.1."""


def family_cases(quick: bool) -> Iterator[Case]:
    """Yield every figure of this family; without `quick` with 5000 participants instead of 500."""
    yield from _mixed()
    yield from _sphericity()
    yield from _equivalence()
    yield from _large(quick)
    yield from _exact()


def _cases(title: str, name: str, n: int, kind: str, expected: Numbers, methods: Methods) -> Iterator[Case]:
    for method, (package, run, read) in methods.items():
        if find_spec(package) is not None:
            yield Case(AREA, title, method, name, n, kind, run, _error(read, expected))


def _error(read: Read, expected: Numbers) -> Callable[[Any], float | None]:
    """Return a function for the largest relative error over the numbers that a method gives; NaN if it gives none."""

    def error(result: Any) -> float:
        worst = worst_relative_error(read(result), expected)
        return math.nan if worst is None else worst

    return error


def _mixed() -> Iterator[Case]:
    for name, entry in reference_values("r_reference").items():
        if not entry.get("between"):
            continue
        table = reference_table(f"csv/{entry['csv']}")
        expected = {(s, key): float(v[key]) for s, v in entry["effects"].items() for key in ("F", "p", "ges")}
        kind = "relative, worst of F, p, generalized eta squared; against R"
        yield from _cases("mixed ANOVA against R", name, len(table), kind, expected, _mixed_methods(table, entry))


def _mixed_methods(table: pd.DataFrame, entry: dict[str, Any]) -> Methods:
    within, between, kind = entry["within"], entry["between"], "I" * entry["type"]
    averaged: pd.DataFrame = table.groupby(["subject", *within, *between])["y"].mean().reset_index()

    def ours() -> pd.DataFrame:
        roles: Any = {"within": within, "between": between, "sum_of_squares": kind, "aggregate": "mean"}
        return mixed_anova(table, "y", subject="subject", **roles)

    def pingouins() -> pd.DataFrame:
        return packages.pingouin_mixed(averaged, "y", within[0], between[0], "subject")

    methods = {OURS: ("pandas", ours, _reader({"F": "F", "p": "p_unc", "ges": "ng2"}))}
    if len(within) == len(between) == 1:
        methods[PINGOUIN] = (PINGOUIN, pingouins, _reader({"F": "F", "p": "p_unc"}))
    return methods


def _reader(kinds: Mapping[str, str]) -> Read:
    """Return a reader of numbers by effect and kind from a table with a column Source."""
    return lambda table: packages.read_table(table, table["Source"], kinds)


def _sphericity() -> Iterator[Case]:
    for name, entry in reference_values("r_reference").items():
        if "effects" not in entry or entry["between"] or len(entry["within"]) > 1:
            continue
        factor = str(entry["within"][0])
        rows = reference_table(f"csv/{entry['csv']}")
        table: pd.DataFrame = rows.groupby(["subject", factor])["y"].mean().reset_index()
        values = entry["effects"][factor]
        expected = {(factor, "W"): values["mauchly_W"], (factor, "p"): values["mauchly_p"]}
        kind = "relative, worst of W and p; against R"
        yield from _cases("Mauchly's test", name, len(table), kind, expected, _sphericity_methods(table, factor))


def _sphericity_methods(table: pd.DataFrame, factor: str) -> Methods:
    def pingouins() -> Any:
        import pingouin

        return pingouin.sphericity(table, dv="y", within=factor, subject="subject")

    return {
        OURS: (
            "pandas",
            lambda: mauchly_tests(table, "y", within=factor, subject="subject"),
            _reader({"W": "W", "p": "p"}),
        ),
        PINGOUIN: (
            PINGOUIN,
            pingouins,
            lambda result: {(factor, "W"): float(result.W), (factor, "p"): float(result.pval)},
        ),
    }


def _equivalence() -> Iterator[Case]:
    table = reference_table("csv/md_15.1.csv")
    table = table[table["time"].isin(["m30", "m36"])]
    a, b = (table["y"][table["time"] == level].to_numpy() for level in ("m30", "m36"))

    def ours() -> pd.DataFrame:
        return equivalence_tests(table, "y", within="time", subject="subject", bounds=(-10.0, 8.0))

    def statsmodels() -> tuple[float, float]:
        return packages.statsmodels_equivalence(a, b, -10.0, 8.0, True)

    methods: Methods = {
        OURS: ("pandas", ours, lambda t: {("m30-m36", name): float(t[name].iloc[0]) for name in ("p_low", "p_high")}),
        "statsmodels ttost_paired": (
            "statsmodels",
            statsmodels,
            lambda result: {("m30-m36", "p_low"): result[0], ("m30-m36", "p_high"): result[1]},
        ),
    }
    yield from _cases("equivalence (TOST)", "md_15.1, m30 - m36", 24, "relative, worst of both p; R", TOST_R, methods)


def _large(quick: bool) -> Iterator[Case]:
    """Yield the cases of one large table: ANOVA and every pair, and a mixed design of the same values."""
    n = 500 if quick else 5000
    cells = random_cells(n, 90, seed=n, effect=3 / n**0.5)
    table = long_table(cells).sample(frac=1, random_state=n, ignore_index=True)
    expected = {key: value for key, value in extended_answer(cells).items() if value is not None and key[1] == "F"}
    expected |= _pair_answers(cells)

    def ours() -> tuple[pd.DataFrame, pd.DataFrame]:
        pairs = pairwise_tests(table, "y", within="A", subject="subject", padjust="holm")
        return rm_anova(table, "y", "A", "subject"), pairs

    def scipys() -> list[Floats]:
        from scipy.stats import ttest_rel

        return [ttest_rel(cells[:, i : i + 1], cells[:, i + 1 :]).statistic for i in range(cells.shape[1] - 1)]

    methods: Methods = {
        OURS: ("pandas", ours, lambda result: {("A", "F"): float(result[0]["F"].iloc[0]), **_pairs_of(result[1]["T"])}),
        "scipy ttest_rel": ("scipy", scipys, lambda result: _pairs_of(np.concatenate(result))),
    }
    kind = "relative, worst of F and 4005 t; extended precision"
    yield from _cases("ANOVA and every pair", f"{n} x 90", len(table), kind, expected, methods)
    yield from _large_mixed(table.assign(group=table["subject"].str[1:].astype(int) % 3), n)


def _pairs_of(t: Any) -> Numbers:
    return {(str(place), "t"): float(value) for place, value in enumerate(t)}


def _pair_answers(cells: Floats) -> Numbers:
    """Return every paired t in extended precision (64-bit significand)."""
    x = cells.astype(np.longdouble)
    t: list[float] = []
    for i in range(x.shape[1] - 1):
        apart = x[:, i : i + 1] - x[:, i + 1 :]
        mean = apart.mean(axis=0)
        spread = np.sqrt(((apart - mean) ** 2).sum(axis=0) / (len(x) - 1))
        t += [float(value) for value in mean / spread * np.sqrt(np.longdouble(len(x)))]
    return _pairs_of(t)


def _large_mixed(table: pd.DataFrame, n: int) -> Iterator[Case]:
    """Yield the cases of the same F with and without 1e9 added, to show the cost of an offset."""
    roles: Any = {"within": "A", "between": "group", "subject": "subject"}
    whole = table.assign(y=(1024 * table["y"]).round())
    right = _reader({"F": "F"})(mixed_anova(whole, "y", **roles))
    moved = whole.assign(y=whole["y"] + 2.0**40)

    def pingouins() -> pd.DataFrame:
        return packages.pingouin_mixed(moved, "y", "A", "group", "subject")

    methods: Methods = {
        OURS: ("pandas", lambda: mixed_anova(moved, "y", **roles), _reader({"F": "F"})),
        PINGOUIN: (PINGOUIN, pingouins, _reader({"F": "F"})),
    }
    kind = "relative, worst F; the same values without the offset of 2^40"
    yield from _cases("mixed ANOVA, large table", f"{n} x 90, 3 groups", len(table), kind, right, methods)


def _exact() -> Iterator[Case]:
    table = long_table(random_cells(40, 45, seed=45, effect=2.0))
    designs: Mapping[str, Mapping[str, Any]] = {
        "40 x 45, within": {"within": "A", "subject": "subject"},
        "45 groups of 40": {"between": "A"},
    }
    for name, roles in designs.items():
        run = _self_check(table, roles)
        kind = "largest relative difference that the check finds"
        yield Case(AREA, "exact self-check", OURS, name, len(table), kind, run, _largest)


def _self_check(table: pd.DataFrame, roles: Mapping[str, Any]) -> Run:
    return lambda: self_check(table, "y", **roles)


def _largest(differences: pd.DataFrame) -> float:
    return float(differences["difference"].max())
