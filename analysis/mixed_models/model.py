"""Gaussian linear mixed models by penalised least squares: Bates, Mächler, Bolker & Walker 2015, JSS 67(1)."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
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
from palpate.analysis.mixed_models.contrasts import type_three
from palpate.analysis.mixed_models.criterion import degrees_of_freedom, deviance, solved
from palpate.analysis.mixed_models.design import Design, effects_of
from palpate.analysis.mixed_models.explained import fixed_variance, mean_variances
from palpate.analysis.mixed_models.grouping import Random, group_columns, random_effects_of
from palpate.analysis.mixed_models.optimising import Counted, optimum
from palpate.analysis.mixed_models.parameters import natural
from palpate.analysis.mixed_models.problem import Problem, best_layout
from palpate.analysis.mixed_models.reducing import Reduced, reduced
from palpate.analysis.mixed_models.results import Fit, MixedModel
from palpate.analysis.mixed_models.satterthwaite import uncertainty
from palpate.analysis.mixed_models.table import Table, read_table, refuse_constant
from palpate.analysis.mixed_models.tables import (
    correlations_table,
    covariances,
    effects_table,
    fixed_table,
    variances_table,
)
from palpate.analysis.mixed_models.variables import Coding, Factor, factor_of, factor_variable, number_variable
from palpate.analysis.statistics.cells import Missing
from palpate.analysis.statistics.doubles import difference, scaled
from palpate.analysis.statistics.one_thread import one_thread
from palpate.analysis.statistics.refusals import refuse_idle, refuse_idle_levels


@dataclass(frozen=True)
class _Asked:
    """A question put in full: the table, its columns' roles, and how it is to be answered."""

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
        """The fixed effects, reported in a coding."""
        variables = {
            name: number_variable(self.table.frame[name], name)
            if name in self.numeric
            else factor_variable(self.factors[name], coding)
            for name in self.fixed
        }
        return Design(variables, effects_of(self.fixed, self.interactions))

    def terms(self) -> tuple[Random, ...]:
        """The random effects of each grouping factor, in the order of their names."""
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
    slopes = [part for each in random.values() for slope in each for part in _columns(slope, data)]
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
    asked = _Asked(
        *(dv, table, tuple(fixed), tuple(interactions), random, tuple(numeric), factors, tuple(uncorrelated), coding)
    )
    with one_thread():
        return _fitted(asked, reml, confidence)


def _columns(slope: str, data: pd.DataFrame) -> list[str]:
    return [slope] if slope in data.columns else slope.split(":")


def _fitted(asked: _Asked, reml: bool, confidence: float) -> MixedModel:
    y, random = asked.table.y, asked.terms()
    pivot = float(np.sort(y)[len(y) // 2])
    high, low = difference(y, np.full_like(y, pivot))
    high, exponent = scaled(high)
    refuse_unit(exponent, asked.dv)
    design = asked.design("sum")
    problem = Problem(high, np.ldexp(low, -exponent), design, random, best_layout(random, sum(design.widths)))
    parts = reduced(problem)
    fit = _best(problem, parts, asked, reml, (exponent, pivot))
    return _described(asked, fit, reml, confidence)


def _best(problem: Problem, parts: Reduced, asked: _Asked, reml: bool, unit: tuple[int, float]) -> Fit:
    parameters = natural(problem)
    refuse_rank_deficient(problem, parts, asked.design(asked.coding).names)
    refuse_indistinguishable(problem)
    refuse_no_residual(problem, parts, parameters, asked.table.y, unit[0])
    counted = Counted(lambda factors: deviance(problem, solved(problem, parts, factors), reml))
    best = optimum(counted, parameters)
    at = solved(problem, parts, best.parameters.factors(best.free))
    refuse_beyond_doubles(problem, parts, best, at)
    return Fit(problem, parts, best, at, *unit)


def _described(asked: _Asked, fit: Fit, reml: bool, confidence: float) -> MixedModel:
    problem, factors = fit.problem, fit.best.parameters.factors(fit.best.free)
    degrees = degrees_of_freedom(problem, reml)
    sigma2, shown = fit.at.rss / degrees, asked.design(asked.coding)
    found = uncertainty(problem, fit.parts, fit.best, fit.at, reml)
    criterion = fit.best.deviance + degrees * 2 * fit.y_exponent * math.log(2)
    if reml:
        criterion -= 2 * float(np.linalg.slogdet(shown.back())[1])
    count = problem.columns + fit.best.parameters.free + 1
    covariance, means = covariances(problem.random, factors, sigma2), mean_variances(problem, factors, sigma2)
    explained = fixed_variance(problem, fit.at.coefficients)
    total = math.fsum([explained, *means, sigma2])
    notes = singular_notes(problem.random, fit.best)
    return MixedModel(
        fixed=fixed_table(found, shown, fit.y_exponent, fit.y_pivot, confidence),
        effects=effects_table(found, type_three(problem.fixed, without_random(problem, fit.parts).fixed_triangle)),
        variances=variances_table(problem.random, covariance, means, sigma2, fit.y_exponent),
        correlations=correlations_table(problem.random, covariance, fit.y_exponent),
        groups={term.name: len(term.levels) for term in problem.random},
        values=len(problem.y),
        dropped=asked.table.dropped,
        reml=reml,
        coding=asked.coding,
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
