"""What modeling is told of the rig's way to make sets of simulated textures: it never imports a device itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol


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


class TextureSetSide(Protocol):
    """Makes sets of simulated textures; `palpate.studies.texture_set.TextureSet` is the one that there is."""

    def make(
        self, lab: Path, report: Callable[[str], None], *, textures: tuple[str, ...] = (), seconds: float | None = None,
        pictures: int | None = None, raters: int | None = None, seed: int = 0, workers: int = 1, quick: bool = False,
    ) -> Sequence[SetSession]:  # fmt: skip
        """Make the set in a lab, or go on with it; the sessions, up to the first that is not complete."""
