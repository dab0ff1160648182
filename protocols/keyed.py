"""Chance without a stream: every draw is a hash of what it is for, so no draw depends on an earlier one.
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
    """256 bits that the key alone decides."""
    return int.from_bytes(hashlib.sha256(canonical(key)).digest(), "big")


def uniform(*key: Key) -> float:
    """A number in the open interval (0, 1), a multiple of 2^-53 plus half a step."""
    return ((keyed_bits(*key) >> 204) + 0.5) / 2.0**52


def normal(*key: Key) -> float:
    """A standard normal number (inverse distribution function of `uniform`)."""
    return _STANDARD_NORMAL.inv_cdf(uniform(*key))


def shuffled(items: Iterable[str], *key: Key) -> tuple[str, ...]:
    """The items ordered by their keyed hash: the order does not depend on the order they come in."""
    return tuple(sorted(items, key=lambda item: (keyed_bits(*key, item), item)))
