"""What all ways of predicting a feeling or making a profile have in common: to be fitted, to answer, to be exported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from palpate.modeling.doors.data import DoorData, ModelDataError, Scaling
from palpate.modeling.files.model_files import Exported
from palpate.modeling.training.methods import FitOptions, MethodOf
from palpate.signals.arrays import Array


class Fitted(Protocol):
    """A fitted model of either direction."""

    def predict(self, given: Array) -> Array:
        """Forward: (n, 621) newtons to (n, attributes) on 0..100. Inverse: (n, attributes) on 0..100 to (n, 621) N."""

    def exported(self) -> Exported:
        """Return the model as a file holds it. Its input and output are those of `predict`."""


@dataclass(frozen=True)
class Learning(FitOptions):
    """What a method may learn from in one fit.

    `measured` are the stimuli of the training side; `train` the same with their training variants (each row's source
    is that of its stimulus); `held` is what a network watches to stop early, a grouped share of the training side with
    no source in common with `train`'s sources, and is empty where a method does not ask for it. `forward` is the fitted
    forward model that an inverse method may use.
    """

    train: DoorData
    measured: DoorData
    held: DoorData
    scaling: Scaling
    forward: Fitted | None = None


@dataclass(frozen=True)
class Method(MethodOf[Learning, Fitted]):
    """A way to learn one direction. `holds_out` is whether it wants `held`."""

    holds_out: bool = False
    needs_forward: str | None = None
    """The forward method that an inverse one builds on, or None."""


def as_rows(given: Array, size: int, what: str) -> Array:
    """(n, size) of finite float64, also from one row or from float16. Raises ModelDataError otherwise."""
    rows = np.atleast_2d(np.asarray(given, dtype=np.float64))
    if rows.ndim != 2 or rows.shape[1] != size or not len(rows):
        raise ModelDataError(
            f"{what}: {size} numbers a row are expected, at least one row; found an array of shape {np.shape(given)}."
        )
    if (bad := np.argwhere(~np.isfinite(rows))).size:
        row, place = bad[0]
        raise ModelDataError(f"{what}: row {row + 1} holds {rows[row, place]} at place {place + 1}.")
    return rows
