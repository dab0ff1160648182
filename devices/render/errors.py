"""What can be wrong with what is to be rendered."""

from __future__ import annotations


class RenderError(ValueError):
    """A texture, a hand or an actuator that is not used: the message says what was found and what to do."""
