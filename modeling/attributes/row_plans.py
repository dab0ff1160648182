"""How a baseline network is shown textures; what is said here needs no torch."""

from __future__ import annotations

from dataclasses import dataclass, replace

from palpate.modeling.attributes.material import Modality
from palpate.modeling.training.settings import Settings

SETTINGS = Settings(epochs=200, batch=32, learning_rate=1e-3, plateau_patience=None, stop_patience=10, every_epochs=10)
"""Epochs, Adam and patience of thesis 3.5.3; batch and rate are ours (the rate is that of Adam in Keras)."""
CONVOLVED = replace(SETTINGS, epochs=100, batch=16, learning_rate=3e-4)
"""Of the networks that convolve. At a rate of 1e-3 the first steps switch off their dense layer: it is given thousands
of numbers, none below 0. Half of the thesis' epochs bound the time; on made-up textures they stopped between the
13th and the 66th."""


@dataclass(frozen=True)
class Plan:
    """`sees` in the order in which the network takes it; `shows`: how often an epoch shows each texture.

    Each time it is another of its segments, or pictures and variants of them, or a pair, drawn by the seed. With
    `steps` the touch is so many successive segments.
    """

    name: str
    sees: tuple[Modality, ...]
    shows: int
    steps: int = 1
    settings: Settings = SETTINGS
