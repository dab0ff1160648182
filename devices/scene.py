"""The scene of the twins of sensors: the truth of one act, before any sensor has measured it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from palpate.signals.arrays import Array

PIECE_S = 0.25
"""How much of a scene is made at a time, about: memory stays small however long the scene is."""


class Scene(Protocol):
    """One act in front of the sensors. Every signal begins at the act's start; once the act is over, rest follows.

    The iterators never end; each yields pieces of any length from the first sample on, and can be asked for anew.
    """

    def acceleration_m_s2(self, rate_hz: float) -> Iterator[Array]:
        """Yield what an ideal accelerometer on the tool measures, gravity included: pieces of shape (n, 3)."""

    def wrench(self, rate_hz: float) -> Iterator[Array]:
        """Yield what an ideal force/torque sensor measures: pieces of shape (n, 6), three N and three N m."""

    def position_mm(self, rate_hz: float) -> Iterator[Array]:
        """Yield the tracked marker's position: pieces of shape (n, 3)."""
