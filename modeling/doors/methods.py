"""The interface of all methods that predict ratings or make a profile: fitting, prediction, export."""

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
        """Return ratings (n, attributes) on 0..100 of profiles (n, 621) in newtons; an inverse method the reverse."""

    def exported(self) -> Exported:
        """Return the model as steps and tensors. Its input and output are those of `predict`."""


@dataclass(frozen=True)
class Learning(FitOptions):
    """The data and options of one fit.

    `measured` are the stimuli of the training side; `train` the same with their training variants (each row's source is
    that of its stimulus); `held` are stimuli that a network watches to stop early, a grouped share of the training side
    that shares no source with `train`; it is empty for a method without `holds_out`. `forward` is the fitted forward
    model that an inverse method may use.
    """

    train: DoorData
    measured: DoorData
    held: DoorData
    scaling: Scaling
    forward: Fitted | None = None


@dataclass(frozen=True)
class Method(MethodOf[Learning, Fitted]):
    """A method that learns one direction. `holds_out` is whether it uses `held`."""

    holds_out: bool = False
    needs_forward: str | None = None
    """The forward method that an inverse method builds on, or None."""


def as_rows(given: Array, size: int, what: str) -> Array:
    """Return rows (n, size) as finite float64, also of one row or float16. Raises ModelDataError otherwise."""
    rows = np.atleast_2d(np.asarray(given, dtype=np.float64))
    if rows.ndim != 2 or rows.shape[1] != size or not len(rows):
        raise ModelDataError(
            f"{what}: {size} numbers a row are expected, at least one row; found an array of shape {np.shape(given)}."
        )
    if (bad := np.argwhere(~np.isfinite(rows))).size:
        row, place = bad[0]
        raise ModelDataError(f"{what}: row {row + 1} holds {rows[row, place]} at place {place + 1}.")
    return rows
