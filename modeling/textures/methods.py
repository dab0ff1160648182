"""The interface of all methods that continue a texture: fitting to a recording, prediction, export."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from palpate.modeling.files.model_files import Exported
from palpate.modeling.textures.recording import Parts, Recording
from palpate.modeling.training.methods import FitOptions, MethodOf
from palpate.signals.arrays import Array


@dataclass(frozen=True)
class Learning(FitOptions):
    """The data and options of one fit; a method uses the training and validation parts only.

    `window` in samples, None: the method's own.
    """

    recording: Recording
    parts: Parts
    window: int | None = None


class Fitted(Protocol):
    """A fitted method.

    One that was trained in epochs also has `trained` (palpate.modeling.training.loop.Trained); one whose training has
    an aim of its own also has `missed`, a sentence for each aim that it missed.
    """

    @property
    def window(self) -> int:
        """The number of past samples that it uses."""

    def predict(self, given: Array) -> Array:
        """Return the mean of the next acceleration (n,) in m/s^2 for windows (n, 3, window) in units.

        A method that generates spectra raises TextureDataError, since it does not predict from the past.
        """

    def exported(self) -> Exported:
        """Return the steps from a texture window (3 * window in C order, units) to mean (m/s^2), or mean and log SD."""


@dataclass(frozen=True)
class Method(MethodOf[Learning, Fitted]):
    """A method of continuing a texture; `kind`: the next sample from a window, or a block's spectrum from noise."""

    window: int
    kind: Literal["next", "block"] = "next"
    sampled: bool = False
    """Whether it predicts a conditional scale, which is sampled in a run."""
