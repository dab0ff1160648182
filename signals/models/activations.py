"""Element-wise activations and softmax, computed in place where the input is no longer needed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from palpate.signals.models.card import Activation
from palpate.signals.models.form import At, Built, Form, KeptValues, Values

SLOPE = 0.2
"""Slope of a leaky relu below zero."""
LEAST = 1e-10
"""Least argument of a logarithm."""
SAFE = 40.0
"""Bound within which exp is far from overflow and underflow, also in single precision."""
ROOT_HALF = float(np.sqrt(0.5))


def activation(step: Activation, form: Form, at: At) -> Built:  # noqa: ARG001 - it fits every form
    """Return the activation function that the card names, as a step."""
    after = replace(form, owned=True)
    if step.function == "softmax":
        return _softmax(form), after
    if step.function == "gelu":
        return _gelu(), after
    function = FUNCTIONS[step.function]

    def run(x: Values, _kept: KeptValues) -> Values:
        return function(x, x if form.owned else None)

    return run, after


def soft(x: Values, axis: int) -> Values:
    """Return exp(x) / sum of exp(x) along an axis, in place; shifted by the maximum where it would over- or
    underflow.
    """
    if not (x.max() < SAFE and x.min() > -SAFE):
        x -= np.maximum.reduce(x, axis=axis, keepdims=True)
    np.exp(x, out=x)
    x /= np.add.reduce(x, axis=axis, keepdims=True)
    return x


def _softmax(form: Form) -> Callable[[Values, KeptValues], Values]:
    axis = 1 if form.length_first or len(form.shape) == 1 else 2

    def run(x: Values, _kept: KeptValues) -> Values:
        return soft(x if form.owned else x.copy(), axis)

    return run


def _gelu() -> Callable[[Values, KeptValues], Values]:
    """Return a function for x times the normal distribution function; by erfc, which keeps its digits far below
    zero.
    """
    from scipy.special import erfc

    def run(x: Values, _kept: KeptValues) -> Values:
        y: Values = erfc(x * -ROOT_HALF)
        y *= x
        y *= 0.5
        return y

    return run


def _sigmoid(x: Values, into: Values | None) -> Values:
    y = np.negative(x, out=into)
    np.exp(y, out=y)
    y += 1
    return np.asarray(np.reciprocal(y, out=y))


def _elu(x: Values, into: Values | None) -> Values:
    below = np.expm1(np.minimum(x, 0))
    return np.asarray(np.add(np.maximum(x, 0, out=into), below, out=below))


def _softplus(x: Values, into: Values | None) -> Values:
    """Return log(1 + exp(x)), also where exp(x) would overflow."""
    beyond = np.log1p(np.exp(-np.abs(x)))
    return np.asarray(np.add(np.maximum(x, 0, out=into), beyond, out=beyond))


def _log(x: Values, into: Values | None) -> Values:
    y = np.maximum(x, LEAST, out=into)
    return np.asarray(np.log(y, out=y))


FUNCTIONS: Mapping[str, Callable[[Values, Values | None], Values]] = {
    "relu": lambda x, into: np.asarray(np.maximum(x, 0, out=into)),
    "tanh": lambda x, into: np.asarray(np.tanh(x, out=into)),
    "sigmoid": _sigmoid,
    "elu": _elu,
    "leaky": lambda x, into: np.asarray(np.maximum(x, x * SLOPE, out=into)),
    "softplus": _softplus,
    "exp": lambda x, into: np.asarray(np.exp(x, out=into)),
    "log": _log,
    "square": lambda x, into: np.asarray(np.multiply(x, x, out=into)),
    "abs": lambda x, into: np.asarray(np.abs(x, out=into)),
}
