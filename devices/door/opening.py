"""A hand that opens a door once at a nearly constant speed, as people were instructed (thesis 5.3.1.1)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

from palpate.protocols.keyed import Key, uniform
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG, DoorDataError, motion_end

RATE_HZ = 1000.0
REST_S = 0.6
"""Seconds for which the hand rests on the handle before the opening, and the door stays open after it."""
START_S = 0.4
"""Seconds for speeding up and slowing down; otherwise the participants keep their speed constant."""
SHORTEST_S, LONGEST_S = 2.0, 600.0
UNSTEADY = 0.12
"""Greatest deviation of a careful hand's speed from constant, as a share."""
UNSTEADY_HZ = (0.7, 3.0)
LET_GO_S = 0.08
SPRINGS_BACK = 0.3 * POINTS_PER_DEG
"""When released, the door moves back from its stop by 0.3 degrees."""
BEYOND = 3.0 * POINTS_PER_DEG
"""A profile without padding is cut off at 62 degrees (5.3.1.2): its door opens further, here by 3 degrees."""


@dataclass(frozen=True)
class Opening:
    """An opening: the force at the handle in newtons and the door's angle in degrees, at 1 kHz."""

    force_N: tuple[float, ...]
    angle_deg: tuple[float, ...]


def opened_once(profile_N: Sequence[float], seconds: float, *key: Key) -> Opening:
    """Return one opening, in `seconds`, of a door with this profile; the key seeds the hand.

    The door opens to just behind the profile's last point that is not padding, or beyond 62 degrees if the profile is
    cut off there. `palpate doors normalise --zero` turns a recording of it back into the profile.

    Raises:
        DoorDataError: a profile of another length or without motion, or a duration that is not from 2 to 600 s.
    """
    end = demand_recordable(profile_N, seconds)
    reach = end + (0.5 if end < POINTS - 1 else BEYOND)
    # Place on the profile's grid at every force sample: at rest, opening without a step back, at rest.
    rest = round(REST_S * RATE_HZ)
    moving = round(seconds * RATE_HZ) - 2 * rest
    low, high = UNSTEADY_HZ
    waves = []
    for n in range(3):
        omega = 2 * math.pi * (low + (high - low) * uniform("pace", n, *key))
        waves.append(_Wave(UNSTEADY / 3, omega, 2 * math.pi * uniform("phase", n, *key)))
    speeds = [_ramp(n, moving) * (1 + sum(w(n / RATE_HZ) for w in waves)) for n in range(moving)]
    travelled = list(accumulate(speeds))
    places = [0.0] * rest + [reach * distance / travelled[-1] for distance in travelled] + [reach] * rest
    force = [_felt(profile_N, min(place, end), end) for place in places]
    # Once the door is open the hand lets go, and the door settles.
    first = places.index(reach)
    for n in range(first + 1, len(force)):
        held = math.exp(-(n - first) / (LET_GO_S * RATE_HZ))
        force[n] *= held
        places[n] -= SPRINGS_BACK * (1 - held)
    return Opening(tuple(force), tuple(place / POINTS_PER_DEG for place in places))


def demand_recordable(profile_N: Sequence[float], seconds: float) -> int:
    """Return the index of the profile's last point that is not padding. Raises as `opened_once`."""
    if len(profile_N) != POINTS:
        raise DoorDataError(f"A door profile has {POINTS} points, this one has {len(profile_N)}.")
    if not SHORTEST_S <= seconds <= LONGEST_S:
        raise DoorDataError(f"{seconds} s of recording: from {SHORTEST_S:g} to {LONGEST_S:g} s are expected.")
    end = motion_end(tuple(profile_N))
    if end == 0:
        raise DoorDataError("The profile is zero throughout: there is no opening to record.")
    return end


@dataclass(frozen=True)
class _Wave:
    size: float
    omega: float
    phase: float

    def __call__(self, t_s: float) -> float:
        return self.size * math.sin(self.omega * t_s + self.phase)


def _ramp(n: int, moving: int) -> float:
    """Return the share of full speed, with a smooth start and stop; never 0, so that the angle always rises."""
    share = min(1.0, (min(n, moving - 1 - n) + 1) / (START_S * RATE_HZ))
    return share * share * (3 - 2 * share)


def _felt(profile_N: Sequence[float], place: float, end: int) -> float:
    """Return the profile's force at an index; 0 while the hand only rests on the handle."""
    if place == 0:
        return 0.0
    index = min(int(place), end - 1)
    return profile_N[index] + (place - index) * (profile_N[index + 1] - profile_N[index])
