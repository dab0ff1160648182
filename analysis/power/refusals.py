"""What cannot be simulated, said."""

from __future__ import annotations


class PowerError(ValueError):
    """The power of this test cannot be simulated as asked."""
