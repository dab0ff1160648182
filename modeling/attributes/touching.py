"""From what sensors gave, of whatever source, to what was felt of one texture (thesis 3.4.1)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from analysis.features.segments import SEGMENT, SEGMENT_S
from analysis.features.touch import BAND_HZ, RATE_HZ, TRIM_S, Stretch, Touch
from modeling.textures.plausible import demand_level, steady
from modeling.textures.preparing import Filtering, Touched, filtered
from modeling.textures.recording import TextureDataError


def filtering(trim_s: float = TRIM_S, remove_hum: bool = True) -> Filtering:
    """How recordings are filtered for chapter 3: 20 to 500 Hz, 2.5 s trimmed at both ends. Raises TextureDataError."""
    return Filtering(remove_hum, BAND_HZ, trim_s, f"segments of {SEGMENT_S:g} s")


def touch_of(
    texture: str, touched: Iterable[Touched], way: Filtering | None = None
) -> tuple[Touch, tuple[str, ...]]:  # fmt: skip
    """What was felt of one texture in its explorations, taken one at a time, and notes; `way` is `filtering()`.

    Raises TextureDataError where there is none, on signals that are constant, silent, clipped, implausible or of a rate
    that does not tell them, and where nothing as long as a segment is left after trimming.
    """
    stretches: list[Stretch] = []
    notes: list[str] = []
    for each in touched:
        found, told = filtered(each, way or filtering())
        stretches += found
        notes += told
    _demand_segment(texture, stretches)
    demand_level(texture, _level(stretches))
    odd = steady(*(np.concatenate(each) for each in zip(*((s.speed_mm_s, s.force_N) for s in stretches), strict=True)))
    return Touch(texture, tuple(stretches)), tuple(dict.fromkeys((*notes, *odd)))


def _demand_segment(texture: str, stretches: Sequence[Stretch]) -> None:
    if not stretches:
        raise TextureDataError(f"{texture}: there is no recording of it")
    longest = max(len(each.axes) for each in stretches)
    if longest < SEGMENT:
        raise TextureDataError(
            f"{texture}: after trimming, the longest stretch without a hole is {longest / RATE_HZ:.3g} s; a segment"
            f" takes {SEGMENT_S:g} s: record longer, or trim less"
        )


def _level(stretches: Sequence[Stretch]) -> float:
    """RMS of all axes together."""
    energy = sum(float((each.axes**2).sum()) for each in stretches)
    return float(np.sqrt(energy / sum(len(each.axes) for each in stretches)))
