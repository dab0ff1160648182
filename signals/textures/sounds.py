"""A request to play a texture, and the error for what cannot be played."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


class RenderError(ValueError):
    """A texture, a hand or an actuator that cannot be used; the message says what was found and what to do."""


@dataclass(frozen=True)
class Sounds:
    """A request to play a texture: its model's card, the seed, and two options.

    `sampled`: a conditional scale is sampled. `accept_missed`: a model that missed an aim of its training is played all
    the same.
    """

    card: Path
    seed: int = 0
    sampled: bool = True
    accept_missed: bool = False
