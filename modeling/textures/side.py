"""What modeling is told of the rig's side of textures by whoever starts it: it never imports a device itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Protocol

from palpate.modeling.textures.recording import Array
from palpate.protocols.code_digest import code_digest, module_of


class TextureSide(Protocol):
    """The rig's side of textures; `palpate.studies.texture_side.RigTextures` is the only one. It pickles by name."""

    def captured(self, texture: str, seconds: float, seed: int) -> Mapping[str, tuple[float, Array]]:
        """A free exploration of a simulated surface through the twins of the tool's sensors, as a session records it.

        Streams tool_acceleration (m/s^2), tool_force (N, N m), tool_position (mm): rate in Hz, and samples (n,
        channels).
        """

    def scene(self, texture: str, seconds: float, seed: int) -> Array:
        """(3, n) at 1 kHz: the true acceleration on one axis, speed and force of another free exploration."""

    def again(self, texture: str, seconds: float, seed: int) -> Array:
        """(3, n): the exploration that `scene` gives for this seed, made elsewhere on the surface: the same hand."""

    def played(self, card: Path, speed_mm_s: Array, force_N: Array, seed: int, sampled: bool = True) -> Array:
        """What the renderer plays for a hand's speed and force (n,) at 1 kHz: (n,) in m/s^2, before compensation.

        Exactly the renderer's own path, headless and as fast as it goes: the model on its own output, limits, gate.
        """

    def step_us(self, card: Path, steps: int = 2000) -> Mapping[str, tuple[float, float, float]]:
        """For each runtime that can run the model here: median and p99 of one step in us, and its error.

        The error is the largest absolute difference from the float64 reference over the steps, relative to the answers'
        standard deviation.
        """


def side_digest(side: TextureSide) -> str:
    """Return the SHA-256 over the code of the rig's side, and over the table of the textures that it has."""
    return code_digest(module_of(side), files=("studies/texture_capture/stimuli.csv",), registries=True)


Textures = Callable[[], TextureSide]
