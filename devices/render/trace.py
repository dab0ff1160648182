"""A ring buffer of the last seconds that were played, written by one thread or process, for others to read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ROWS = 3
ROOM = 8192
"""Number of samples that are stored, 8 s."""
BYTES = 8 * (1 + ROWS * ROOM)


@dataclass
class Trace:
    """Acceleration (m/s^2), speed (mm/s) and force (N) by sample, in `memory`: float64 of BYTES bytes.

    Its first number counts the samples. It is written after them, so that a reader in another process never takes an
    old sample for a new one; a reader that falls more than 4 s behind misses some.
    """

    memory: NDArray[np.float64]

    @staticmethod
    def own() -> Trace:
        """Return a trace in this process' own memory."""
        return Trace(np.zeros(BYTES // 8))

    @property
    def count(self) -> int:
        """Return the number of samples so far."""
        return int(self.memory[0])

    def note(self, acceleration_m_s2: float, speed_mm_s: float, force_N: float) -> None:
        """Append one sample."""
        memory = self.memory
        count = int(memory[0])
        place = 1 + ROWS * (count % ROOM)
        memory[place] = acceleration_m_s2
        memory[place + 1] = speed_mm_s
        memory[place + 2] = force_N
        memory[0] = count + 1

    def since(self, first: int) -> tuple[int, NDArray[np.float64]]:
        """Return the number after the last sample, and samples (3, n) from `first` on, at most the newest 4096."""
        count = self.count
        start = max(first, count - ROOM // 2, 0)
        places = np.arange(start, count) % ROOM
        return count, self.memory[1:].reshape(ROOM, ROWS)[places].T.copy()
