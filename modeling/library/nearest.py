"""Which textures feel most like one: distances in just noticeable differences, and how sure they are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.modeling.doors.shares import JND
from palpate.modeling.library.entries import Entry, Kind, belief, felt
from palpate.modeling.library.ranges import normal


@dataclass(frozen=True)
class Near:
    """A texture, how far it is in JNDs (with an SD), by attribute with a sign, and how likely nobody could tell."""

    entry: Entry
    distance: float
    sd: float
    apart: tuple[float, ...]
    alike: float


def near(entry: Entry, others: Sequence[Entry], attributes: int, kind: Kind | None = None) -> list[Near]:
    """All other textures, the nearest first; equal ones by name."""
    found = [measured(entry, other, attributes, kind) for other in others if other.id != entry.id]
    return sorted(found, key=lambda each: (each.distance, each.sd, each.entry.id))


def measured(entry: Entry, other: Entry, attributes: int, kind: Kind | None = None) -> Near:
    """How far two textures are apart: the root of the mean square of the differences, in JNDs of 10 on 0..100.

    Its SD is that of the mean square, through the delta method about what is to be expected of it: for a difference d
    that is known with an SD s, d^2 has the variance 2 s^4 + 4 d^2 s^2. `alike` is the probability that each attribute
    differs by less than one JND, if the attributes err independently.
    """
    ones, twos = ([belief(felt(each, at, kind)) for at in range(attributes)] for each in (entry, other))
    apart = [(two[0] - one[0]) / JND for one, two in zip(ones, twos, strict=True)]
    unsure = [math.hypot(one[1], two[1]) / JND for one, two in zip(ones, twos, strict=True)]
    expected = math.sqrt(sum(d * d + s * s for d, s in zip(apart, unsure, strict=True)) / attributes)
    variance = sum(2 * s**4 + 4 * d * d * s * s for d, s in zip(apart, unsure, strict=True)) / attributes**2
    alike = math.prod(_within(d, s) for d, s in zip(apart, unsure, strict=True))
    distance, sd = math.sqrt(sum(d * d for d in apart) / attributes), math.sqrt(variance)
    return Near(other, distance, sd / (2 * expected) if expected else 0.0, tuple(apart), alike)


def _within(difference: float, sd: float) -> float:
    """The probability that a normal difference lies within one of zero."""
    if sd == 0:
        return float(abs(difference) < 1)
    return normal((1 - difference) / sd) - normal((-1 - difference) / sd)
