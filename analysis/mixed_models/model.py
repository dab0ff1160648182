"""Gaussian linear mixed models by penalised least squares: Bates, Mächler, Bolker & Walker 2015, JSS 67(1).

R squared: Nakagawa & Schielzeth 2013, Johnson 2014.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.mixed_models.checks import (
    check_call,
    refuse_beyond_doubles,
    refuse_indistinguishable,
    refuse_no_residual,
    refuse_rank_deficient,
    refuse_unit,
    singular_notes,
    without_random,
)
from palpate.analysis.mixed_models.design import (
    Coding,
    Design,
    Factor,
    Random,
    effects_of,
    factor_of,
    factor_variable,
    group_columns,
    number_variable,
    random_effects_of,
    type_three,
)
from palpate.analysis.mixed_models.optimising import Counted, Optimum, find_optimum, natural_parameters
from palpate.analysis.mixed_models.problem import (
    Problem,
    Reduced,
    Solved,
    best_layout,
    degrees_of_freedom,
    deviance,
    reduce_problem,
    solve,
)
from palpate.analysis.mixed_models.satterthwaite import (
    correlations_table,
    covariances,
    effects_table,
    fixed_table,
    uncertainty,
    variances_table,
)
from palpate.analysis.statistics.cells import Missing, check_columns, check_options, coded, numbers_of
from palpate.analysis.statistics.doubles import Floats, difference, scaled
from palpate.analysis.statistics.one_thread import one_thread
from palpate.analysis.statistics.refusals import (
    BadValue,
    IncompleteCells,
    TooFew,
    listed,
    refuse_idle,
    refuse_idle_levels,
)

STEP = 65536


@dataclass(frozen=True)
class _Formula:
    """The specification of a model: the table, the roles of its columns, and the options."""

    dv: Hashable
    table: Table
    fixed: tuple[str, ...]
    interactions: tuple[str, ...]
    random: Mapping[str, Sequence[str]]
    numeric: tuple[str, ...]
    factors: Mapping[str, Factor]
    uncorrelated: tuple[str, ...]
    coding: Coding

    def design(self, coding: Coding) -> Design:
        """Return the fixed effects in a coding."""
        variables = {
            name: number_variable(self.table.frame[name], name)
            if name in self.numeric
            else factor_variable(self.factors[name], coding)
            for name in self.fixed
        }
        return Design(variables, effects_of(self.fixed, self.interactions))

    def terms(self) -> tuple[Random, ...]:
        """Return the random effects of each grouping factor, in the order of their names."""
        return tuple(
            random_effects_of(
                self.table.frame, name, self.random[name], self.factors, self.coding, name not in self.uncorrelated
            )
            for name in sorted(self.random)
        )


def mixed_model(
    data: pd.DataFrame,
    dv: Hashable,
    fixed: Sequence[str],
    random: Mapping[str, Sequence[str]],
    *,
    numeric: Sequence[str] = (),
    interactions: Sequence[str] = (),
    uncorrelated: Sequence[str] = (),
    coding: Coding = "treatment",
    levels: Mapping[str, Sequence[Any]] | None = None,
    reml: bool = True,
    missing: Missing = "raise",
    confidence: float = 0.95,
) -> MixedModel:
    """Fit a linear mixed model to a long table, one row per value; an intercept is always in it.

    `fixed` are columns taken as factors, `numeric` columns taken as numbers (fixed effects too), `interactions` are
    "a:b" of them. `random` maps each grouping factor (a column, or "a:b" for the levels of b within a) to the columns
    whose slopes vary; grouping factors may be nested or crossed. A level's random effects are correlated unless
    `uncorrelated` names their grouping factor.
    `coding` is that of the reported coefficients, "treatment" (against the first level) or "sum"; `levels` gives a
    factor's order where the natural one is not meant. `missing="listwise"` leaves out rows without a value.
    Raises a StatisticsError (a ValueError) that names what is wrong, also where the maximum was not reached.
    """
    check_call(fixed, random, numeric, uncorrelated, coding, reml, confidence)
    fixed = tuple(dict.fromkeys([*fixed, *numeric])) if len(set(fixed)) == len(fixed) else tuple(fixed)
    slopes = [
        part
        for of_group in random.values()
        for slope in of_group
        for part in ([slope] if slope in data.columns else slope.split(":"))
    ]
    used = list(dict.fromkeys([*fixed, *slopes]))
    numbers = [name for name in used if name in numeric]
    groups = group_columns(list(random), list(data.columns))
    texts = list(dict.fromkeys([name for name in used if name not in numeric] + groups))
    table = read_table(data, dv, texts, numbers, missing)
    refuse_constant(table.y, dv)
    order = levels or {}
    factors_used = [name for name in used if name not in numeric]
    refuse_idle_levels(order, factors_used)
    if not factors_used:
        refuse_idle("coding", coding, "treatment", "without a factor")
    factors = {name: factor_of(table.frame[name], name, order.get(name)) for name in used if name not in numeric}
    formula = _Formula(
        *(dv, table, tuple(fixed), tuple(interactions), random, tuple(numeric), factors, tuple(uncorrelated), coding)
    )
    with one_thread():
        return _fitted(formula, reml, confidence)


def _fitted(formula: _Formula, reml: bool, confidence: float) -> MixedModel:
    y, random = formula.table.y, formula.terms()
    pivot = float(np.sort(y)[len(y) // 2])
    high, low = difference(y, np.full_like(y, pivot))
    high, exponent = scaled(high)
    refuse_unit(exponent, formula.dv)
    design = formula.design("sum")
    problem = Problem(high, np.ldexp(low, -exponent), design, random, best_layout(random, sum(design.widths)))
    parts = reduce_problem(problem)
    unit = (exponent, pivot)
    parameters = natural_parameters(problem)
    refuse_rank_deficient(problem, parts, formula.design(formula.coding).names)
    refuse_indistinguishable(problem)
    refuse_no_residual(problem, parts, parameters, formula.table.y, unit[0])
    counted = Counted(lambda factors: deviance(problem, solve(problem, parts, factors), reml))
    best = find_optimum(counted, parameters)
    at = solve(problem, parts, best.parameters.factors(best.free))
    refuse_beyond_doubles(problem, parts, best, at)
    fit = Fit(problem, parts, best, at, *unit)
    return _described(formula, fit, reml, confidence)


def _described(formula: _Formula, fit: Fit, reml: bool, confidence: float) -> MixedModel:
    problem, factors = fit.problem, fit.best.parameters.factors(fit.best.free)
    degrees = degrees_of_freedom(problem, reml)
    sigma2, reported = fit.at.rss / degrees, formula.design(formula.coding)
    estimates = uncertainty(problem, fit.parts, fit.best, fit.at, reml)
    criterion = fit.best.deviance + degrees * 2 * fit.y_exponent * math.log(2)
    if reml:
        criterion -= 2 * float(np.linalg.slogdet(reported.back())[1])
    count = problem.columns + fit.best.parameters.free + 1
    covariance, means = covariances(problem.random, factors, sigma2), mean_variances(problem, factors, sigma2)
    explained = fixed_variance(problem, fit.at.coefficients)
    total = math.fsum([explained, *means, sigma2])
    notes = singular_notes(problem.random, fit.best)
    return MixedModel(
        fixed=fixed_table(estimates, reported, fit.y_exponent, fit.y_pivot, confidence),
        effects=effects_table(estimates, type_three(problem.fixed, without_random(problem, fit.parts).fixed_triangle)),
        variances=variances_table(problem.random, covariance, means, sigma2, fit.y_exponent),
        correlations=correlations_table(problem.random, covariance, fit.y_exponent),
        groups={term.name: len(term.levels) for term in problem.random},
        values=len(problem.y),
        dropped=formula.table.dropped,
        reml=reml,
        coding=formula.coding,
        criterion=criterion,
        log_likelihood=-criterion / 2,
        aic=criterion + 2 * count,
        bic=criterion + count * math.log(len(problem.y)),
        parameters=count,
        marginal_r2=explained / total,
        conditional_r2=math.fsum([explained, *means]) / total,
        singular=bool(notes),
        notes=notes,
        slope=fit.best.slope,
        distance=fit.best.distance,
        fit=fit,
    )


@dataclass(frozen=True)
class Fit:
    """The inputs of a fit; y_scale and y_pivot convert the internal y to the outcome's unit."""

    problem: Problem
    parts: Reduced
    best: Optimum
    at: Solved
    y_exponent: int
    y_pivot: float


