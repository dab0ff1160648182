"""The random effects of each level: their conditional means, often called best linear unbiased predictors."""

from __future__ import annotations

import numpy as np
import pandas as pd

from palpate.analysis.mixed_models.model import MixedModel
from palpate.analysis.mixed_models.problem import block_factor, outside, whiten, whitening
from palpate.analysis.statistics.doubles import Floats


def random_effects(model: MixedModel) -> pd.DataFrame:
    """Return the conditional means of all random effects, in the outcome's unit: group, level, effect, value.

    A level's fitted line is the fixed effects plus these (Bates et al. 2015, equation 56). Levels are in natural
    order.
    """
    fit = model.fit
    factors = fit.best.parameters.factors(fit.best.free)
    width, triangle = fit.at.width, fit.at.triangle
    known = triangle[:width, -1] - triangle[:width, width:-1] @ fit.at.coefficients
    spherical = np.linalg.solve(triangle[:width, :width], known) if width else known
    internal: dict[int, Floats] = {}  # the effects of each term, (levels, effects), first those outside the blocks
    for i, (term, start) in zip(fit.problem.layout.outside, outside(fit.problem), strict=True):
        stop = start + len(term.levels) * term.size
        internal[i] = spherical[start:stop].reshape(-1, term.size) @ factors[i].T
    problem = fit.problem
    factor_of_block = block_factor(problem, factors)
    other = np.concatenate([*(internal[i].ravel() for i in problem.layout.outside), fit.at.coefficients])
    blocks = np.zeros((problem.layout.blocks, problem.layout.width))
    for batch in fit.parts.batches:
        # What a block sees of y once all other effects are taken off, (blocks, r, 1).
        rest = batch.seen[:, :, -1:] - (batch.seen[:, :, :-1] @ other)[:, :, None]
        lower = whitening(batch, factor_of_block)[batch.which]
        weights = np.linalg.solve(lower.transpose(0, 2, 1), whiten(lower, rest))
        spherical = (batch.through[batch.which] @ factor_of_block).transpose(0, 2, 1) @ weights
        blocks[batch.members] = (factor_of_block @ spherical)[:, :, 0]
    for block in problem.layout.inside:
        term = problem.random[block.term]
        home = np.zeros(len(term.levels), dtype=np.intp)
        home[term.codes] = problem.layout.codes
        first = block.start + block.slots * term.size if block.count > 1 else np.full(len(home), block.start)
        internal[block.term] = blocks[home[:, None], first[:, None] + np.arange(term.size)]
    tables = []
    for i, term in enumerate(fit.problem.random):
        reported = np.ldexp(internal[i] @ term.back.T, fit.y_exponent)
        levels = np.repeat(np.array(term.levels, dtype=object), term.size)
        effects = term.effects * len(term.levels)
        tables.append(pd.DataFrame({"group": term.name, "level": levels, "effect": effects, "value": reported.ravel()}))
    return pd.concat(tables, ignore_index=True).astype({"group": "str", "level": "str", "effect": "str"})
