"""The scene that simulated sensors measure: the true signals of an act, before any sensor."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from palpate.signals.arrays import Array

PIECE_S = 0.25
"""Approximate length of a piece of a scene, so that memory stays small for a scene of any length."""


class Scene(Protocol):
    """An act in front of the sensors. Every signal begins at the act's start; after its end follows rest.

    The iterators never end; each yields pieces of any length from the first sample on, and can be requested again.
    """

    def acceleration_m_s2(self, rate_hz: float) -> Iterator[Array]:
        """Yield what an ideal accelerometer on the tool measures, gravity included: pieces of shape (n, 3)."""

    def wrench(self, rate_hz: float) -> Iterator[Array]:
        """Yield what an ideal force/torque sensor measures: pieces of shape (n, 6), three N and three N m."""

    def position_mm(self, rate_hz: float) -> Iterator[Array]:
        """Yield the tracked marker's position: pieces of shape (n, 3)."""
