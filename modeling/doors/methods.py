"""The interface of all methods that predict ratings or make a profile: fitting, prediction, export."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from palpate.modeling.doors.data import DoorData, Scaling
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
