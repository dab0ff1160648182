"""Methods of reconstructing a curve from a code of a few numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from sklearn.decomposition import PCA
from torch import nn

from benchmarks.keyswitch.curves import CurveError
from benchmarks.keyswitch.networks import Reconstruction
from benchmarks.keyswitch.outcome import Fitted
from benchmarks.keyswitch.settings import Size
from palpate.modeling.training.loop import train
from palpate.modeling.training.seeding import seeded, training_state
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import pairs
from palpate.protocols.progress import Report
from palpate.signals.arrays import Array


def mean_curve(train_rows: Array, _code: int, _size: Size, _report: Report) -> Fitted:
    """Predict the mean of the training curves for every switch, without a code."""
    mean = train_rows.mean(axis=0)
    return lambda curves: np.broadcast_to(mean, curves.shape)


def pca(train_rows: Array, code: int, _size: Size, _report: Report) -> Fitted:
    """Fit the best linear code of this size to the training curves (principal components)."""
    fitted = PCA(code, svd_solver="full").fit(train_rows)
    return lambda curves: np.asarray(fitted.inverse_transform(fitted.transform(curves)))


def network(train_rows: Array, code: int, size: Size, report: Report) -> Fitted:
    """Fit the door networks' encoder and decoder to the difference from the mean curve, with squared error and Adam."""
    model, centring = seeded(lambda: Reconstruction(code), size.seed), centring_of(train_rows)
    rows = centring.up(train_rows)
    train(model, pairs(rows, rows), None, nn.functional.mse_loss, settings_of(size), report=report)
    return lambda curves: centring.down(predict(model, centring.up(curves), size))


@dataclass(frozen=True)
class Centring:
    """The conversion of curves to differences from the training side's mean curve, in units of their SD."""

    mean: Array
    spread: float

    def up(self, rows: Array) -> Array:
        """Convert curves to differences."""
        return (rows - self.mean) / self.spread

    def down(self, rows: Array) -> Array:
        """Convert differences to curves."""
        return rows * self.spread + self.mean


def centring_of(rows: Array) -> Centring:
    """Return the centring of these training curves. Raise CurveError where they are all equal."""
    mean = rows.mean(axis=0)
    spread = float((rows - mean).std())
    if not spread > 0:
        raise CurveError(f"all {len(rows)} curves of the training side are the same: there is nothing to learn from.")
    return Centring(mean, spread)


def settings_of(size: Size) -> Settings:
    """Return the trainer's settings; the plateau's patience is a tenth of the epochs."""
    patience = max(2, size.epochs // 10)
    return Settings(
        epochs=size.epochs, batch=size.batch, learning_rate=size.learning_rate, plateau_patience=patience,
        seed=size.seed, threads=size.threads,
    )  # fmt: skip


def predict(model: nn.Module, curves: Array, size: Size) -> Array:
    """Return the trained network's answer to all rows at once."""
    with training_state(size.seed, size.threads), torch.inference_mode():
        restored: Array = model(torch.from_numpy(curves.astype(np.float32))).numpy().astype(np.float64)
    return restored


METHODS = {"mean curve": mean_curve, "PCA": pca, "network": network}
