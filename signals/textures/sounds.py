"""A texture that is to be played, and what can be wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


class RenderError(ValueError):
    """A texture, a hand or an actuator that is not used: the message says what was found and what to do."""


@dataclass(frozen=True)
class Sounds:
    """A texture to be played: its model's card, the seed, whether a conditional scale is sampled, and whether a model
    that missed an aim of its training is played all the same."""

    card: Path
    seed: int = 0
    sampled: bool = True
    accept_missed: bool = False
