"""Where the plant's energy went, in joules since the start."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Ledger:
    """Work done on the arm by motor and hand, and what friction, dampers, stops and detents took.

    `stop_taken_J` grows while the arm pushes into a stop, `stop_returned_J` while the stop pushes it out.
    """

    motor_J: float = 0.0
    hand_J: float = 0.0
    friction_J: float = 0.0
    viscous_J: float = 0.0
    detent_J: float = 0.0
    stop_taken_J: float = 0.0
    stop_returned_J: float = 0.0

    def stop(self, taken_J: float) -> None:
        """A stop took so much; negative where it gave."""
        if taken_J >= 0.0:
            self.stop_taken_J += taken_J
        else:
            self.stop_returned_J -= taken_J

    def kinetic_J(self) -> float:
        """What must be in the arm's motion, beside what was there at the start."""
        took = self.friction_J + self.viscous_J + self.detent_J + self.stop_taken_J - self.stop_returned_J
        return self.motor_J + self.hand_J - took
