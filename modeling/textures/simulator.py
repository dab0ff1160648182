"""The simulator of textures that the front door hands to modeling, which never imports a device itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from palpate.protocols.code_digest import code_digest, module_of
from palpate.signals.arrays import Array


class SetSession(Protocol):
    """One session of a set: what was done of it now (made, gone on, kept), whether it is complete, how it ended."""

    @property
    def study(self) -> str:
        """texture_capture, texture_photos or texture_ratings."""

    @property
    def participant(self) -> str:
        """A pseudonym."""

    @property
    def ledger(self) -> Path:
        """Its file."""

    @property
    def done(self) -> str:
        """made, gone on or kept."""

    @property
    def complete(self) -> bool:
        """Whether it came to its end."""

    @property
    def events(self) -> int:
        """How many it holds."""

    @property
    def ended(self) -> str:
        """How, in words."""


class TextureSimulator(Protocol):
    """Simulated surfaces and a rig's twins, as `SimulatedTextures` of palpate.studies has them. Pickles by name."""

    def captured(self, texture: str, seconds: float, seed: int) -> Mapping[str, tuple[float, Array]]:
        """A free exploration of a simulated surface through the twins of the tool's sensors, as a session records it.

        Streams tool_acceleration (m/s^2), tool_force (N, N m), tool_position (mm): rate in Hz, and samples (n,
        channels).
        """

    def scene(self, texture: str, seconds: float, seed: int) -> Array:
        """(3, n) at 1 kHz: the true acceleration on one axis, speed and force of another free exploration."""

    def again(self, texture: str, seconds: float, seed: int) -> Array:
        """(3, n): the exploration that `scene` gives for this seed, made elsewhere on the surface: the same hand."""

    def make_set(
        self, lab: Path, report: Callable[[str], None], *, textures: tuple[str, ...] = (), seconds: float | None = None,
        pictures: int | None = None, raters: int | None = None, seed: int = 0, workers: int = 1, quick: bool = False,
    ) -> Sequence[SetSession]:  # fmt: skip
        """Make a set of textures in a lab, or resume it; the sessions, up to the first that is not complete."""


GetSimulator = Callable[[], TextureSimulator]
"""What a command is handed: the simulator is imported only when this is called."""


def simulation_digest(*calls: Callable[..., Any]) -> str:
    """Return the SHA-256 over the code of these calls of a simulator, and over the table of its textures."""
    modules = dict.fromkeys(map(module_of, calls))
    return code_digest(*modules, files=("studies/texture_capture/stimuli.csv",), registries=True)
