"""The few operations that every augmentation is made of: bend the angle axis, rescale flanks, add small cycles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.signals.arrays import Array


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
    """Return a smooth step from 0 to 1 without a slope at either end."""
    share = np.clip(share, 0, 1)
    return share * share * (3 - 2 * share)
