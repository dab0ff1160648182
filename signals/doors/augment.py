"""The fourteen variants g1 to g14 of a door profile (thesis 5.3.4.1).

The thesis describes each strategy in one sentence; where it is silent, the interpretation is in the function's
docstring and in docs/reference/doors.md. The operations that variants are built from come last: move features along the
angle, rescale flanks, add small cycles.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.doors.features import as_profile, landmarks, plateau_after_second_peak, require_cycles
from palpate.signals.doors.grid import FORCE_DECIMALS, POINTS_PER_DEG, STUDY_SEED, DoorDataError

AMPLITUDES_N = {"g1": 20.0, "g2": 30.0, "g3": 40.0}
COMPLETE_AT_DEG = {"g4": (1, 14.5), "g5": (2, 29.5), "g6": (3, 29.5)}
"""Cycles and the angle by which they are complete: half a degree before the thesis' 15 and 30."""
RECOVERY_DEG = 5.0
RISE_POWER = 4
MOVED_PEAK_DEG = 10.0
FLATTENED_UP_TO_DEG = 20.0
PLATEAU_STRETCH_DEG = 6.0
PLATEAU_RAISE_SHARE = 0.3
BUMP_N = 2.0
BUMPS = 3


@dataclass(frozen=True)
class Draw:
    """Random numbers keyed by seed, door and variant: the same on every machine, in any order."""

    seed: int
    door: str
    variant: str

    def between(self, name: str, low: float, high: float) -> float:
        """Return a number drawn evenly from low to high, for one named purpose."""
        key = f"{self.seed}/{self.door}/{self.variant}/{name}".encode()
        share = int.from_bytes(hashlib.sha256(key).digest()[:6], "big") / 2**48
        return low + (high - low) * share


def augment(force_N: Array, variant: str, *, door: str = "", seed: int = STUDY_SEED) -> Array:
    """Return the variant `g1` to `g14` of a 621-point profile (`g0` is the profile itself).

    The result is rounded to the decimals of a profile file. `door` and `seed` only matter for g8 and g9.

    Raises:
        DoorDataError: an unknown variant, a profile that is not 621 finite points, or a profile without the feature
            that the variant changes; the message names the feature.
    """
    base = np.round(as_profile(force_N, door or "profile"), FORCE_DECIMALS)
    if variant == "g0":
        return base
    if variant not in VARIANTS:
        raise DoorDataError(f"There is no variant {variant!r}; there are g0, {', '.join(VARIANTS)}.")
    profile = np.round(VARIANTS[variant].make(base, Draw(seed, door, variant)), FORCE_DECIMALS) + 0.0
    return as_profile(profile, f"{door} {variant}".strip())


def first_peak_amplitude(variant: str, base: Array, _draw: Draw) -> Array:
    """Return g1 to g3: the first peak at 20, 30 or 40 N, its flanks stretched from the start and from the valley."""
    marks = require_cycles(base, 1, f"{variant} (first peak amplitude)")
    return set_peak(base, 0, marks.peaks[0], marks.valleys[0], AMPLITUDES_N[variant])


def compressed_cycles(variant: str, base: Array, _draw: Draw) -> Array:
    """Return g4 or g5: the first one or two cycles compressed to end before 15 or 30 degrees, the rest stretched."""
    count, complete_deg = COMPLETE_AT_DEG[variant]
    purpose = f"{variant} (cycle {count} complete before {complete_deg + 0.5:g} degrees)"
    marks = require_cycles(base, count, purpose)
    valley, target = marks.valleys[count - 1], complete_deg * POINTS_PER_DEG
    if not target < valley:
        at = valley / POINTS_PER_DEG
        raise DoorDataError(f"{purpose}: this profile's is complete at {at:.1f} degrees, nothing to compress.")
    if valley >= marks.end:
        return move_knots(base, [(valley - 1e-6, target)], marks.end)
    return move_knots(base, [(valley, target)], marks.end)


