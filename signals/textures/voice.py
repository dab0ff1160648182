"""A texture's voice: a model played under a hand, bounded for any input (thesis 4.5)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.models.card import Card, Texture
from palpate.signals.models.fastest import Runs, fastest
from palpate.signals.models.file import read_model
from palpate.signals.models.runtime import Model
from palpate.signals.textures.block_voice import Blocks
from palpate.signals.textures.gate import GAINS, RAMP, Gate, Sense
from palpate.signals.textures.guard import Guard, Sounding
from palpate.signals.textures.next_voice import Next, start_of
from palpate.signals.textures.normals import Normals
from palpate.signals.textures.range import Range
from palpate.signals.textures.sounds import RenderError, Sounds

RATE_HZ = 1000.0


@dataclass(frozen=True)
class Tally:
    """Counts of a voice's steps and restarts.

    Steps: all, those with sound, those with a held sensor value; restarts of the model; steps of a silent model, and of
    a paused one.
    """

    steps: int
    sounding: int
    held: int
    restarts: int
    quiet: int
    muted: int


class Voice:
    """A source of one sample per millisecond from a hand's speed and force; silent while the hand rests.

    Every sample is finite and within the card's peak, whatever the input. Equal seeds and equal inputs give equal bits.
    Only one thread may step it.
    """

    def __init__(self, runs: Runs, guard: Guard, bounds: Range, notes: tuple[str, ...] = ()) -> None:
        """Take the parts of a voice; use `open_voice` to create one."""
        self.runs, self.notes = runs, notes
        self._guard, self._gate, self._sense = guard, Gate(), Sense()
        self._slowest, self._fastest = bounds.speed
        self._faintest, self._firmest = bounds.force
        self._speed = self._force = 0.0
        self._joins = False
        self.peak = bounds.peak
        self.steps = self.sounding = 0

    @property
    def card(self) -> Card:
        """Return the card of the voice's model."""
        return self.runs.card

    @property
    def sounding_model(self) -> Sounding:
        """Return the running model, so that checks can disturb it."""
        return self._guard.inner

    @property
    def tally(self) -> Tally:
        """Return the counts so far."""
        guard = self._guard
        return Tally(self.steps, self.sounding, self._sense.held, guard.restarts, guard.quiet, guard.muted)

    def begin(self) -> None:
        """Come to rest: the next touch starts from the start sequence."""
        self._gate.place = 0

    def join(self) -> None:
        """Begin without a ramp if the hand touches at the next step, because another voice is faded out meanwhile."""
        self._joins = True

    def step(self, speed_mm_s: float, force_N: float) -> float:
        """Return the next sample in m/s^2."""
        self.steps += 1
        speed, force = self._sense.take(speed_mm_s, force_N)
        gate, joins, self._joins = self._gate, self._joins, False
        rested = not gate.place
        if gate.move(speed, force):
            self._speed = min(max(speed, self._slowest), self._fastest)
            self._force = min(max(force, self._faintest), self._firmest)
            if rested:
                self._guard.begin()
                gate.place = RAMP if joins else gate.place
        elif not gate.place:
            return 0.0
        self.sounding += 1
        return GAINS[gate.place] * self._guard.step(self._speed, self._force)


def open_voice(
    model: Model | Path | str, *, seed: int, sampled: bool = True, accept_missed: bool = False,
    runs: Callable[[Model], Runs] = fastest,
) -> Voice:  # fmt: skip
    """Return a silent voice of a texture's model, which is given as a model or as its card's path.

    `seed` decides the random numbers; `sampled=False` uses the mean of a model with a conditional scale;
    `accept_missed` accepts a model that missed an aim of its training.

    Raises:
        ModelFileError: a file that is missing, foreign, damaged or changed.
        RenderError: a model that is not a texture's, has another rate than 1 kHz, or missed an aim of its training.
    """
    read = model if isinstance(model, Model) else read_model(model)
    texture = _texture(read.card)
    if read.card.missed and not accept_missed:
        raise RenderError(
            f"{read.card.name} missed an aim of its training: {' '.join(read.card.missed)} Train it again, choose "
            "another method, or play it all the same with `palpate render --accept-missed`."
        )
    if seed < 0:
        raise RenderError(f"the seed is {seed}; a whole number of at least 0 is expected.")
    bounds = Range.of(texture)
    running = runs(read)
    sounding: Sounding
    if read.card.takes.kind == "texture_drive":
        sounding, note = Blocks(running, texture, bounds.peak, seed), ""
    else:
        start, note = start_of(texture, read.tensors, bounds, seed)
        sounding = Next(running, start, bounds.peak, Normals(seed, 0) if sampled else None)
    guard = Guard(sounding, bounds, texture.rms_m_s2)
    return Voice(running, guard, bounds, (note,) if note else ())


def opened_voice(sounds: Sounds) -> Voice:
    """Return the voice of a job's texture. Raises what `open_voice` raises."""
    return open_voice(sounds.card, seed=sounds.seed, sampled=sounds.sampled, accept_missed=sounds.accept_missed)


def play(model: Model | Path | str, speed_mm_s: Array, force_N: Array, seed: int, sampled: bool = True) -> Array:
    """Return the acceleration (n,) in m/s^2 that is played for a hand's speed and force (n,) at 1 kHz.

    The signal is not compensated for an actuator. A model that missed an aim of its training is played too, so that its
    error can be measured. Raises as `open_voice` does, and RenderError where speed and force differ in length.
    """
    speed, force = np.asarray(speed_mm_s, dtype=np.float64), np.asarray(force_N, dtype=np.float64)
    if speed.shape != force.shape or speed.ndim != 1:
        raise RenderError(f"speed {speed.shape} and force {force.shape}: two rows of one length are expected.")
    voice = open_voice(model, seed=seed, sampled=sampled, accept_missed=True)
    return np.fromiter(map(voice.step, speed.tolist(), force.tolist()), dtype=np.float64, count=len(speed))


def _texture(card: Card) -> Texture:
    """Return the card's texture. Raises RenderError where it cannot be rendered."""
    texture, kinds = card.texture, (card.takes.kind, card.gives.kind)
    if texture is None or kinds not in {("texture_window", "acceleration"), ("texture_drive", "spectrum")}:
        raise RenderError(
            f"{card.name}: it takes a {card.takes.kind} and gives {card.gives.kind}: no model of a texture. "
            "`palpate models list` shows which are."
        )
    if texture.rate_hz != RATE_HZ:
        raise RenderError(f"{card.name}: made for {texture.rate_hz:g} Hz; textures are played at {RATE_HZ:g}.")
    if kinds[0] == "texture_window" and (card.takes.size != 3 * texture.window or card.gives.size > 2):
        raise RenderError(
            f"{card.name}: it takes {card.takes.size} numbers and gives {card.gives.size}; 3 x {texture.window} and "
            "one or two are expected. Export it again."
        )
    return texture
