"""Sensor noise that depends only on its key: hashed in bulk, equal on every machine, without numpy."""

from __future__ import annotations

import hashlib
import sys
from array import array
from statistics import NormalDist

from palpate.protocols.canonical import canonical
from palpate.protocols.keyed import Key

LEVELS = 4096
QUANTILES = tuple(NormalDist().inv_cdf((level + 0.5) / LEVELS) for level in range(LEVELS))
"""Possible values of a noise sample: the quantiles of a standard normal, up to 3.7 standard deviations."""


def gaussians(count: int, *key: Key) -> list[float]:
    """Return `count` standard normal numbers (quantised to 4096 levels), independent of those of any other key."""
    bits = array("H", hashlib.shake_256(canonical(key)).digest(2 * count))
    if sys.byteorder == "big":
        bits.byteswap()
    return [QUANTILES[bit >> 4] for bit in bits]
