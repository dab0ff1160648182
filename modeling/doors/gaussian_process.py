"""A Gaussian process on the engineered features: one kernel for all attributes, by marginal likelihood."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.preparing import Featured, featured, on_one_thread, rows_of
from palpate.modeling.files.model_files import Exported
from palpate.modeling.regression import standard_of
from palpate.signals.arrays import Array
from palpate.signals.models.card import Affine, Kernel

LENGTHS: Array = np.logspace(-1, 2, 31)
"""Lengths that are tried, as multiples of the square root of the number of features."""
NOISES: Array = np.logspace(-6, 3, 73)
"""Shares of noise that are tried: noise variance over kernel variance."""


@dataclass(frozen=True)
class Process:
    """A Gaussian process.

    It maps z to k(z, points) weights on standardised ratings; k = variance * exp(-|z - p|^2 / (2 length^2)).
    """

    points: Array
    weights: Array
    precision: Array
    """The inverse of the kernel matrix with its noise, both over the kernel's variance."""
    length: float
    variance: float
    noise: float
    """Noise variance over kernel variance."""


@dataclass(frozen=True)
class GaussianProcess:
    """A fitted model: posterior mean, and SD of a new answer (Rasmussen and Williams 2006, eq. 2.25, 2.26)."""

    front: Featured
    process: Process
    gain: Array
    offset: Array

    def predict(self, given: Array) -> Array:
        """Return ratings (n, attributes) on 0..100, not clipped, of profiles (n, 621) in newtons."""
        process = self.process
        kernel = process.variance * _correlation(_squares(self.front(given), process.points), process.length)
        return kernel @ process.weights * self.gain + self.offset

    def deviation(self, given: Array) -> Array:
        """Return the SD of a new mean rating (n, attributes) on 0..100, noise included."""
        process = self.process
        like = _correlation(_squares(self.front(given), process.points), process.length)
        share = 1 + process.noise - np.einsum("ni,ij,nj->n", like, process.precision, like)
        sd: Array = np.sqrt(process.variance * np.maximum(share, process.noise))[:, None] * self.gain
        return sd

    def exported(self) -> Exported:
        """Return the steps: features, standardising, one kernel, and back to 0..100."""
        kernel = Kernel(
            points="points", weights="kernel_weights", length=self.process.length, variance=self.process.variance
        )
        own = {"points": self.process.points, "kernel_weights": self.process.weights}
        back = {"rating_gain": self.gain, "rating_offset": self.offset}
        steps = (*self.front.steps, kernel, Affine(gain="rating_gain", offset="rating_offset"))
        return Exported(steps, {**self.front.tensors, **own, **back})


@on_one_thread
def fit(learning: Learning) -> GaussianProcess:
    """Fit a squared exponential kernel with white noise to standardised features and ratings.

    Raises ModelDataError for data that cannot be learned from.
    """
    rows = rows_of(learning, least=2)
    front, z = featured(rows)
    standard = standard_of(rows.rating)
    process = fit_process(z, standard(rows.rating))
    learning.report(f"gaussian_process: length {process.length:.3g}, noise {process.noise:.3g} of the variance")
    gain = np.where(standard.gain > 0, rows.rating.std(axis=0), 0.0)
    return GaussianProcess(front, process, gain, rows.rating.mean(axis=0))


def fit_process(z: Array, y: Array) -> Process:
    """Fit length, variance and noise by maximum likelihood to z (n, features) and y (n, outputs) of mean 0.

    For a given length, one eigendecomposition gives the likelihood for every share of noise, and the best variance
    follows from both (Rasmussen and Williams 2006, equation 5.8). The maximum is sought on a grid, then by a bounded
    line search around its best point. Constant outputs do not count; where all are constant, the process predicts the
    mean everywhere.
    """
    square = _squares(z, z)

    def badness(log_length: float) -> float:
        values, vectors = np.linalg.eigh(_correlation(square, float(np.exp(log_length))))
        return -_best_noise(np.maximum(values, 0.0), vectors.T @ y)[2]

    length = float(np.exp(_minimise(badness, np.log(LENGTHS * np.sqrt(z.shape[1])))))
    values, vectors = np.linalg.eigh(_correlation(square, length))
    values, rotated = np.maximum(values, 0.0), vectors.T @ y
    noise, variance, _ = _best_noise(values, rotated)
    weights = vectors @ (rotated / (variance * (values + noise))[:, None])
    precision = (vectors / (values + noise)) @ vectors.T
    return Process(z, weights, precision, length, variance, noise)


def _best_noise(values: Array, rotated: Array) -> tuple[float, float, float]:
    """Return noise, variance and log likelihood (less a constant) for these eigenvalues and rotated outputs."""
    varying = rotated[:, np.any(rotated != 0, axis=0)]
    if not varying.size:
        return 1.0, 1.0, 0.0
    power = np.sum(varying**2, axis=1)

    def badness(log_noise: float) -> float:
        spread = values + np.exp(log_noise)
        variance = np.sum(power / spread) / varying.size
        return float(0.5 * (varying.size * np.log(variance) + varying.shape[1] * np.sum(np.log(spread))))

    log_noise = _minimise(badness, np.log(NOISES))
    noise = float(np.exp(log_noise))
    return noise, float(np.sum(power / (values + noise)) / varying.size), -badness(log_noise)


def _minimise(badness: Callable[[float], float], grid: Array) -> float:
    """Return the minimum of `badness`: the best of the grid, refined between its neighbours."""
    measures = [badness(float(point)) for point in grid]
    best = int(np.argmin(measures))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    finer = minimize_scalar(badness, bounds=(low, high), method="bounded", options={"xatol": 1e-4})
    return float(finer.x) if finer.fun < measures[best] else float(grid[best])


def _squares(a: Array, b: Array) -> Array:
    """Return |a_i - b_j|^2 (n, m), with differences taken before squaring, so that no digits are lost."""
    return np.array([np.sum((row - b) ** 2, axis=1) for row in a])


def _correlation(square: Array, length: float) -> Array:
    correlation: Array = np.exp(-square / (2 * length**2))
    return correlation


GAUSSIAN_PROCESS = Method(
    "gaussian_process", "Gaussian process on engineered features", fit, source="Rasmussen and Williams 2006"
)
