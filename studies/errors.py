"""The errors of putting a session's devices together."""

from __future__ import annotations


class RigError(ValueError):
    """The rig that a study needs cannot be had."""
