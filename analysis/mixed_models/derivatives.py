"""Derivatives by central differences, extrapolated once (Richardson): errors of the fourth order in the step."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from palpate.analysis.statistics.doubles import Floats

Vector: TypeAlias = Callable[[Floats], Floats]
Scalar: TypeAlias = Callable[[Floats], float]

STEP = 3e-3
WIDE_STEP = 1e-2


def jacobian(function: Vector, at: Floats, step: float = STEP) -> Floats:
    """The derivatives of a vector function, (parameters, values)."""
    rows = []
    for move in np.eye(len(at)) * step:
        near, far = (function(at + k * move) - function(at - k * move) for k in (1, 2))
        rows.append((8 * near - far) / (12 * step))
    return np.array(rows)


def gradient(function: Scalar, at: Floats, step: float = STEP) -> Floats:
    """The derivatives of a function."""
    derivatives: Floats = jacobian(lambda x: np.array([function(x)]), at, step)[:, 0]
    return derivatives


def rough_gradient(function: Scalar, at: Floats, step: float = 1e-4) -> Floats:
    """The derivatives of a function by plain central differences, for the way to the optimum."""
    moves = np.eye(len(at)) * step
    return np.array([(function(at + move) - function(at - move)) / (2 * step) for move in moves])


def hessian(function: Scalar, at: Floats, step: float = WIDE_STEP) -> Floats:
    """The second derivatives of a function, (parameters, parameters)."""
    k, middle, moves = len(at), function(at), np.eye(len(at)) * step
    result = np.empty((k, k))
    for i in range(k):
        near, far = (function(at + m * moves[i]) - 2 * middle + function(at - m * moves[i]) for m in (1, 2))
        result[i, i] = (16 * near - far) / (12 * step**2)
        for j in range(i):
            near, far = (_crossed(function, at, m * moves[i], m * moves[j]) for m in (1, 2))
            result[i, j] = result[j, i] = (16 * near - far) / (48 * step**2)
    return result


def _crossed(function: Scalar, at: Floats, a: Floats, b: Floats) -> float:
    return function(at + a + b) - function(at + a - b) - function(at - a + b) + function(at - a - b)
