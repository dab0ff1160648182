"""Figures of the mixed models: errors of variances and fixed effects beside the time, of Palpate and statsmodels."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from benchmarks.statistics.inputs import long_table
from palpate.analysis.mixed_models.model import mixed_model
from palpate.analysis.statistics.references import reference_table, reference_values
from palpate.analysis.statistics.refusals import StatisticsError
from palpate.protocols.bench import Case

Numbers: TypeAlias = tuple[list[float], list[float]]
"""Fixed effects and variances (those of the random effects, then the residual's)."""

AREA = "statistics"
FIXED, VARIANCES = "relative, worst of the fixed effects", "relative, worst of the variances"
SHIPPED = {
    "lmm_sleepstudy_slope_REML": ("days", "days", True),
    "lmm_sleepstudy_slope_ML": ("days", "days", True),
    "lmm_sleepstudy_int_REML": ("days", None, True),
    "lmm_ergoStool_REML": ("type", None, False),
    "lmm_md15_int": ("time", None, False),
}


@dataclass(frozen=True)
class Input:
    """A table with its model and the right numbers; `slope` varies between the levels of the first group."""

    name: str
    table: pd.DataFrame
    effect: str | None
    slope: str | None
    numeric: bool
    groups: Sequence[str]
    reml: bool
    answer: Callable[[], Numbers]
    against: str
    repeats: int = 3


def cases(quick: bool) -> Iterator[Case]:
    """Yield every figure of the mixed models; without `quick` also 5,000 participants by 90 stimuli."""
    inputs = [*_shipped(), *_balanced(), *map(_crossed, ((200, 30),) if quick else ((200, 30), (5000, 90)))]
    for data in inputs:
        for method, run in _methods(data):
            for place, kind in enumerate((FIXED, VARIANCES)):
                error = partial(_worst, data=data, place=place)
                title = f"mixed model, {'fixed effects' if place == 0 else 'variances'}"
                arguments = (data.name, len(data.table), f"{kind}; {data.against}", run, error, data.repeats)
                yield Case(AREA, title, method, *arguments)


def _methods(data: Input) -> Iterator[tuple[str, Callable[[], Numbers | None]]]:
    yield "palpate", partial(_ours, data)
    # MixedLM has one grouping factor; crossed ones become one group with a matrix of all values by all levels.
    if find_spec("statsmodels") is not None and len(data.groups) == 1:
        yield "statsmodels MixedLM", partial(_statsmodels, data)


def _ours(data: Input) -> Numbers | None:
    slopes = [data.slope] if data.slope else []
    random: Mapping[str, Sequence[str]] = {group: slopes if i == 0 else [] for i, group in enumerate(data.groups)}
    effects = [data.effect] if data.effect else []
    try:
        model = mixed_model(data.table, "y", effects, random, numeric=effects if data.numeric else [], reml=data.reml)
    except StatisticsError:
        return None
    return model.fixed["estimate"].tolist(), model.variances["variance"].tolist()


def _statsmodels(data: Input) -> Numbers | None:
    from statsmodels.formula.api import mixedlm

    effect = data.effect if data.numeric else f"C({data.effect})"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        slope = f"~{data.slope}" if data.slope else None
        model = mixedlm(f"y ~ {effect}", data.table, groups=data.table[data.groups[0]], re_formula=slope)
        fit = model.fit(reml=data.reml)
    return fit.fe_params.tolist(), [*np.diag(fit.cov_re).tolist(), float(fit.scale)]


def _worst(numbers: Numbers | None, data: Input, place: int) -> float | None:
    """Return the largest relative error of fixed effects (place 0) or variances (1); None for a refusal."""
    if numbers is None:
        return None
    errors = [abs(a - b) / abs(b) for a, b in zip(numbers[place], data.answer()[place], strict=True)]
    return math.nan if any(map(math.isnan, errors)) else max(errors)


def _shipped() -> Iterator[Input]:
    """Yield the reference sets with R's values (lme4 with bobyqa, accurate to about 1e-8 in the variances)."""
    values = reference_values("r_reference")
    for name, (effect, slope, numeric) in SHIPPED.items():
        r = values[name]
        variances = [row["vcov"] for row in r["varcorr"] if row["var2"] is None]
        answer = partial(_numbers, list(r["fixef"].values()), variances)
        table = reference_table(f"csv/{r['csv']}")
        reml = "REML=TRUE" in r["call"]
        yield Input(name, table, effect, slope, numeric, ("subject",), reml, answer, "against R's lme4")


def _numbers(fixed: list[float], variances: list[float]) -> Numbers:
    return fixed, variances


def _balanced() -> Iterator[Input]:
    """Yield tables of 12 x 4, participants 1, 1e3 and 1e6 residual SDs apart, with the ANOVA's closed form."""
    for size in (1.0, 1e3, 1e6):
        rng = np.random.default_rng(5)
        cells = size * rng.normal(size=(12, 1)) + rng.normal(size=(12, 4)) + np.arange(4)
        answer = partial(_one_way, cells)
        table = long_table(cells, ("subject", "cond"))
        name = f"12 x 4, participants {size:.0e} residuals apart"
        yield Input(name, table, "cond", None, False, ("subject",), True, answer, "against the closed form")


def _one_way(cells: np.ndarray[Any, Any]) -> Numbers:
    """Return fixed effects in treatment coding and both variances, in extended precision."""
    x = cells.astype(np.longdouble)
    n, k = x.shape
    columns, rows = x.mean(axis=0), x.mean(axis=1)
    rest = x - columns - rows[:, None] + x.mean()
    residual = (rest**2).sum() / ((n - 1) * (k - 1))
    between = rows.var(ddof=1) - residual / k
    return [float(columns[0]), *(columns[1:] - columns[0]).astype(float).tolist()], [float(between), float(residual)]


def _crossed(shape: tuple[int, int]) -> Input:
    """Return a complete table of participants crossed with stimuli, again with the closed form."""
    n, k = shape
    rng = np.random.default_rng(n)
    cells = 50 + 10 * rng.normal(size=(n, 1)) + 5 * rng.normal(size=(1, k)) + 7 * rng.normal(size=(n, k))
    table = long_table(cells, ("subject", "stimulus")).sample(frac=1, random_state=n, ignore_index=True)
    answer, name = partial(_two_way, cells), f"{n} participants x {k} stimuli, crossed"
    groups = ("subject", "stimulus")
    return Input(name, table, None, None, False, groups, True, answer, "against the closed form", 1 if n > 1000 else 3)


def _two_way(cells: np.ndarray[Any, Any]) -> Numbers:
    x = cells.astype(np.longdouble)
    n, k = x.shape
    columns, rows = x.mean(axis=0), x.mean(axis=1)
    residual = ((x - columns - rows[:, None] + x.mean()) ** 2).sum() / ((n - 1) * (k - 1))
    people, stimuli = rows.var(ddof=1) - residual / k, columns.var(ddof=1) - residual / n
    # Random terms stand in the order of their names: stimulus, subject.
    return [float(x.mean())], [float(stimuli), float(people), float(residual)]
