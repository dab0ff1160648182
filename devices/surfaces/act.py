"""The computation of an act: hand, contact and tool in batches at the internal rate, any of them again on request."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, field
from threading import Lock

import numpy as np
from scipy.signal import lfilter

from palpate.devices.surfaces.contact import INTERNAL_HZ, THETA, Drive, Law, Ride, at_rest, ride
from palpate.devices.surfaces.hand import Hand, Motion, Wave
from palpate.devices.surfaces.tool import LEAN, MODES, Ground, mode_filter, to_tool
from palpate.signals import GRAVITY_M_S2
from palpate.signals.arrays import Array

BLOCKS, BLOCK = 64, 1000
"""Number of blocks of steps that are computed side by side, and their length: 6.4 s at once. Half as many take as long
in all, because the contact remembers about 0.25 s; twice as many take twice the memory.
"""
BATCH = BLOCKS * BLOCK
LETS_GO_S = 0.3
"""How long the tool is followed after the act; then it is still."""
KEPT = 3
"""Number of batches that are cached for sensors that read side by side, 4.6 MB each."""


@dataclass(frozen=True)
class Batch:
    """A batch of 6.4 s of an act, each (BATCH, 3): acceleration in the tool's axes (m/s^2), force (N), position
    (mm).
    """

    acceleration: Array
    force: Array
    place: Array


@dataclass(frozen=True)
class Start:
    """The state at a batch's start: the contact's state (7,), and the state of the modes' filters (modes, 2)."""

    state: Array
    modes: Array


@dataclass
class Act:
    """The whole act, computed as far as it was requested. Any thread may call it."""

    ground: Ground
    law: Law
    hand: Hand
    seconds: float
    sway: tuple[Wave, Wave]
    kept: int = KEPT
    starts: list[Start] = field(default_factory=list)
    made: OrderedDict[int, Batch] = field(default_factory=OrderedDict)
    lock: Lock = field(default_factory=Lock)

    def batch(self, number: int) -> Batch:
        """Return batch `number`, computing the batches before it first if needed."""
        with self.lock:
            for before in range(len(self.starts) - 1, number):
                self._make(max(before, 0))
            if number not in self.made:
                self._make(number)
            return self.made[number]

    def _make(self, number: int) -> None:
        # The batch's steps; only few, of no consequence, once the act is over.
        left = (self.seconds + LETS_GO_S) * INTERNAL_HZ - number * BATCH
        steps = min(BATCH, BLOCKS * max(1, math.ceil(left / BLOCKS)))
        times = (number * BATCH + np.arange(steps, dtype=np.float64) + THETA) / INTERNAL_HZ
        motion = self.hand.at(times)
        height, right, up = self.ground.at(*motion.place)
        slope, velocity = np.stack([right, up]), motion.velocity / 1000
        drive = Drive(height, (slope * velocity).sum(axis=0), motion.force, slope, velocity, motion.turn / 1000)
        if not self.starts:
            self.starts.append(Start(at_rest(drive, self.law), np.zeros((len(MODES), 2))))
        start = self.starts[number]
        ridden = ride(drive, start.state, self.law, BLOCKS)
        batch, memory = self._sensed(times, motion, drive, ridden, start)
        # A whole batch: where the act is over, its last row goes on.
        missing = BATCH - len(times)
        columns = [
            rows if missing == 0 else np.concatenate([rows, np.repeat(rows[-1:], missing, axis=0)])
            for rows in vars(batch).values()
        ]
        self.made[number] = Batch(*columns)
        if len(self.made) > self.kept:
            self.made.popitem(last=False)
        if len(self.starts) == number + 1:
            self.starts.append(Start(ridden.states[:, -1].copy(), memory))

    def _sensed(self, times: Array, motion: Motion, drive: Drive, ridden: Ride, start: Start) -> tuple[Batch, Array]:
        """Return the signals at the sensors' places, and the state of the modes' filters."""
        states = ridden.states
        force = np.vstack([ridden.friction - ridden.normal * drive.slope, ridden.normal])
        shaken = np.diff(np.column_stack([start.state[[4, 5, 1]], states[[4, 5, 1]]])) * INTERNAL_HZ
        shaken[:2] += drive.turn
        # The modes ring with the force; what they make of it adds to the acceleration.
        memory = np.empty_like(start.modes)
        for n, mode in enumerate(MODES):
            way = np.array(mode.way)
            answer, memory[n] = lfilter(*mode_filter(mode, INTERNAL_HZ), way @ force, zi=start.modes[n])
            shaken += way[:, np.newaxis] * answer
        acceleration = to_tool() @ shaken + GRAVITY_M_S2 * np.array(LEAN)[:, np.newaxis]
        for axis, wave in enumerate(self.sway):
            acceleration[axis] += GRAVITY_M_S2 * wave.at(np.minimum(times, self.seconds))[0]
        place = np.vstack([motion.place + 1000 * states[2:4], 1000 * states[:1]])
        return Batch(*(np.ascontiguousarray(part.T) for part in (acceleration, force, place))), memory
