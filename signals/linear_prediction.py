"""Linear predictors: estimate them, convert them to and from line spectral frequencies, and test their stability.

An error filter has shape (p + 1,) and begins with 1: e[n] = sum over k of filter[k] x[n - k].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from palpate.signals.arrays import Array

FURTHEST = 0.999
"""Greatest radius of a pole of an exported filter, at any speed and force."""
DAMP = 0.995
"""Factor that is applied to each pole's radius, repeatedly, while a filter's poles lie too far out."""


def burg(stretches: Sequence[Array], order: int) -> tuple[Array, float]:
    """Return the error filter with the least forward and backward error over several stretches, and its mean square
    error.

    Stable by construction (Burg 1975). Stretches that are not longer than `order` are left out; no stretch is predicted
    from another. Zeros give the filter 1 and the error 0.
    """
    forward = [np.asarray(stretch, dtype=np.float64) for stretch in stretches if len(stretch) > order]
    backward = forward
    coefficients = np.ones(1)
    squares = sum(float(stretch @ stretch) for stretch in forward)
    error = squares / max(1, sum(map(len, forward)))
    for _ in range(order):
        forward, backward = [stretch[1:] for stretch in forward], [stretch[:-1] for stretch in backward]
        below = sum(float(f @ f + b @ b) for f, b in zip(forward, backward, strict=True))
        across = sum(float(f @ b) for f, b in zip(forward, backward, strict=True))
        reflection = -2 * across / below if below > np.finfo(float).tiny else 0.0
        coefficients = np.append(coefficients, 0.0) + reflection * np.append(coefficients, 0.0)[::-1]
        forward, backward = (
            [f + reflection * b for f, b in zip(forward, backward, strict=True)],
            [b + reflection * f for f, b in zip(forward, backward, strict=True)],
        )
        error *= 1 - reflection**2
    return coefficients, error


def reflections(filters: Array) -> Array:
    """Return the reflection coefficients (n, p) of error filters (n, p + 1).

    All of them lie within 1 where, and only where, the filter is stable.
    """
    left = np.array(filters, dtype=np.float64)
    order = left.shape[1] - 1
    values = np.empty((len(left), order))
    for place in range(order, 0, -1):
        last = left[:, place].copy()
        values[:, place - 1] = last
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            left = (left[:, :place] - last[:, None] * left[:, place:0:-1]) / (1 - last**2)[:, None]
    return values


def stable_within(filters: Array, radius: float) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return for each filter (n,) whether all poles of 1 / filter lie inside the radius (Schur and Cohn)."""
    with np.errstate(invalid="ignore"):
        is_stable = np.abs(reflections(expanded(filters, radius))) < 1
    return np.asarray(is_stable.all(axis=1))


def expanded(filters: Array, radius: float) -> Array:
    """Return filters with every pole's radius divided by `radius`: filter[k] / radius**k."""
    return np.asarray(filters / radius ** np.arange(np.shape(filters)[-1]))


def damped_within(filter_: Array, radius: float) -> Array:
    """Return the filter with all its poles drawn in by one factor where any lies beyond the radius."""
    while not stable_within(filter_[None], radius)[0]:
        filter_ = expanded(filter_, 1 / DAMP)
    return filter_


def power_gain(filters: Array) -> Array:
    """Return the variances (n,) of the outputs of 1 / filter for white noise of variance 1."""
    return np.asarray(np.prod(1 / (1 - reflections(filters) ** 2), axis=1))


def frequencies_of(filter_: Array) -> Array:
    """Return the line spectral frequencies (p,) of a stable error filter, rising within 0 and pi (Itakura 1975)."""
    longer = np.append(filter_, 0.0)
    signs = (-1.0) ** np.arange(len(longer))
    symmetric, other = longer + longer[::-1], np.cumsum(longer - longer[::-1])[:-1]  # the other has a root at 1
    if len(filter_) % 2:
        symmetric = (signs * np.cumsum(signs * symmetric))[:-1]  # and the symmetric one at -1,
    else:
        other = (signs[:-1] * np.cumsum(signs[:-1] * other))[:-1]  # or, of an odd order, the other too
    angles = np.concatenate([np.angle(np.roots(half)) for half in (symmetric, other)])
    return np.sort(angles[angles > 0])


def filters_of(frequencies: Array) -> Array:
    """Return the error filters (n, p + 1) of line spectral frequencies (n, p).

    Both halves are products of 2 cos(angle) - 2 cos(frequency) on the unit circle, up to a rotation: multiplied there,
    they keep their digits at any order, which products of polynomials do not.
    """
    order = frequencies.shape[1]
    half = (order + 2) // 2 + 1
    delay = np.exp(-1j * np.pi * np.arange(half) / (half - 1))
    apart = 2 * delay.real - 2 * np.cos(frequencies)[..., None]
    products = [np.prod(apart[:, start::2], axis=1) for start in (0, 1)]
    if order % 2:
        on_circle = delay ** ((order + 1) // 2) * (products[0] + products[1] * (1 / delay - delay))
    else:
        on_circle = delay ** (order // 2) * (products[0] * (1 + delay) + products[1] * (1 - delay))
    return np.asarray(np.fft.irfft(on_circle / 2, axis=1)[:, : order + 1])


def predictor_of(order: int) -> Callable[[Array], Array]:
    """Return the map from line spectral frequencies (n, order) to the weights (n, order) of the past, newest first.

    With P and Q, the symmetric and the antisymmetric polynomial whose roots are e^(+-j f) of every second frequency, A
    = (P + Q) / 2 is the prediction error filter (Itakura 1975; Soong and Juang 1984). Both are products that are real
    up to a rotation on the unit circle, so they are multiplied there and transformed back by two matrices, computed
    once per order. A step takes a third of the time of `filters_of`, whose Fourier transform differs in the last digits
    (1e-14), so both functions are kept.
    """
    half = (order + 2) // 2 + 1
    count = 2 * (half - 1)
    angle = 2 * np.pi * np.arange(half) / count
    at_places = np.exp(-1j * angle)
    turned = at_places ** np.array(order // 2 if order % 2 == 0 else (order + 1) // 2)
    symmetric = turned * (1 + at_places if order % 2 == 0 else 1)
    other = (turned * (1 - at_places)) if order % 2 == 0 else turned / at_places * (1 - at_places**2)
    twice = np.where((np.arange(half) == 0) | (np.arange(half) == half - 1), 1.0, 2.0) / count
    back = np.exp(1j * np.outer(angle, np.arange(1, order + 1))) * twice[:, None]
    of_symmetric, of_other = (-(factor[:, None] * back).real / 2 for factor in (symmetric, other))
    cosines = 2 * np.cos(angle)

    def weights(frequencies: Array) -> Array:
        apart = cosines - 2 * np.cos(frequencies)[..., None]
        first = np.multiply.reduce(apart[:, 0::2], axis=1)
        second = np.multiply.reduce(apart[:, 1::2], axis=1)
        values: Array = first @ of_symmetric + second @ of_other
        return values

    return weights
