"""What `palpate render` was asked for, as its window is handed it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Asked:
    """A texture, the method of its model, and how they are played; `rig` None: LAB's, or twins where `twins`."""

    lab: Path
    texture: str
    method: str
    card: Path
    seed: int
    sampled: bool
    accept_missed: bool
    ahead: int
    real_time: bool
    rig: Path | None
    twins: bool
    language: str
    screen: int | None
    windowed: tuple[int, int] | None
