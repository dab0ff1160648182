"""The shapes of a psychometric function and its coordinates.

F(z), z = (t - centre) / spread, t the level or its logarithm:

| shape | F(z) | t | in words |
|---|---|---|---|
| logistic | 1 / (1 + exp(-z)) | level | centre is x.50, slope of the logit is 1 / spread |
| gaussian | Phi(z) | level | centre is x.50, spread the standard deviation |
| weibull | 1 - exp(-exp(z)) | log level | = 1 - exp(-(x / a)^b), a = exp(centre) (x.632), b = 1 / spread |
| weibull_db | 1 - exp(-exp(z)) | level in dB | = 1 - exp(-10^(b (x - centre) / 20)), b = 20 / (spread ln 10) |

To profile the likelihood of a quantity, such as the threshold, it must be a parameter itself: each set of coordinates
(first, second) maps to (centre, log spread), with the derivatives of that map.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from scipy.special import expit, logit, ndtr, ndtri

from palpate.analysis.statistics.doubles import Floats

ROOT = float(np.sqrt(2 * np.pi))
JndKind: TypeAlias = Literal["half_interquartile", "x84_x50"]
Mapped = tuple[Floats, Floats, Floats]
Curve = tuple[Floats, Floats, Floats]


@dataclass(frozen=True)
class Shape:
    """A shape: `share` is F, `rest` 1 - F without lost digits, `place` the z at which F has a value.

    `curve` returns F, 1 - F and F' at once, which have most of their work in common.
    """

    name: str
    logarithmic: bool
    share: Callable[[Floats], Floats]
    rest: Callable[[Floats], Floats]
    curve: Callable[[Floats], Curve]
    place: Callable[[float], float]


def _exp(z: Floats) -> Floats:
    result: Floats = np.exp(np.minimum(z, 700.0))
    return result


def _logistic_curve(z: Floats) -> Curve:
    share, rest = np.asarray(expit(z)), np.asarray(expit(-z))
    return share, rest, share * rest


def _gaussian_curve(z: Floats) -> Curve:
    return np.asarray(ndtr(z)), np.asarray(ndtr(-z)), np.exp(-0.5 * z * z) / ROOT


def _weibull_curve(z: Floats) -> Curve:
    bounded = np.minimum(z, 700.0)
    power = np.exp(bounded)
    return -np.expm1(-power), np.exp(-power), np.exp(bounded - power)


def _weibull(name: str, logarithmic: bool) -> Shape:
    return Shape(
        name,
        logarithmic,
        lambda z: -np.expm1(-_exp(z)),
        lambda z: np.exp(-_exp(z)),
        _weibull_curve,
        lambda p: float(np.log(-np.log1p(-p))),
    )


SHAPES: Mapping[str, Shape] = {
    "logistic": Shape(
        "logistic",
        False,
        lambda z: np.asarray(expit(z)),
        lambda z: np.asarray(expit(-z)),
        _logistic_curve,
        lambda p: float(logit(p)),
    ),
    "gaussian": Shape(
        "gaussian",
        False,
        lambda z: np.asarray(ndtr(z)),
        lambda z: np.asarray(ndtr(-z)),
        _gaussian_curve,
        lambda p: float(ndtri(p)),
    ),
    "weibull": _weibull("weibull", True),
    "weibull_db": _weibull("weibull_db", False),
}


@dataclass(frozen=True)
class Coordinates:
    """A set of coordinates: `native` maps (first, second) to (centre, log spread, derivatives[..., 2, 2]), `of` back.

    `ends_in_spread`: the second coordinate is the log spread itself.
    """

    native: Callable[[Floats, Floats], Mapped]
    of: Callable[[Floats, Floats], tuple[Floats, Floats]]
    ends_in_spread: bool = True


def own() -> Coordinates:
    """Return the coordinates (centre, log spread) themselves."""

    def native(first: Floats, second: Floats) -> Mapped:
        return first, second, np.broadcast_to(np.eye(2), (*first.shape, 2, 2))

    return Coordinates(native, lambda centre, log_spread: (centre, log_spread))


def by_threshold(shape: Shape, level: float) -> Coordinates:
    """Return the coordinates (t at which F is `level`, log spread)."""
    z = shape.place(level)

    def native(first: Floats, second: Floats) -> Mapped:
        slopes = np.zeros((*first.shape, 2, 2))
        slopes[..., 0, 0] = slopes[..., 1, 1] = 1.0
        slopes[..., 0, 1] = -z * np.exp(second)
        return first - z * np.exp(second), second, slopes

    return Coordinates(native, lambda centre, log_spread: (centre + z * np.exp(log_spread), log_spread))


def jnd_ends(kind: JndKind) -> tuple[float, float, float]:
    """Return the weight, and the two values of F whose levels' difference is the JND."""
    return (0.5, 0.75, 0.25) if kind == "half_interquartile" else (1.0, float(ndtr(1.0)), 0.5)


def by_jnd(shape: Shape, kind: JndKind) -> Coordinates:
    """Return the coordinates (log JND, centre), for a logarithmic shape (log JND, log spread)."""
    weight, high, low = jnd_ends(kind)
    up, down = shape.place(high), shape.place(low)
    if shape.logarithmic:
        return _logarithmic(weight, up, down)
    unit = weight * (up - down)

    def native(first: Floats, second: Floats) -> Mapped:
        slopes = np.zeros((*first.shape, 2, 2))
        slopes[..., 0, 1] = slopes[..., 1, 0] = 1.0
        return second, first - np.log(unit), slopes

    return Coordinates(native, lambda centre, log_spread: (log_spread + np.log(unit), centre), False)


def _logarithmic(weight: float, up: float, down: float) -> Coordinates:
    """Return the coordinates of JND = weight (exp(centre + up s) - exp(centre + down s)), with the spread s."""

    def gap(log_spread: Floats) -> tuple[Floats, Floats]:
        s = np.exp(log_spread)
        ratio = np.exp((down - up) * s)
        rest = -np.expm1((down - up) * s)
        return np.log(weight) + up * s + np.log(rest), s * (up - down * ratio) / rest

    def native(first: Floats, second: Floats) -> Mapped:
        log_gap, slope = gap(second)
        slopes = np.zeros((*first.shape, 2, 2))
        slopes[..., 0, 0] = slopes[..., 1, 1] = 1.0
        slopes[..., 0, 1] = -slope
        return first - log_gap, second, slopes

    return Coordinates(native, lambda centre, log_spread: (centre + gap(log_spread)[0], log_spread))
