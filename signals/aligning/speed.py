"""Speed from positions: the slope of a polynomial fitted to a window of samples (Savitzky and Golay 1964).

Every estimate states its noise, its bias and its delay. Nothing is estimated across a missing sample.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from palpate.signals.aligning.refusals import AlignError
from palpate.signals.arrays import Array

Place = Literal["middle", "end"]


@dataclass(frozen=True)
class Slope:
    """The derivative of a least-squares polynomial of `degree` over `window` samples, as weights of the samples.

    In the `middle` the phase is zero, and a value is known (window - 1) / 2 samples after its instant. At the `end` it
    is known at once, because the weights cover past samples only.
    """

    window: int
    degree: int
    rate_hz: float
    place: Place
    weights: tuple[float, ...]

    @property
    def noise_gain_per_s(self) -> float:
        """Return the standard deviation of a velocity per standard deviation of the positions (white noise), in 1/s."""
        return math.sqrt(math.fsum(weight * weight for weight in self.weights))

    @property
    def wait_s(self) -> float:
        """Return how long after an instant its velocity is known."""
        return (self.window - 1) / 2 / self.rate_hz if self.place == "middle" else 0.0

    @property
    def lag_s(self) -> float:
        """Return the delay of a steadily changing velocity in s: the value at t was true at t - lag."""
        return -self.moment(2)

    def moment(self, order: int) -> float:
        """Return the estimate's response to the order-th derivative of the position, in s^(order - 1); 1 for the
        first.
        """
        terms = (weight * t_s**order for weight, t_s in zip(self.weights, self._times_s(), strict=True))
        return math.fsum(terms) / math.factorial(order)

    @property
    def bias_order(self) -> int:
        """Return the order of the lowest derivative of the position, above the first, that biases the estimate."""
        # A window that is symmetric about its instant is blind to even derivatives; a fit of even degree n to n + 1.
        order = self.degree + 1
        return order + 1 if self.place == "middle" and order % 2 == 0 else order

    @property
    def bias(self) -> float:
        """Return the factor of the bias: the estimate is too large by it times that derivative, in s^(order - 1)."""
        return self.moment(self.bias_order)

    def response(self, frequency_hz: float) -> complex:
        """Return the ratio of estimated to true velocity of a sinusoid: 1 is perfect, its angle is the phase."""
        omega = 2 * math.pi * frequency_hz
        whole = sum(w * np.exp(1j * omega * t) for w, t in zip(self.weights, self._times_s(), strict=True))
        return complex(whole / (1j * omega))

    def _times_s(self) -> list[float]:
        now = (self.window - 1) / 2 if self.place == "middle" else self.window - 1
        return [(number - now) / self.rate_hz for number in range(self.window)]


def slope(window: int, degree: int, rate_hz: float, place: Place = "middle") -> Slope:
    """Return the weights of an estimate, orthogonalised so that long windows lose no digits.

    Raises:
        AlignError: an even window in the middle, fewer samples than the polynomial has coefficients, no positive rate.
    """
    if degree < 1 or window < degree + 1 or window > 100_001 or (place == "middle" and window % 2 == 0):
        raise AlignError(
            f"a window of {window} samples and degree {degree}: a degree from 1, at least degree + 1 samples, and for "
            "the middle an odd number are expected."
        )
    if not (math.isfinite(rate_hz) and rate_hz > 0):
        raise AlignError(f"{rate_hz} Hz: a rate above 0 is expected.")
    now = (window - 1) / 2 if place == "middle" else window - 1
    half = max(1.0, (window - 1) / 2)
    # In units of half a window about its middle the Legendre basis is nearly orthogonal, whatever the window.
    scaled = (np.arange(window) - (window - 1) / 2) / half
    basis = np.polynomial.legendre.legvander(scaled, degree)
    at = (now - (window - 1) / 2) / half
    slopes = [np.polynomial.legendre.legval(at, np.polynomial.legendre.legder(unit)) for unit in np.eye(degree + 1)]
    q, r = np.linalg.qr(basis)
    weights = q @ np.linalg.solve(r.T, np.array(slopes)) * rate_hz / half
    return Slope(window, degree, rate_hz, place, tuple(map(float, weights)))


def velocity(positions: Array, estimate: Slope) -> Array:
    """Return velocities (n, axes) from evenly sampled positions (n, axes), in which lost samples are NaN.

    A velocity is NaN where its window holds a NaN or reaches beyond the recording: nothing is bridged or extrapolated.
    """
    n, window = len(positions), estimate.window
    velocities = np.full(positions.shape, np.nan)
    if n < window:
        return velocities
    views = np.lib.stride_tricks.sliding_window_view(positions, window, axis=0)
    # Differences from the window's middle sample: far from the origin no digits are lost.
    differences = views - positions[window // 2 : n - window + 1 + window // 2, :, None]
    first = (window - 1) // 2 if estimate.place == "middle" else window - 1
    velocities[first : first + n - window + 1] = differences @ np.array(estimate.weights)
    return velocities


def speed(positions: Array, estimate: Slope, normal: Sequence[float] | None = None) -> Array:
    """Return the speeds (n,), the lengths of the velocities; within the surface of `normal` where one is given
    (4.3.3).
    """
    velocities = velocity(positions, estimate)
    if normal is not None:
        unit = np.asarray(normal, float) / np.linalg.norm(normal)
        if not np.isfinite(unit).all():
            raise AlignError(f"the normal {list(normal)} has no direction.")
        velocities = velocities - np.outer(velocities @ unit, unit)
    return np.asarray(np.linalg.norm(velocities, axis=1))


def floor_mm_s(noise_mm: float, estimate: Slope, axes: int = 3) -> float:
    """Return the apparent speed of a marker at rest, from the noise of each axis (mean of a chi distribution)."""
    ratio = math.exp(math.lgamma((axes + 1) / 2) - math.lgamma(axes / 2))
    return math.sqrt(2) * ratio * noise_mm * estimate.noise_gain_per_s
