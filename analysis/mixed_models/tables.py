"""The tables of a fitted model."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from palpate.analysis.mixed_models.design import Design, Effect
from palpate.analysis.mixed_models.grouping import Random
from palpate.analysis.mixed_models.satterthwaite import Uncertainty, f_test
from palpate.analysis.statistics.doubles import Floats, rescaled
from palpate.analysis.statistics.pvalues import p_note, t_critical, t_two_sided

FIXED = ["effect", "estimate", "se", "df", "t", "p", "ci_low", "ci_high", "note"]
EFFECTS = ["Source", "F", "ddof1", "ddof2", "p_unc", "note"]
VARIANCES = ["group", "effect", "variance", "sd", "icc"]
CORRELATIONS = ["group", "effect_1", "effect_2", "covariance", "correlation", "note"]
NO_CORRELATION = "undefined: a variance is zero"


def fixed_table(found: Uncertainty, design: Design, exponent: int, pivot: float, confidence: float) -> pd.DataFrame:
    """One row per reported coefficient, in the outcome's unit."""
    rows = []
    for i, (name, contrast) in enumerate(zip(design.names, design.back(), strict=True)):
        estimate = rescaled(float(contrast @ found.coefficients), exponent) + (pivot if i == 0 else 0.0)
        se = rescaled(math.sqrt(float(contrast @ found.covariance @ contrast)), exponent)
        df = found.degrees(contrast)
        p, half = t_two_sided(estimate / se, df), t_critical(df, confidence) * se
        rows.append((name, estimate, se, df, estimate / se, p, estimate - half, estimate + half, p_note([p])))
    return pd.DataFrame(rows, columns=FIXED)


def effects_table(found: Uncertainty, contrasts: Mapping[Effect, Floats]) -> pd.DataFrame:
    """One F test per effect, that all of its contrasts are zero."""
    rows = []
    for effect, each in contrasts.items():
        test = f_test(found, each)
        rows.append((":".join(effect), test.f, test.df1, test.df2, test.p, p_note([test.p])))
    return pd.DataFrame(rows, columns=EFFECTS)


def covariances(random: Sequence[Random], factors: Sequence[Floats], sigma2: float) -> list[Floats]:
    """The covariance of each term's reported effects, in the unit of sigma squared."""
    roots = [term.back @ factor for term, factor in zip(random, factors, strict=True)]
    return [sigma2 * (root @ root.T) for root in roots]


def variances_table(
    random: Sequence[Random], covariance: Sequence[Floats], means: Sequence[float], sigma2: float, exponent: int
) -> pd.DataFrame:
    """One row per random effect and the residual; `means` are the terms' mean variances over the values."""
    total, rows = math.fsum([*means, sigma2]), []
    for term, each, mean in zip(random, covariance, means, strict=True):
        for i, (effect, variance) in enumerate(zip(term.effects, np.diag(each).tolist(), strict=True)):
            rows.append((term.name, effect, *_sizes(variance, exponent), mean / total if i == 0 else math.nan))
    rows.append(("Residual", "", *_sizes(sigma2, exponent), math.nan))
    return pd.DataFrame(rows, columns=VARIANCES)


def _sizes(variance: float, exponent: int) -> tuple[float, float]:
    return rescaled(variance, 2 * exponent), rescaled(math.sqrt(variance), exponent)


def correlations_table(random: Sequence[Random], covariance: Sequence[Floats], exponent: int) -> pd.DataFrame:
    """One row per pair of correlated random effects of a grouping factor."""
    rows = [row for term, each in zip(random, covariance, strict=True) for row in _pairs(term, each, exponent)]
    return pd.DataFrame(rows, columns=CORRELATIONS)


def _pairs(term: Random, covariance: Floats, exponent: int) -> Iterator[tuple[Any, ...]]:
    sd = np.sqrt(np.diag(covariance))
    for i in range(term.size if term.correlated else 0):
        for j in range(i):
            product = float(sd[i] * sd[j])
            r = min(1.0, max(-1.0, float(covariance[i, j]) / product)) if product else math.nan
            shared = rescaled(float(covariance[i, j]), 2 * exponent)
            yield term.name, term.effects[j], term.effects[i], shared, r, "" if product else NO_CORRELATION
