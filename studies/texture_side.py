"""The rig's side of textures as one object, for the rooms that are handed it because they may not import a device."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigTextures:
    """Simulated surfaces, the renderer and its runtimes. It holds no device, opens none, and pickles."""

    def captured(self, texture: str, seconds: float, seed: int) -> Mapping[str, tuple[float, Array]]:
        """A free exploration through the twins of the tool's sensors: {stream: (rate in Hz, samples (n, channels))}.

        Raises RigError: an unknown texture, or a time that cannot be simulated.
        """
        from palpate.studies.texture_capturing import captured

        return captured(texture, seconds, seed)

    def scene(self, texture: str, seconds: float, seed: int) -> Array:
        """(3, n) at 1 kHz: true acceleration on one axis (m/s^2), speed (mm/s), force (N) of another exploration.

        Raises RigError as `captured` does.
        """
        from palpate.studies.texture_capturing import scene

        return scene(texture, seconds, seed)

    def again(self, texture: str, seconds: float, seed: int) -> Array:
        """(3, n): the exploration that `scene` gives for this seed, made elsewhere on the surface: the same hand.

        Raises RigError as `captured` does.
        """
        from palpate.studies.texture_capturing import scene

        return scene(texture, seconds, seed, realisation=1)

    def played(self, card: Path, speed_mm_s: Array, force_N: Array, seed: int, sampled: bool = True) -> Array:
        """What the renderer plays for speed and force (n,) at 1 kHz: (n,) in m/s^2, before compensation.

        Raises ModelFileError, RenderError.
        """
        from palpate.signals.textures.voice import play

        return play(card, speed_mm_s, force_N, seed, sampled)

    def step_us(self, card: Path, steps: int = 2000) -> Mapping[str, tuple[float, float, float]]:
        """Median and p99 of one step in us and its relative error, for each runtime that can run the model here.

        Raises ModelFileError, RenderError.
        """
        from palpate.signals.textures.timing import step_us

        return step_us(card, steps, time.perf_counter_ns)
