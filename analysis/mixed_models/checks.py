"""Checks before a fit is tried and before its result is returned."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from itertools import combinations

import numpy as np

from palpate.analysis.mixed_models.design import Random
from palpate.analysis.mixed_models.optimising import SIZES, Optimum, Parameters
from palpate.analysis.mixed_models.problem import WIDEST, Problem, Reduced, Solved, block_factor, outside_width, solve
from palpate.analysis.statistics.doubles import ROUNDING, Floats, rescaled
from palpate.analysis.statistics.refusals import (
    BadOption,
    BadValue,
    NoResidual,
    NotIdentified,
    RankDeficient,
    UnknownColumn,
    listed,
    shown,
)

DEPENDENT = 1e-10  # a column whose new part is a smaller share of it adds nothing
NOISE = 1e-7  # how much of the residual rounding may be
SINGULAR = 1e-4
LARGEST_EXPONENT = 505  # of the outcome's size in powers of two: its square is a normal double


def check_call(
    fixed: Sequence[str],
    random: Mapping[str, Sequence[str]],
    numeric: Sequence[str],
    uncorrelated: Sequence[str],
    coding: object,
    reml: object,
    confidence: float,
) -> None:
    """Raise an error for a contradictory call, before any table is read."""
    if not isinstance(random, Mapping) or not random:
        raise BadOption("random names no grouping factor; give {'participant': []} or more, slopes in the list")
    if isinstance(fixed, str) or any(isinstance(slopes, str) for slopes in random.values()):
        raise BadOption("fixed and the slopes of random are lists of columns; found a single text")
    if not isinstance(coding, str) or coding not in ("treatment", "sum"):
        raise BadOption(f"coding={shown(coding)} is unknown: 'treatment' or 'sum'")
    if not isinstance(reml, bool):
        raise BadOption(f"reml={shown(reml)} is unknown: True or False")
    if not 0 < confidence < 1:
        raise BadOption(f"confidence={shown(confidence)} is not a share; give a number between 0 and 1, such as 0.95")
    if strange := [name for name in uncorrelated if name not in random]:
        raise UnknownColumn(f"uncorrelated names {listed(map(repr, strange), len(strange))}, no grouping factor")
    if alone := [name for name in uncorrelated if not random[name]]:
        raise BadOption(f"uncorrelated={alone[0]!r} has no effect: {alone[0]!r} has an intercept only; leave it out")
    if both := [name for name in fixed if name in random]:
        raise BadOption(f"{both[0]!r} is a fixed effect and a grouping factor; it can be one of them")
    if both := [name for name in numeric if name in random]:
        raise BadOption(f"{both[0]!r} is numeric and a grouping factor; it can be one of them")


def refuse_rank_deficient(problem: Problem, parts: Reduced, names: Sequence[str]) -> None:
    """Raise RankDeficient for fixed effects that are linear combinations of earlier ones, or as many as values."""
    if problem.columns >= len(problem.y):
        raise RankDeficient(f"{problem.columns} fixed effects for {len(problem.y)} values; take effects out")
    if outside_width(problem) > WIDEST:
        raise NotIdentified(
            f"{outside_width(problem):,} random effects are crossed with the largest grouping factor; more than "
            f"{WIDEST:,} do not fit into memory: nest grouping factors ('a:b') or take one out"
        )
    triangle = without_random(problem, parts).fixed_triangle
    norms = np.sqrt((triangle**2).sum(axis=0))
    dependent = np.abs(np.diag(triangle)) < DEPENDENT * norms
    alias = [names[i] for i in np.flatnonzero(dependent).tolist()]
    if alias:
        raise RankDeficient(
            f"the fixed effects {listed(map(repr, alias), len(alias))} are combinations of those before them, so their "
            "coefficients have no value; is a cell of the design empty, or one column a function of others? "
            "Take the interaction or the column out"
        )


def refuse_indistinguishable(problem: Problem) -> None:
    """Raise NotIdentified for grouping factors that the data cannot separate: equal ones, and one that is also fixed.

    Their likelihood is flat in a direction, so that any value along it would be as good as any other.
    """
    for a, b in combinations(problem.random, 2):
        both = np.unique(a.codes * len(b.levels) + b.codes).size
        if both == len(a.levels) == len(b.levels):
            raise NotIdentified(
                f"grouping factors {a.name!r} and {b.name!r} have the same groups, so their variances cannot be "
                "separated; remove one of them"
            )
    few = [term for term in problem.random if len(term.levels) <= problem.columns]
    basis = np.linalg.qr(problem.fixed.columns(slice(None), len(problem.y)))[0] if few else np.empty((0, 0))
    for term in few:
        # The fixed effects determine the groups where the indicator of every group lies in the span of `basis`.
        sums = np.zeros((len(term.levels), basis.shape[1]))
        np.add.at(sums, term.codes, basis)
        sizes = np.bincount(term.codes, minlength=len(term.levels))
        if ((sums**2).sum(axis=1) > sizes * (1 - DEPENDENT)).all():
            raise NotIdentified(
                f"the fixed effects tell the levels of grouping factor {term.name!r} apart already, so the data say "
                "nothing of a variance between them; take the grouping factor or those fixed effects out"
            )


def refuse_unit(exponent: int, dv: Hashable) -> None:
    """Refuse an outcome whose squares, and so its variances, are beyond double precision."""
    if abs(exponent) > LARGEST_EXPONENT:
        raise BadValue(
            f"the values of column {dv!r} differ by about 1e{round(exponent * math.log10(2)):+d}, so their variances "
            "are beyond double precision; give the outcome in another unit"
        )


def without_random(problem: Problem, parts: Reduced) -> Solved:
    """Fit the fixed effects alone by ordinary least squares."""
    return solve(problem, parts, [np.zeros((term.size, term.size)) for term in problem.random])


def refuse_no_residual(problem: Problem, parts: Reduced, parameters: Parameters, y: Floats, exponent: int) -> None:
    """Raise NoResidual for data that the fixed and random effects fit exactly."""
    sizes = np.full(sum(term.size for term in problem.random), SIZES[-1])
    rss = solve(problem, parts, parameters.diagonal(sizes)).rss
    spread = rescaled(math.sqrt(rss / len(y)), exponent)
    if spread <= ROUNDING * float(np.abs(y).max()):
        raise NoResidual(
            "the fixed and random effects together leave no residual but the rounding of the numbers "
            f"({spread:.2g}); a mixed model needs values that vary within its cells"
        )


def refuse_beyond_doubles(problem: Problem, parts: Reduced, best: Optimum, at: Solved) -> None:
    """Refuse effects so much larger than the residual that double precision loses the residual."""
    factors = best.parameters.factors(best.free)
    inside = block_factor(problem, factors)
    several = [np.abs(batch.through @ inside).max() for batch in parts.batches if batch.through.shape[1] > 1]
    largest = max([float(np.linalg.norm(at.triangle[:, -1])) / math.sqrt(at.rss), *map(float, several)])
    if largest * 2.0**-52 > NOISE:
        raise NoResidual(
            f"the effects are {largest:.1g} times larger than the residual; double precision cannot tell the residual "
            "from rounding: check the outcome's unit and its outliers"
        )


def singular_notes(random: Sequence[Random], best: Optimum) -> tuple[str, ...]:
    """Return notes on singular fits: zero variances, and combinations of effects without any, in natural units."""
    notes = []
    for term, factor, unit in zip(random, best.parameters.factors(best.free), best.parameters.natural, strict=True):
        scaled = factor / unit[:, None]
        none = [effect for effect, row in zip(term.effects, scaled, strict=True) if not row.any()]
        if len(none) == term.size:
            notes.append(f"singular fit: no variance between levels of {term.name!r}")
        elif none and not term.correlated:
            notes.append(f"singular fit: no variance of {listed(map(repr, none), len(none))} in {term.name!r}")
        elif np.linalg.svd(scaled, compute_uv=False)[-1] < SINGULAR:
            notes.append(f"singular fit: random effects of {term.name!r} have a correlation of 1 or -1, or no variance")
    return tuple(notes)