@dataclass(frozen=True)
class MixedModel:
    """A fitted Gaussian linear mixed model.

    `fixed` has one row per coefficient: effect, estimate, se, df (Satterthwaite), t, p, ci_low, ci_high (Wald,
    Student's t with that df). `effects` has one row per effect, its F test of type III: Source, F, ddof1, ddof2
    (Satterthwaite), p_unc. `variances` has one row per random effect and the residual: group, effect, variance, sd, icc
    (the group's share of the variance that the fixed effects leave, in its first row); `correlations` one row per pair
    of correlated effects. `criterion` is the REML criterion or the deviance; `log_likelihood`, `aic` and `bic` (its n
    is the number of values, as in lme4) belong to it. `marginal_r2` and `conditional_r2` are Nakagawa & Schielzeth's,
    with Johnson's 2014 mean variance for slopes. `singular` says whether some variance is zero or some correlation one,
    and `notes` which. `slope` and `distance` show convergence: the largest derivative of the deviance, and the
    predicted gain of a further step.
    """

    fixed: pd.DataFrame
    effects: pd.DataFrame
    variances: pd.DataFrame
    correlations: pd.DataFrame
    groups: Mapping[str, int]
    values: int
    dropped: int
    reml: bool
    coding: Coding
    criterion: float
    log_likelihood: float
    aic: float
    bic: float
    parameters: int
    marginal_r2: float
    conditional_r2: float
    singular: bool
    notes: tuple[str, ...]
    slope: float
    distance: float
    fit: Fit = field(repr=False, compare=False)


