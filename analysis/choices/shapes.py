"""The shapes of a psychometric function: F(z), z = (t - centre) / spread, t the level or its logarithm.

| shape | F(z) | t | in words |
|---|---|---|---|
| logistic | 1 / (1 + exp(-z)) | level | centre is x.50, slope of the logit is 1 / spread |
| gaussian | Phi(z) | level | centre is x.50, spread the standard deviation |
| weibull | 1 - exp(-exp(z)) | log level | = 1 - exp(-(x / a)^b), a = exp(centre) (x.632), b = 1 / spread |
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import expit, logit, ndtr, ndtri

from palpate.analysis.statistics.doubles import Floats

ROOT = float(np.sqrt(2 * np.pi))


@dataclass(frozen=True)
class Shape:
    """`share` is F, `rest` 1 - F with its digits kept, `steepness` F', `place` the z at which F has a value."""

    name: str
    logarithmic: bool
    share: Callable[[Floats], Floats]
    rest: Callable[[Floats], Floats]
    steepness: Callable[[Floats], Floats]
    place: Callable[[float], float]


def _gumbel_steepness(z: Floats) -> Floats:
    bounded = np.minimum(z, 700.0)
    result: Floats = np.exp(bounded - np.exp(bounded))
    return result


def _exp(z: Floats) -> Floats:
    result: Floats = np.exp(np.minimum(z, 700.0))
    return result


SHAPES: Mapping[str, Shape] = {
    "logistic": Shape(
        "logistic",
        False,
        lambda z: np.asarray(expit(z)),
        lambda z: np.asarray(expit(-z)),
        lambda z: np.asarray(expit(z) * expit(-z)),
        lambda p: float(logit(p)),
    ),
    "gaussian": Shape(
        "gaussian",
        False,
        lambda z: np.asarray(ndtr(z)),
        lambda z: np.asarray(ndtr(-z)),
        lambda z: np.exp(-0.5 * z * z) / ROOT,
        lambda p: float(ndtri(p)),
    ),
    "weibull": Shape(
        "weibull",
        True,
        lambda z: -np.expm1(-_exp(z)),
        lambda z: np.exp(-_exp(z)),
        _gumbel_steepness,
        lambda p: float(np.log(-np.log1p(-p))),
    ),
}
