"""Random numbers without a stream: every draw is a hash of its key, so no draw depends on an earlier one.

A killed and resumed session, another machine and another Python version all draw the same.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from statistics import NormalDist

from palpate.protocols.canonical import canonical

Key = str | int | None
_STANDARD_NORMAL = NormalDist()


def keyed_bits(*key: Key) -> int:
    """Return 256 bits that depend on the key alone."""
    return int.from_bytes(hashlib.sha256(canonical(key)).digest(), "big")


def uniform(*key: Key) -> float:
    """Return a number in the open interval (0, 1), a multiple of 2^-53 plus half a step."""
    return ((keyed_bits(*key) >> 204) + 0.5) / 2.0**52


def normal(*key: Key) -> float:
    """Return a standard normal number (inverse distribution function of `uniform`)."""
    return _STANDARD_NORMAL.inv_cdf(uniform(*key))


def shuffled(items: Iterable[str], *key: Key) -> tuple[str, ...]:
    """Return the items in the order of their keyed hashes, whatever order they come in."""
    return tuple(sorted(items, key=lambda item: (keyed_bits(*key, item), item)))
