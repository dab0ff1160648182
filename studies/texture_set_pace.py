"""How long a set of simulated textures takes: beforehand in processor time, and then by what it took so far."""

from __future__ import annotations

import time
from collections.abc import Callable

CPU_A_SECOND, CPU_A_TEXTURE, CPU_A_PICTURE, CPU_A_RATER = 0.04, 0.75, 0.21, 0.6
"""Processor seconds on an idle core, measured: docs/how-to/describe-textures.md."""


def cpu_s(textures: int, seconds: float, pictures: int) -> dict[str, float]:
    """Return the processor time of one step of each study: a texture touched, a texture photographed, a rater."""
    return {
        "texture_capture": CPU_A_TEXTURE + CPU_A_SECOND * seconds,
        "texture_photos": CPU_A_TEXTURE + CPU_A_PICTURE * pictures,
        "texture_ratings": CPU_A_RATER * textures / 50,
    }


class Pace:
    """The time left of work in steps of known weights, from the time that the steps so far took on this machine."""

    def __init__(self, weights: dict[str, float], total: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.weights, self.left, self.spent = weights, total, 0.0
        self.clock, self.began = clock, clock()

    def skip(self, step: str, count: int = 1) -> None:
        """Take steps that were done before out of the work."""
        self.left -= count * self.weights[step]

    def step(self, step: str) -> float:
        """Count a step as done, and return about how many seconds the others take."""
        self.skip(step)
        self.spent += self.weights[step]
        return max(0.0, self.left) * (self.clock() - self.began) / self.spent
