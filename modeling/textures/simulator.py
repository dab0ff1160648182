"""The interface of the simulator of textures that the front door passes to modeling, which never imports a device."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from palpate.protocols.code_digest import code_digest, module_of
from palpate.signals.arrays import Array


class SetSession(Protocol):
    """One session of a set: what was done now (made, gone on, kept), whether it is complete, how it ended."""

    @property
    def study(self) -> str:
        """The study: texture_capture, texture_photos or texture_ratings."""

    @property
    def participant(self) -> str:
        """The participant's pseudonym."""

    @property
    def ledger(self) -> Path:
        """The session's file."""

    @property
    def done(self) -> str:
        """What was done now: made, gone on or kept."""

    @property
    def complete(self) -> bool:
        """Whether the session came to its end."""

    @property
    def events(self) -> int:
        """The number of events."""

    @property
    def ended(self) -> str:
        """How the session ended, in words."""


class TextureSimulator(Protocol):
    """Simulated surfaces and a rig's twins: the interface of palpate.studies' `SimulatedTextures`. Pickles by name."""

    def captured(self, texture: str, seconds: float, seed: int) -> Mapping[str, tuple[float, Array]]:
        """Return a free exploration of a simulated surface as recorded by the twins of the tool's sensors.

        Streams tool_acceleration (m/s^2), tool_force (N, N m), tool_position (mm): rate in Hz, and samples (n,
        channels).
        """

    def scene(self, texture: str, seconds: float, seed: int) -> Array:
        """Return (3, n) at 1 kHz: the true acceleration on one axis, speed and force of another free exploration."""

    def again(self, texture: str, seconds: float, seed: int) -> Array:
        """Return (3, n): the exploration of `scene` for this seed and hand, on another place of the surface."""

    def make_set(
        self, lab: Path, report: Callable[[str], None], *, textures: tuple[str, ...] = (), seconds: float | None = None,
        pictures: int | None = None, raters: int | None = None, seed: int = 0, workers: int = 1, quick: bool = False,
    ) -> Sequence[SetSession]:  # fmt: skip
        """Make a set of textures in a lab, or resume it; return the sessions up to the first that is not complete."""


GetSimulator = Callable[[], TextureSimulator]
"""A function that returns the simulator, which is imported only then."""


def simulation_digest(*calls: Callable[..., Any]) -> str:
    """Return the SHA-256 over the code of these methods of a simulator, and over the table of its textures."""
    modules = dict.fromkeys(map(module_of, calls))
    return code_digest(*modules, files=("studies/texture_capture/stimuli.csv",), registries=True)
