"""What continues a texture by one sample after another."""

from __future__ import annotations

from typing import Protocol


class Sounding(Protocol):
    """A model that runs on its own output, from a beginning."""

    def begin(self) -> None:
        """Forget what was: the next step is the first of a touch."""

    def step(self, speed_mm_s: float, force_N: float) -> float:
        """Return the next sample in m/s^2; NaN where the model has no answer."""
