"""The hand that drives a free run, the true acceleration for it, and another realisation of the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from palpate.modeling.textures.metrics import CYCLE, cycle
from palpate.modeling.textures.recording import RATE_HZ, Parts, Recording, TextureDataError, pieces_of
from palpate.modeling.textures.simulator import TextureSimulator
from palpate.modeling.textures.windows import Stretches, samples_of
from palpate.signals.arrays import Array
from palpate.signals.textures.gate import FAINTEST_N, SLOWEST_MM_S, sounds

LEAST_S = 2.0
"""A shorter test part does not determine level and spectrum, so the whole recording's hand is used."""
MOVES = 0.1
"""The share of the time that the hand must move and press; otherwise the renderer is silent nearly always."""
Origin = Literal["another exploration", "test part", "whole recording"]


@dataclass(frozen=True)
class Drive:
    """A hand's speed (mm/s) and force (N), both (n,), and the true acceleration (n,) in m/s^2 for it.

    `again` is another realisation of the truth: (n,) for the same hand elsewhere on the surface (`same_hand`), else of
    any length; None where there is none. `cycle` is the truth's autocorrelation (metrics.cycle) over consecutive
    samples, within windows of `cycle_window` samples. `seen`: the models were trained on this hand's movement, since
    there is no other.
    """

    texture: str
    origin: Origin
    speed: Array
    force: Array
    truth: Array
    again: Array | None = None
    same_hand: bool = False
    cycle: float | None = None
    cycle_window: int = CYCLE
    seen: bool = False

    @property
    def described(self) -> str:
        """A description of the origin for cards and reports, which says whether the models were trained on it."""
        if self.seen:
            return (
                f"the whole recording, the training part included, as the test part is shorter than {LEAST_S:g} s: no "
                "held-out numbers"
            )
        return "the test part's hand" if self.origin == "test part" else "the hand of another exploration"

    @property
    def seconds(self) -> float:
        """The duration of the free run in seconds."""
        return float(len(self.truth) / RATE_HZ)


def explored(simulator: TextureSimulator, texture: str, seconds: float, seed: int) -> Drive:
    """Return another free exploration of a simulated surface, and that of the same hand elsewhere on it.

    Raises the simulator's errors, and TextureDataError for signals of another shape or that are not finite.
    """
    truth, speed, force = _checked_exploration(texture, simulator.scene(texture, seconds, seed))
    again = _checked_exploration(texture, simulator.again(texture, seconds, seed))[0]
    return Drive(texture, "another exploration", speed, force, truth, again, same_hand=True, cycle=cycle(truth))


def from_recording(recording: Recording, parts: Parts, seconds: float) -> Drive:
    """Return the test part's own hand, forward and backward until `seconds` have passed.

    Where the test part is shorter than 2 s, it is the whole recording's hand, which its models have seen. The other
    realisation is the validation part, or one half beside the other. Raises TextureDataError where the hand hardly
    moves, since the renderer would be silent.
    """
    signals = samples_of(recording, parts.test)
    seen = signals.shape[1] < LEAST_S * RATE_HZ
    signals = recording.signals if seen else signals
    moving = float(np.mean(sounds(signals[1], signals[2])))
    if moving < MOVES:
        raise TextureDataError(
            f"{recording.texture}: not run free, since the hand moves faster than {SLOWEST_MM_S:g} mm/s and presses "
            f"with more than {FAINTEST_N:g} N in {moving:.0%} of the time only, and the renderer is silent elsewhere. "
            "Check the units of speed and force."
        )
    half = recording.signals.shape[1] // 2
    again = recording.signals[0, :half] if seen else samples_of(recording, parts.validation)[0]
    count = max(1, round(seconds * RATE_HZ))
    # forwards, backwards, forwards ...: continuous, and of the same spectrum
    truth, speed, force = (np.resize(np.concatenate([signal, signal[::-1]]), count) for signal in signals)
    repeats, window = _cycle(recording, parts.test)
    return Drive(
        recording.texture, "whole recording" if seen else "test part", speed, force, truth,
        again if len(again) else None, cycle=repeats, cycle_window=window, seen=seen,
    )  # fmt: skip


def _cycle(recording: Recording, test: Stretches) -> tuple[float | None, int]:
    """Return the truth's autocorrelation in the longest stretch that allows it, and its window in samples.

    Stretches of the test part are preferred to those of the whole recording.
    """
    for stretches in (test, pieces_of(recording)):
        start, stop = max(stretches, key=lambda stretch: stretch[1] - stretch[0], default=(0, 0))
        stretch = recording.signals[0, start:stop]
        if (repeats := cycle(stretch)) is not None:
            return repeats, min(CYCLE, len(stretch))
    return None, CYCLE


def _checked_exploration(texture: str, signals: Array) -> Array:
    if signals.ndim != 2 or len(signals) != 3 or not np.isfinite(signals).all():
        raise TextureDataError(
            f"{texture}: an exploration of shape {signals.shape}; (3, n) finite numbers are expected."
        )
    return signals
