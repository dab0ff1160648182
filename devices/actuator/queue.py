"""A queue of samples to be played: what happens when it runs empty, and how it ends in silence."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field

import numpy as np

from palpate.signals.arrays import Array

RATE_HZ = 1000
"""Rate at which textures are rendered (thesis 4.5.2)."""
RAMP = 0.5 + 0.5 * np.cos(np.pi * np.arange(1, 5) / 4)
"""Gains from a value to silence in 4 ms, along a cosine."""
DECAY = math.exp(-1 / 2)
"""Factor of the last sample per millisecond without a new one: a time constant of 2 ms."""
NOTHING_V = 1e-4
"""A decaying sample below this is zero: the step of a 16-bit output of 10 V is 3e-4 V."""


@dataclass
class Queue:
    """A queue filled by the renderer and emptied by the output, each on a thread of its own. It begins silent.

    An underrun is counted when samples are missing while more are expected: from the first `write` until `rest`.
    """

    capacity: int
    silent: threading.Event = field(default_factory=threading.Event)
    underruns: int = 0
    missing: int = 0
    last: float = 0.0
    _waiting: Array = field(default_factory=lambda: np.zeros(0))
    _ramp: Array = field(default_factory=lambda: np.zeros(0))
    _expected: bool = False
    _short: bool = False
    _halted: bool = False
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def room(self) -> int:
        """Return how many more samples fit."""
        return self.capacity - len(self._waiting)

    def write(self, samples: Array) -> int:
        """Append samples that fit, and return how much room is left; a halted queue takes none."""
        with self._lock:
            if not self._halted:
                self._waiting = np.concatenate([self._waiting, samples])
                self._expected = True
                self.silent.clear()
        return self.room

    def take(self, count: int) -> Array:
        """Return the next samples: those in the queue, then the last one decaying to zero."""
        with self._lock:
            head = self._taken(count)
            tail = self._fallen(count - len(head))
            out = np.concatenate([head, tail])
            if len(out):
                self.last = float(out[-1])
            if self.last == 0.0 and not len(self._waiting) and not len(self._ramp):
                self.silent.set()
            return out

    def _taken(self, count: int) -> Array:
        if self._halted:
            part, self._ramp = self._ramp[:count], self._ramp[count:]
            return part
        part, self._waiting = self._waiting[:count], self._waiting[count:]
        # Count a gap once, however many takes it lasts.
        missing = count - len(part)
        if missing and self._expected:
            self.underruns += len(part) > 0 or not self._short
            self.missing += missing
        self._short = missing > 0 and self._expected
        if len(part):
            self.last = float(part[-1])
        return part

    def _fallen(self, count: int) -> Array:
        if self._halted:
            return np.zeros(count)
        values = self.last * DECAY ** np.arange(1, count + 1)
        return np.where(np.abs(values) < NOTHING_V, 0.0, values)

    def rest(self) -> None:
        """Expect no more samples: the queue is played, and silence after it is not an underrun."""
        with self._lock:
            self._expected = False

    def halt(self) -> None:
        """Drop the queue and go to silence in 4 ms; accept nothing until `resume`. A second call changes nothing."""
        with self._lock:
            if not self._halted:
                self._halted, self._expected = True, False
                self._waiting, self._ramp = np.zeros(0), self.last * RAMP

    def resume(self) -> None:
        """Accept samples again."""
        with self._lock:
            self._halted = self._short = False
            self._ramp = np.zeros(0)
