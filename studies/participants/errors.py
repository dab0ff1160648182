"""What can be wrong about people, rows and the lab's files about them."""

from __future__ import annotations


class ParticipantError(ValueError):
    """A participant, a row, a lab or one of its files about people cannot be used; the message says what to do."""
