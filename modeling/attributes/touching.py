"""From what sensors gave, of whatever source, to what was felt of one texture (thesis 3.4.1)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from palpate.analysis.features.touch import (
    BAND_HZ,
    CONTACT_N,
    RATE_HZ,
    SEGMENT,
    SEGMENT_S,
    TRIM_S,
    FeatureError,
    Stretch,
    Touch,
    contact,
)
from palpate.modeling.textures.plausible import demand_level, steady
from palpate.modeling.textures.preparing import Filtering, Touched, filtered
from palpate.modeling.textures.rates import FASTEST_HZ, SLOWEST_HZ, Sampled
from palpate.modeling.textures.recording import TextureDataError, TooShort

APART = 0.05
"""The share by which a signal may last longer or shorter than force: sensors do not start and stop together."""


def filtering(trim_s: float = TRIM_S, remove_hum: bool = True) -> Filtering:
    """How recordings are filtered for chapter 3: 20 to 500 Hz, 2.5 s trimmed at both ends. Raises TextureDataError."""
    return Filtering(remove_hum, BAND_HZ, trim_s, f"segments of {SEGMENT_S:g} s")


def touch_of(
    texture: str, touched: Iterable[Touched], way: Filtering | None = None
) -> tuple[Touch, tuple[str, ...]]:  # fmt: skip
    """What was felt of one texture in its explorations, taken one at a time, and notes; `way` is `filtering()`.

    Raises TextureDataError where there is none, on signals that are constant, silent, clipped, implausible, of a rate
    that does not tell them or of one that is not theirs, where nothing as long as a segment is left after trimming, and
    where the tool is never in contact.
    """
    stretches: list[Stretch] = []
    notes: list[str] = []
    for each in touched:
        _demand_as_long(each)
        found, told = filtered(each, way or filtering())
        stretches += found
        notes += told
    _demand_segment(texture, stretches)
    demand_level(texture, _level(stretches))
    odd = steady(*(np.concatenate(each) for each in zip(*((s.speed_mm_s, s.force_N) for s in stretches), strict=True)))
    touch = Touch(texture, tuple(stretches))
    return touch, tuple(dict.fromkeys((*notes, *odd, *_lifted(touch))))


def _demand_as_long(touched: Touched) -> None:
    """A signal at another rate than it is said to have would have other frequencies or speeds, and last otherwise."""
    force, moved = touched.force, touched.position if touched.speed is None else touched.speed
    for signal in (touched.acceleration, moved):
        if signal is None or min(len(signal.times_s), len(force.times_s)) < 2 or not _of_a_sensor(signal):
            continue  # refused as what it is, when it is filtered
        if abs(signal.lasts_s - force.lasts_s) > APART * force.lasts_s:
            raise TextureDataError(
                f"{touched.where}: {signal.what} lasts {signal.lasts_s:.4g} s at {signal.rate_hz:g} Hz, and force"
                f" {force.lasts_s:.4g} s at {force.rate_hz:g} Hz: they were recorded together, so at most {APART:.0%}"
                " are expected between them; is the rate of each right, and is neither cut short?"
            )


def _of_a_sensor(signal: Sampled) -> bool:
    return SLOWEST_HZ[signal.what] <= signal.rate_hz <= FASTEST_HZ


def _lifted(touch: Touch) -> Iterator[str]:
    """How many segments are without contact. Raises TextureDataError where all are."""
    try:
        pressed = contact(touch)
    except FeatureError as error:
        raise TextureDataError(str(error)) from None
    if not pressed.all():
        share = f"{int((~pressed).sum())} of {len(pressed)} segments ({(~pressed).mean():.0%})"
        yield f"{share} are without contact (mean force below {CONTACT_N:g} N): left out"


def _demand_segment(texture: str, stretches: Sequence[Stretch]) -> None:
    if not stretches:
        raise TextureDataError(f"{texture}: there is no recording of it")
    longest = max(len(each.axes) for each in stretches)
    if longest < SEGMENT:
        raise TooShort(
            f"{texture}: after trimming, the longest stretch without a hole is {longest / RATE_HZ:.3g} s; a segment"
            f" takes {SEGMENT_S:g} s: record longer"
        )


def _level(stretches: Sequence[Stretch]) -> float:
    """RMS of all axes together."""
    energy = sum(float((each.axes**2).sum()) for each in stretches)
    return float(np.sqrt(energy / sum(len(each.axes) for each in stretches)))
