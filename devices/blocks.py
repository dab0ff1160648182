"""The bytes of a sample block: rows of channels, little-endian float32."""

from __future__ import annotations

import sys
from array import array
from collections.abc import Sequence


def interleaved(*channels: Sequence[float]) -> bytes:
    """Channels of one length as rows, 4 bytes a value. Raises ValueError where their lengths differ."""
    if len({len(channel) for channel in channels}) > 1:
        raise ValueError(f"channels of one length are expected, found {[len(channel) for channel in channels]}")
    rows = array("f", [0.0]) * sum(map(len, channels))
    for place, channel in enumerate(channels):
        rows[place :: len(channels)] = array("f", channel)
    if sys.byteorder == "big":
        rows.byteswap()
    return rows.tobytes()