def compressed_with_end_rise(base: Array, draw: Draw) -> Array:
    """Return g6: all three cycles before 30 degrees, and a force that rises rapidly toward the end.

    5.3.4.1 has the third cycle complete "before 30", 5.3.4.3 all major peaks before 30 degrees and a rapid rise at the
    end. The thesis does not say what lies between. Here the force returns to the base's mean within 5 degrees, and from
    there rises with the fourth power of the remaining angle to the height of the base's highest major peak.
    """
    profile = compressed_cycles("g6", base, draw)
    marks = landmarks(base)
    index = np.arange(len(base), dtype=np.float64)
    valley = round(COMPLETE_AT_DEG["g6"][1] * POINTS_PER_DEG)
    level, top = float(base[: marks.end + 1].mean()), float(base[list(marks.peaks)].max())
    recovery = ease((index - valley) / (RECOVERY_DEG * POINTS_PER_DEG))
    rise = np.clip((index - valley) / (marks.end - valley), 0, 1) ** RISE_POWER
    low = profile[valley]
    tail = low + (level - low) * recovery + (top - level) * rise
    profile[valley : marks.end + 1] = tail[valley : marks.end + 1]
    return profile


def moved_first_peak(base: Array, _draw: Draw) -> Array:
    """Return g7: the first peak at 10 degrees, its valley where it was."""
    marks = require_cycles(base, 1, "g7 (first peak to 10 degrees)")
    peak, valley, target = marks.peaks[0], marks.valleys[0], MOVED_PEAK_DEG * POINTS_PER_DEG
    if peak == target or valley <= target:
        raise DoorDataError(
            f"g7 moves the first peak to 10 degrees; here it is at {peak / POINTS_PER_DEG:.1f} degrees "
            f"and its valley at {valley / POINTS_PER_DEG:.1f}."
        )
    knots = [(peak, target)] if valley >= marks.end else [(peak, target), (valley, valley)]
    return move_knots(base, knots, marks.end)


def flattened_start(base: Array, draw: Draw) -> Array:
    """Return g8: a straight line from a random angle between 3 and 6 degrees to one between 18 and 20."""
    end_deg = landmarks(base).end / POINTS_PER_DEG
    if end_deg <= FLATTENED_UP_TO_DEG:
        raise DoorDataError(f"g8 (flattened up to 20 degrees): this profile's motion ends at {end_deg:.1f} degrees.")
    first = round(draw.between("from", 3.0, 6.0) * POINTS_PER_DEG)
    last = round(draw.between("to", 18.0, FLATTENED_UP_TO_DEG) * POINTS_PER_DEG)
    return straighten(base, first, last)


def small_cycles(base: Array, draw: Draw) -> Array:
    """Return g9: three or four random cycles of 3 to 5 N, before the first peak or between the first and second."""
    marks = require_cycles(base, 2, "g9 (small cycles)")
    before = draw.between("place", 0, 1) < 0.5
    first, last = (0.2 * marks.peaks[0], 0.95 * marks.peaks[0]) if before else (marks.peaks[0], marks.peaks[1])
    cycles = 3 if draw.between("cycles", 0, 1) < 0.5 else 4
    return add_cycles(base, first, last, cycles, draw.between("height", 3.0, 5.0))


def unchanged_plateau(base: Array, _draw: Draw) -> Array:
    """Return g10: "no change", equal to g0, so each door has one hidden repeat. The profile must have a plateau."""
    plateau_after_second_peak(base, "g10 (plateau)")
    return base


def stretched_plateau(base: Array, _draw: Draw) -> Array:
    """Return g11: the plateau after the second peak is 6 degrees longer, and what follows is compressed."""
    return _stretch(base, "g11 (stretched plateau)")[0]


