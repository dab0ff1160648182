"""A fitted mixed model: its tables and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import pandas as pd

from palpate.analysis.mixed_models.criterion import Solved
from palpate.analysis.mixed_models.optimising import Optimum
from palpate.analysis.mixed_models.problem import Problem
from palpate.analysis.mixed_models.reducing import Reduced
from palpate.analysis.mixed_models.variables import Coding


@dataclass(frozen=True)
class Fit:
    """What a model was computed from; y_scale and y_pivot bring the internal y back to the outcome's unit."""

    problem: Problem
    parts: Reduced
    best: Optimum
    at: Solved
    y_exponent: int
    y_pivot: float


@dataclass(frozen=True)
class MixedModel:
    """A Gaussian linear mixed model, fitted.

    `fixed` has one row per coefficient: effect, estimate, se, df (Satterthwaite), t, p, ci_low, ci_high (Wald,
    Student's t with that df). `effects` has one row per effect, its F test of type III: Source, F, ddof1, ddof2
    (Satterthwaite), p_unc. `variances` has one row per random effect and the residual: group, effect, variance, sd,
    icc (the group's share of the variance that the fixed effects leave, in its first row); `correlations` one row per
    pair of correlated effects. `criterion` is the REML criterion or the deviance; `log_likelihood`, `aic` and `bic`
    (its n is the number of values, as in lme4) belong to it. `marginal_r2` and `conditional_r2` are Nakagawa &
    Schielzeth's, with Johnson's 2014 mean variance for slopes. `singular` says that some variance is zero or some
    correlation one, and `notes` which. `slope` and `distance` are the evidence of convergence: the largest derivative
    of the deviance, and the deviance that a further step promises.
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
