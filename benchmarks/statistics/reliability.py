"""Figures of reliability: each implementation's error beside its time, on R's and on exact answers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from importlib.util import find_spec
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from benchmarks.statistics.measuring import worst_relative_error
from palpate.analysis.crosschecking import packages
from palpate.analysis.reliability.concordance import concordance
from palpate.analysis.reliability.consistency import cronbach_alpha
from palpate.analysis.reliability.intraclass import icc
from palpate.analysis.reliability.kappa import fleiss_kappa
from palpate.analysis.reliability.krippendorff import krippendorff
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.references import reference_table, reference_values
from palpate.protocols.bench import Case

AREA = "statistics"
Numbers: TypeAlias = Mapping[str, float]
KINDS = ("ICC1", "ICC2", "ICC3", "ICC1k", "ICC2k", "ICC3k")
R_KEYS = {"ICC": "ICC", "F": "F", "p": "p", "low": "lower", "high": "upper"}


@dataclass(frozen=True)
class Ratings:
    """A long table (columns target, rater, y), its values as an array, and the right numbers."""

    name: str
    table: pd.DataFrame
    values: Floats
    answer: Numbers


@dataclass(frozen=True)
class Way:
    """One implementation: the function to time, and the reader of its numbers."""

    name: str
    run: Callable[[Ratings], Any]
    read: Callable[[Any], Numbers]
    package: str = "numpy"


def cases(quick: bool) -> Iterator[Case]:
    """Yield ICC, alpha and W on R's sets, huge offsets and a large table; kappa and Krippendorff's alpha."""
    sets = list(_r_sets())
    far = list(_extremes(sets[0].values))
    large = [_large(200 if quick else 2000)]
    kind = "relative, worst of ICC, F, p and interval; against R"
    yield from _cases("ICC and intervals", sets, ICC_WAYS, kind)
    kind = "relative, worst of six ICC; exact answer"
    yield from _cases("ICC, extreme and large tables", [*far, *large], ICC_WAYS, kind)
    yield from _cases("Cronbach's alpha", [_alpha_of(ratings) for ratings in sets], ALPHA_WAYS, "relative; against R")
    yield from _cases("Cronbach's alpha, extreme tables", map(_alpha_of, far), ALPHA_WAYS, "relative; exact answer")
    yield from _cases("Kendall's W", _w_sets(), W_WAYS, "relative, worst of W, chi2 and p; against R")
    yield from _cases("Fleiss' kappa", [_kappa_set()], KAPPA_WAYS, "relative; exact answer")
    yield from _cases("Krippendorff's alpha", _coincidence_sets(), KRIPPENDORFF_WAYS, "relative; exact answer")


def _cases(title: str, sets: Any, ways: tuple[Way, ...], error_kind: str) -> Iterator[Case]:
    usable = [way for way in ways if find_spec(way.package) is not None]
    for ratings in sets:
        for way in usable:
            yield Case(AREA, title, way.name, ratings.name, ratings.values.size, error_kind, *_bound(way, ratings))


def _bound(way: Way, ratings: Ratings) -> tuple[Callable[[], Any], Callable[[Any], float | None]]:
    return (lambda: way.run(ratings)), (lambda result: worst_relative_error(way.read(result), ratings.answer))


def _long(values: Floats) -> pd.DataFrame:
    targets, raters = np.indices(values.shape).reshape(2, -1)
    names = {"target": [f"T{i:04d}" for i in targets], "rater": [f"P{i:03d}" for i in raters]}
    return pd.DataFrame({**names, "y": values.ravel()})


def _r_sets() -> Iterator[Ratings]:
    """Yield the reference sets with psych's intraclass correlations, and psych's alpha under "alpha"."""
    for name, entry in reference_values("r_reference").items():
        if "icc" not in entry:
            continue
        table = reference_table(f"csv/{entry['csv']}")
        wide = table.pivot_table(index="subject", columns=entry["within"][0], values="y", aggfunc="mean")
        rows = {row["type"]: row for row in entry["icc"]["rows"]}
        answer = {f"{kind} {key}": float(rows[kind][theirs]) for kind in KINDS for key, theirs in R_KEYS.items()}
        values = np.ascontiguousarray(wide.to_numpy(dtype=np.float64))
        yield Ratings(name, _long(values), values, answer | {"alpha": float(entry["cronbach"]["raw_alpha"])})


def _extremes(values: Floats) -> Iterator[Ratings]:
    """Yield tables, made of one set, on which a textbook formula loses its digits."""
    yield _exact("offset 1e12", values + 1e12)
    yield _exact("1 + 1e-12 x", 1 + 1e-12 * values)
    yield _exact("raters 1e9 apart", values + 1e9 * np.arange(values.shape[1]))
    yield _exact("targets 1e9 apart", values + 1e9 * np.arange(len(values))[:, None])


def _large(n: int) -> Ratings:
    rng = np.random.default_rng(n)
    values = np.round(rng.normal(50, 12, (n, 1)) + rng.normal(0, 4, (1, 26)) + rng.normal(0, 10, (n, 26)), 1)
    return _exact(f"{n} x 26", values)


def _exact(name: str, values: Floats) -> Ratings:
    """Return the table with the six ICCs and alpha in exact fractions."""
    x = [[Fraction(value) for value in row] for row in values.tolist()]
    n, k = values.shape
    rows, columns = [sum(row) for row in x], [sum(column) for column in zip(*x, strict=True)]
    square, total = Fraction(sum(rows)) ** 2 / (n * k), sum(value * value for row in x for value in row)
    of_rows = sum((row * row for row in rows), Fraction(0)) / k - square
    of_columns = sum((column * column for column in columns), Fraction(0)) / n - square
    within = total - square - of_rows
    b, j, w = of_rows / (n - 1), of_columns / (k - 1), within / (n * (k - 1))
    e = (within - of_columns) / ((n - 1) * (k - 1))
    coefficients = (
        *((b - w) / (b + (k - 1) * w), (b - e) / (b + (k - 1) * e + k * (j - e) / n), (b - e) / (b + (k - 1) * e)),
        *((b - w) / b, (b - e) / (b + (j - e) / n), (b - e) / b),
    )
    answer = {f"{kind} ICC": float(value) for kind, value in zip(KINDS, coefficients, strict=True)}
    return Ratings(name, _long(values), values, answer | {"alpha": float(coefficients[-1])})


def _alpha_of(ratings: Ratings) -> Ratings:
    return replace(ratings, answer={"alpha": ratings.answer["alpha"]})


def _w_sets() -> Iterator[Ratings]:
    """Yield the sets of R's friedman.test: W is chi squared over m (n - 1)."""
    for ratings in _r_sets():
        entry = reference_values("r_reference")[ratings.name]
        if test := entry.get("friedman"):
            turned = np.ascontiguousarray(ratings.values.T)
            chi2 = float(test["chi2"])
            answer = {"W": chi2 / (len(ratings.values) * (len(turned) - 1)), "chi2": chi2, "p": float(test["p"])}
            yield Ratings(ratings.name, _long(turned), turned, answer)