def fixed_variance(problem: Problem, coefficients: Floats) -> float:
    """Return the variance (n - 1) of the fixed effects' predictions, in internal units."""
    n = len(problem.y)
    parts = [slice(start, min(start + STEP, n)) for start in range(0, n, STEP)]
    predicted = np.concatenate([problem.fixed.columns(p, p.stop - p.start) @ coefficients for p in parts])
    return float(np.var(predicted, ddof=1))


def mean_variances(problem: Problem, factors: Sequence[Floats], sigma2: float) -> list[float]:
    """Return each random term's variance, averaged over the values: the mean of z' Sigma z."""
    n, variances = len(problem.y), []
    for term, factor in zip(problem.random, factors, strict=True):
        total = 0.0
        for start in range(0, n, STEP):
            rows = slice(start, min(start + STEP, n))
            spread = term.design.columns(rows, rows.stop - start) @ factor
            total += float((spread * spread).sum())
        variances.append(sigma2 * total / n)
    return variances


@dataclass(frozen=True)
class Table:
    """The rows with a value, sorted by content; `dropped` counts the others."""

    frame: pd.DataFrame
    y: Floats
    dropped: int


def read_table(
    data: pd.DataFrame, dv: Hashable, factors: Sequence[str], numbers: Sequence[str], missing: Missing
) -> Table:
    """Return the sorted table of one outcome and these columns.

    Raises UnknownColumn, BadValue, BadOption, IncompleteCells (rows without a value that `missing` does not allow) or
    TooFew (fewer than three rows).
    """
    check_options(missing, None)
    check_columns(data, [dv, *factors, *numbers])
    y = numbers_of(data[dv], dv)
    empty = np.isnan(y)
    if empty.any():
        rows = np.flatnonzero(empty).tolist()
        if missing == "raise":
            where = listed((f"row {row + 1}" for row in rows), len(rows))
            raise IncompleteCells(
                f"column {dv!r} has no value in {where}; a mixed model needs no value for every cell: "
                "pass missing='listwise' to leave these rows out"
            )
    complete = data.loc[~empty, [*factors, *numbers]] if empty.any() else data[[*factors, *numbers]]
    y = y[~empty]
    if len(y) < 3:
        raise TooFew(f"{len(y)} rows have a value in column {dv!r}; a mixed model needs many more")
    # The last key sorts first; rows that share all of them are the same in everything.
    values = [numbers_of(complete[name], name) for name in numbers]
    codes = [coded(complete[name], name).codes for name in sorted(factors)]
    order = np.lexsort([y, *values, *codes])
    return Table(complete.iloc[order].reset_index(drop=True), y[order], int(empty.sum()))


def refuse_constant(y: Floats, dv: Hashable) -> None:
    """Raise TooFew for an outcome without variation."""
    if y.min() == y.max():
        raise BadValue(f"column {dv!r} has one value, {y[0]:g}, in every row; there is nothing to explain")
