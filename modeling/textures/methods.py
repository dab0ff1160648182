"""What all ways of continuing a texture have in common: to be fitted to a recording, to answer, to become a file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from palpate.modeling.files.model_files import Exported
from palpate.modeling.textures.recording import Parts, Recording
from palpate.modeling.training.methods import FitOptions, MethodOf
from palpate.signals.arrays import Array


@dataclass(frozen=True)
class Learning(FitOptions):
    """What a method learns from; a method looks at the training and validation parts alone.

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
        """Samples that it looks back."""

    def predict(self, given: Array) -> Array:
        """The mean of the next acceleration (n,) in m/s^2 for windows (n, 3, window) in units; a method that makes
        spectra raises TextureDataError, since it does not look at the past."""

    def exported(self) -> Exported:
        """Steps from a texture window (3 * window in C order, units) to 1 number (m/s^2), or 2: mean, log of SD."""


@dataclass(frozen=True)
class Method(MethodOf[Learning, Fitted]):
    """A way of continuing a texture. `kind`: the next sample from a window, or a block's spectrum from noise."""

    window: int
    kind: Literal["next", "block"] = "next"
    sampled: bool = False
    """Whether it gives a conditional scale, to be sampled when it runs."""