def _kappa_set() -> Ratings:
    counts = np.random.default_rng(3).multinomial(20, [0.5, 0.3, 0.2], 50).astype(np.float64)
    m, n = 20, 50
    apart = Fraction(int((m * m - (counts**2).sum(axis=1)).sum()), n * m * (m - 1))
    chance = Fraction(int((n * m) ** 2 - (counts.sum(axis=0) ** 2).sum()), (n * m) ** 2)
    return Ratings("50 x 20 raters", pd.DataFrame(counts), counts, {"kappa": float(1 - apart / chance)})


def _coincidence_sets() -> Iterator[Ratings]:
    """Yield Krippendorff's published table with gaps (2011, part C), each answer an exact fraction."""
    rows = ("123321412...", "1233224125.3", ".3332342251.", "12332441251.")
    values = np.array([[math.nan if mark == "." else float(mark) for mark in row] for row in rows]).T
    for level, answer in (("nominal", Fraction(113, 152)), ("interval", Fraction(951, 1120))):
        yield Ratings(f"12 units, 4 raters, {level}", _long(values), values, {level: float(answer)})


def _read_icc(table: pd.DataFrame) -> Numbers:
    columns = {"ICC": "ICC", "F": "F", "p": "p", "low": "ci_low", "high": "ci_high"}
    return {f"{row['type']} {key}": float(row[ours]) for _, row in table.iterrows() for key, ours in columns.items()}


def _pingouin_icc(ratings: Ratings) -> pd.DataFrame:
    return packages.pingouin_icc(ratings.table, "y", "target", "rater")


def _read_alpha(result: Numbers) -> Numbers:
    return {"alpha": result["alpha"]}


def _read_kappa(kappa: float) -> Numbers:
    return {"kappa": kappa}


def _read_pingouin_icc(table: pd.DataFrame) -> Numbers:
    ends = {"ci_low": "low", "ci_high": "high"}
    numbers = packages.read_pingouin_icc(table)
    return {f"{kind} {ends.get(name, name)}": value for (kind, name), value in numbers.items()}


def _without_intervals(numbers: Numbers) -> Numbers:
    return {key: value for key, value in numbers.items() if not key.endswith(("low", "high"))}


def _run_scipy_w(ratings: Ratings) -> Any:
    from scipy.stats import friedmanchisquare

    return friedmanchisquare(*ratings.values)


def _run_krippendorff(ratings: Ratings) -> Numbers:
    level: Any = ratings.name.rsplit(" ", 1)[1]
    return {level: krippendorff(ratings.values, level).alpha}


ICC_WAYS = (
    Way("palpate", lambda ratings: icc(ratings.table, "y", "target", "rater"), _read_icc),
    Way("pingouin", _pingouin_icc, _read_pingouin_icc, "pingouin"),
    Way("pingouin, no interval", _pingouin_icc, lambda t: _without_intervals(_read_pingouin_icc(t)), "pingouin"),
)
ALPHA_WAYS = (
    Way(
        "palpate, with its items",
        lambda ratings: cronbach_alpha(ratings.table, "y", "rater", "target"),
        lambda result: {"alpha": result.alpha},
    ),
    Way("pingouin", lambda ratings: packages.pingouin_alpha(pd.DataFrame(ratings.values)), _read_alpha, "pingouin"),
)
W_WAYS = (
    Way(
        "palpate",
        lambda ratings: concordance(ratings.values),
        lambda row: {"W": row["W"], "chi2": row["chi2"], "p": row["p_chi2"]},
    ),
    Way("scipy", _run_scipy_w, lambda test: {"chi2": float(test.statistic), "p": float(test.pvalue)}, "scipy"),
)
KAPPA_WAYS = (
    Way("palpate", lambda ratings: fleiss_kappa(ratings.values), lambda result: {"kappa": result.kappa}),
    Way("statsmodels", lambda ratings: packages.statsmodels_kappa(ratings.values), _read_kappa, "statsmodels"),
)
KRIPPENDORFF_WAYS = (Way("palpate", _run_krippendorff, lambda numbers: numbers),)
