"""Figures of the ordinal statistics: each implementation's error beside its time, on ordinary and awkward tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from benchmarks.statistics.measuring import Way, comparison
from benchmarks.statistics.ordinal_truth import (
    FRIEDMAN,
    RANGES,
    SIGNED,
    WINE,
    exact_friedman,
    exact_signed_p,
    separated_table,
    wine_table,
)
from palpate.analysis.crosschecking import packages
from palpate.analysis.ordinal.friedman import friedman
from palpate.analysis.ordinal.nemenyi import range_tail
from palpate.analysis.ordinal.ordinal_model import ordinal_model
from palpate.analysis.ordinal.wilcoxon import wilcoxon_tests
from palpate.analysis.statistics.refusals import StatisticsError
from palpate.protocols.bench import Case

Numbers: TypeAlias = Mapping[str, float]
"""A method's numbers by name; empty for a refusal."""


def cases(quick: bool) -> Iterator[Case]:
    """Yield every figure of this area; without `quick` also a large Friedman table."""
    for name, table in FRIEDMAN.items():
        yield from _cases("Friedman", name, table, table.size, _FRIEDMAN, exact_friedman(table))
    if not quick:
        large = np.random.Generator(np.random.PCG64(5)).integers(0, 101, (5000, 90)).astype(np.float64)
        yield from _cases("Friedman", "5000 x 90, 0 to 100", large, large.size, _FRIEDMAN, exact_friedman(large))
    for name, (a, b) in SIGNED.items():
        truth = {"p": exact_signed_p(a, b)}
        yield from _cases("Wilcoxon signed rank, exact p", name, (a, b), len(a), _SIGNED, truth)
    for (q, k), tail in RANGES.items():
        yield from _cases("Nemenyi: tail of the range", f"q = {q:g}, k = {k}", (q, k), k, _RANGE, {"p": tail})
    yield from _cases("ordinal model", "wine", wine_table(), 72, _MODEL, WINE)
    nothing = dict.fromkeys(("slope 0",), math.nan)
    yield from _cases("ordinal model", "separated answers", separated_table(), 12, _MODEL, nothing)


def _cases(title: str, name: str, data: Any, n: int, methods: tuple[Way, ...], truth: Numbers) -> Iterator[Case]:
    kind = "relative, worst number; exact answer or R's"
    return comparison(title, name, n, methods, data, _worst(truth), kind)


def _worst(truth: Numbers) -> Callable[[Numbers], float | None]:
    """Return a function for the largest relative error: infinite for a missing number, None for a refusal."""

    def error(numbers: Numbers) -> float | None:
        known = [name for name in truth if name in numbers]
        return max(_error(numbers[name], truth[name]) for name in known) if known else None

    return error


def _error(number: float, expected: float) -> float:
    if math.isnan(expected):
        return math.inf
    return math.inf if math.isnan(number) else abs(number - expected) / abs(expected)


def _long(cells: Any) -> pd.DataFrame:
    people, conditions = np.indices(cells.shape).reshape(2, -1)
    return pd.DataFrame({"person": people, "condition": conditions, "y": cells.ravel()})


def _our_friedman(cells: Any) -> Numbers:
    row = friedman(_long(cells), "y", "condition", "person", exact=False, draws=100).iloc[0]
    return {"chi2": float(row["chi2"]), "p": float(row["p_unc"])}


def _pingouin_friedman(cells: Any) -> Numbers:
    row = packages.read_pingouin_friedman(packages.pingouin_friedman(_long(cells), "y", "condition", "person"))
    return {"chi2": row["chi2"], "p": row["p_unc"]}


def _scipy_friedman(cells: Any) -> Numbers:
    from scipy.stats import friedmanchisquare

    result = friedmanchisquare(*cells.T)
    return {"chi2": float(result.statistic), "p": float(result.pvalue)}


def _our_signed(pair: Any) -> Numbers:
    cells = np.column_stack(pair)
    row = wilcoxon_tests(_long(cells), "y", within="condition", subject="person").iloc[0]
    return {"p": float(row["p_exact"])}


def _scipy_signed(pair: Any) -> Numbers:
    from scipy.stats import wilcoxon

    return {"p": float(wilcoxon(*pair, method="exact").pvalue)}


def _scipy_signed_auto(pair: Any) -> Numbers:
    from scipy.stats import wilcoxon

    return {"p": float(wilcoxon(*pair).pvalue)}


def _pingouin_signed(pair: Any) -> Numbers:
    import pingouin

    row = pingouin.wilcoxon(*pair).iloc[0]
    return {"p": float(row["p_val" if "p_val" in row else "p-val"])}


def _our_range(q_and_k: Any) -> Numbers:
    return {"p": range_tail(*q_and_k)}


def _scipy_range(q_and_k: Any) -> Numbers:
    from scipy.stats import studentized_range

    return {"p": float(studentized_range.sf(*q_and_k, np.inf))}


def _statsmodels_range(q_and_k: Any) -> Numbers:
    from statsmodels.stats.libqsturng import psturng

    return {"p": float(np.ravel(psturng(*q_and_k, np.inf))[0])}


def _our_model(table: Any) -> Numbers:
    try:
        model = ordinal_model(table, "y", fixed=[name for name in table if name != "y"])
    except StatisticsError:
        return {}
    slopes = model.coefficients.query("kind == 'slope'")["estimate"].tolist()
    return {f"slope {i}": slope for i, slope in enumerate(slopes)} | {"log likelihood": model.log_likelihood}


def _statsmodels_model(table: Any) -> Numbers:
    from statsmodels.miscmodels.ordinal_model import OrderedModel

    names = [name for name in table if name != "y"]
    x = pd.get_dummies(table[names], drop_first=True, dtype=float)
    fit = OrderedModel(table["y"], x, distr="logit").fit(method="bfgs", disp=False)
    slopes = fit.params.iloc[: x.shape[1]].tolist()
    return {f"slope {i}": slope for i, slope in enumerate(slopes)} | {"log likelihood": float(fit.llf)}


_FRIEDMAN: tuple[Way, ...] = (
    ("palpate", "pandas", _our_friedman),
    ("pingouin", "pingouin", _pingouin_friedman),
    ("scipy", "scipy", _scipy_friedman),
)
_SIGNED: tuple[Way, ...] = (
    ("palpate", "pandas", _our_signed),
    ("scipy, exact", "scipy", _scipy_signed),
    ("scipy, as it is called", "scipy", _scipy_signed_auto),
    ("pingouin", "pingouin", _pingouin_signed),
)
_RANGE: tuple[Way, ...] = (
    ("palpate", "pandas", _our_range),
    ("scipy", "scipy", _scipy_range),
    ("statsmodels", "statsmodels", _statsmodels_range),
)
_MODEL: tuple[Way, ...] = (
    ("palpate", "pandas", _our_model),
    ("statsmodels OrderedModel", "statsmodels", _statsmodels_model),
)
