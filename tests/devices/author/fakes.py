"""A maker of doors that needs no model: every wish bends the profile in its own, known way."""

from dataclasses import dataclass, field

import numpy as np

LOWS = ("Easy-to-pull", "Damped", "Consistent", "Pleasant", "New", "Comfort", "Luxurious")
HIGHS = ("Hard-to-pull", "Recoiling", "Stepwise", "Unpleasant", "Old", "Discomfort", "Cheap")
ANGLE = np.arange(621) / 10


@dataclass(frozen=True)
class FakeMade:
    force_N: np.ndarray
    predicted: np.ndarray
    off: np.ndarray
    attainable: bool


@dataclass
class FakeMaker:
    attributes: tuple = LOWS
    antonyms: tuple = HIGHS
    identity: dict = field(default_factory=lambda: {"force": {"name": "fake", "sha256": "0" * 64}})
    wishes: list = field(default_factory=list)

    def design(self, wish, smoothing_deg=0.0):
        wish = np.asarray(wish, dtype=float)
        self.wishes.append((tuple(wish), smoothing_deg))
        force = np.zeros(621)
        for number, value in enumerate(wish):
            height = 4 + 0.25 * value * (1 if number % 2 == 0 else -0.4)
            force += height * np.exp(-(((ANGLE - 8 - 8 * number) / (2.2 + smoothing_deg)) ** 2))
        force += 4 + 0.03 * ANGLE
        predicted = np.clip(50 + 0.7 * (wish - 50), 0, 100)
        off = predicted - wish
        fits = bool(np.abs(off).max() <= 10)
        return FakeMade(force, predicted, off, fits)