def heightened_plateau(base: Array, _draw: Draw) -> Array:
    """Return g12: the stretched plateau raised by 0.3 of the way from its middle to the second peak."""
    purpose = "g12 (stretched and heightened plateau)"
    profile, (first, last) = _stretch(base, purpose)
    marks = require_cycles(profile, 2, purpose)
    by_N = PLATEAU_RAISE_SHARE * float(profile[marks.peaks[1]] - profile[(first + last) // 2])
    return raise_span(profile, (marks.peaks[1], marks.valleys[1]), (first, last), by_N)


def bumps_before_peak(base_variant: str, base: Array, draw: Draw) -> Array:
    """Return g13 or g14: three bumps of up to 2 N before the first peak of g2 or g3, which keeps its 30 or 40 N."""
    profile = first_peak_amplitude(base_variant, base, draw)
    peak = landmarks(base).peaks[0]
    return add_cycles(profile, 0.15 * peak, 0.9 * peak, BUMPS, BUMP_N)


def _stretch(base: Array, purpose: str) -> tuple[Array, tuple[int, int]]:
    first, last = plateau_after_second_peak(base, purpose)
    end = landmarks(base).end
    longer = last + round(PLATEAU_STRETCH_DEG * POINTS_PER_DEG)
    if longer >= end:
        raise DoorDataError(f"{purpose}: no room before the end of the motion at {end / POINTS_PER_DEG:.1f} degrees.")
    return move_knots(base, [(first, first), (last, longer)], end), (first, longer)


@dataclass(frozen=True)
class Variant:
    """A variant's strategy, as named in the stimulus table, and the function that makes it."""

    augmentation: str
    make: Callable[[Array, Draw], Array]


VARIANTS: dict[str, Variant] = {
    **{name: Variant("amplitude", partial(first_peak_amplitude, name)) for name in ("g1", "g2", "g3")},
    **{name: Variant("position", partial(compressed_cycles, name)) for name in ("g4", "g5")},
    "g6": Variant("position", compressed_with_end_rise),
    "g7": Variant("perturbation", moved_first_peak),
    "g8": Variant("perturbation", flattened_start),
    "g9": Variant("perturbation", small_cycles),
    "g10": Variant("plateau", unchanged_plateau),
    "g11": Variant("plateau", stretched_plateau),
    "g12": Variant("plateau", heightened_plateau),
    "g13": Variant("bump", partial(bumps_before_peak, "g2")),
    "g14": Variant("bump", partial(bumps_before_peak, "g3")),
}


def move_knots(force_N: Array, knots: Sequence[tuple[float, float]], end: int) -> Array:
    """Move features along the angle: each knot (from, to) is a pair of grid indices, linear between knots.

    The start and the end of the motion stay, and so does the padding behind it. Both members of the knots must
    rise strictly.
    """
    sources = [0.0, *(source for source, _ in knots), float(end)]
    targets = [0.0, *(target for _, target in knots), float(end)]
    places = np.interp(np.arange(end + 1), targets, sources)
    moved = np.interp(places, np.arange(len(force_N)), force_N)
    return np.asarray(np.r_[moved, force_N[end + 1 :]])


def raise_span(force_N: Array, outer: tuple[int, int], inner: tuple[int, int], by_N: float) -> Array:
    """Raise the points of `inner` by `by_N` and stretch both flanks towards `outer` to follow.

    On a flank each force keeps its relative height between the outer point's and the inner point's force, so a
    flank that rises or falls steadily still does, and no peak appears.
    """
    raised = force_N.copy()
    raised[inner[0] : inner[1] + 1] += by_N
    for foot, edge in ((outer[0], inner[0]), (outer[1], inner[1])):
        span = slice(min(foot, edge), max(foot, edge) + 1)
        height = force_N[edge] - force_N[foot]
        if height:
            raised[span] = force_N[foot] + (force_N[span] - force_N[foot]) * (height + by_N) / height
    return raised


def set_peak(force_N: Array, start: int, peak: int, valley: int, to_N: float) -> Array:
    """Set a peak's force, its two flanks stretched between the start, the new peak and the valley."""
    changed = raise_span(force_N, (start, valley), (peak, peak), to_N - force_N[peak])
    changed[peak] = to_N
    return changed


def add_cycles(force_N: Array, first: float, last: float, cycles: int, height_N: float) -> Array:
    """Add small cycles between two grid indices: a sine under a smooth envelope, zero outside with its slope."""
    share = (np.arange(len(force_N)) - first) / (last - first)
    inside = (share > 0) & (share < 1)
    bump = height_N * np.sin(2 * np.pi * cycles * share) * np.sin(np.pi * share) ** 2
    return np.where(inside, force_N + bump, force_N)


def straighten(force_N: Array, first: int, last: int) -> Array:
    """Replace the points between two grid indices by the straight line between them."""
    changed = force_N.copy()
    changed[first : last + 1] = np.linspace(force_N[first], force_N[last], last - first + 1)
    return changed


def ease(share: Array) -> Array:
    """Return a smooth step from 0 to 1 with zero slope at either end."""
    share = np.clip(share, 0, 1)
    return share * share * (3 - 2 * share)
