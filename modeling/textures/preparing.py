"""The preparation of recorded signals for models: 1 kHz, filtered, one axis, checked (thesis 4.3.3)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.features.touch import Stretch
from palpate.modeling.textures.hum import before_filter, without_hum
from palpate.modeling.textures.plausible import NOTED_CLIPPED, clipped_share, demand_alive, demand_plausible, oddities
from palpate.modeling.textures.rates import Sampled, along, on_grid, speed_from
from palpate.modeling.textures.recording import RATE_HZ, Recording, TextureDataError, TooShort, joined
from palpate.signals.arrays import Array
from palpate.signals.filters import BAND_HZ, HAND_HZ, band_pass, has_upper_edge, low_pass
from palpate.signals.one_axis import FRAME_S, one_axis

SHORTEST_S = 0.3
"""Shorter pieces between two gaps are left out, since the filters' ends would be most of them."""
AT_ENDS_S = 0.2
"""Seconds that may be lost at the ends without a note: the slope of positions and the last step of the slowest clock
take 0.06 s at 120 Hz, and 0.15 s at 20 Hz.
"""
UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Touched:
    """The recorded signals of one exploration.

    Acceleration in m/s^2 on one axis or three, with or without gravity; force in N, one axis (normal) or three; and
    either a speed in mm/s on one axis or positions in mm on two or three. `normal` is perpendicular to the surface, in
    the axes of force and positions; its sign does not matter. `where` names it in messages.
    """

    where: str
    acceleration: Sampled
    force: Sampled
    speed: Sampled | None = None
    position: Sampled | None = None
    normal: tuple[float, float, float] = UP
    made_from: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Filtering:
    """How an exploration is filtered: without hum or with it, in which band, how much is trimmed at both ends.

    `frames` describes for the notes the parts that DFT321 takes spectra of.
    """

    remove_hum: bool = True
    band_hz: tuple[float, float] = BAND_HZ
    trim_s: float = 0.0
    frames: str = f"frames of {1e3 * FRAME_S:g} ms"

    def __post_init__(self) -> None:
        if not 0 <= self.trim_s < np.inf:
            raise TextureDataError(f"{self.trim_s} s to be trimmed at both ends: a number from 0 on is expected")


WHOLE = Filtering()


def prepared(texture: str, label: str, touched: Iterable[Touched], remove_hum: bool = True) -> Recording:
    """Return one texture's explorations, taken one at a time, as one recording at 1 kHz.

    Speed and force are low-passed at 25 Hz, each axis of acceleration is high-passed at 20 Hz (the upper edge of 1000
    Hz is left out, as 1 kHz holds nothing there), mains hum is removed, and DFT321 combines the axes into one. Long
    gaps and several explorations give a `Joined` recording. Raises TextureDataError on signals that are constant,
    clipped, implausible or too short.
    """
    pieces: list[Array] = []
    notes: list[str] = []
    made_from: list[str] = []
    for exploration in touched:
        stretches, further = filtered(exploration, Filtering(remove_hum=remove_hum))
        pieces += [
            np.stack([one_axis(stretch.axes, RATE_HZ), stretch.speed_mm_s, stretch.force_N]) for stretch in stretches
        ]
        notes += further
        made_from += exploration.made_from
    if not pieces:
        raise TextureDataError(f"{texture}: there is no recording of it")
    recording = joined(texture, label, pieces, tuple(made_from), tuple(dict.fromkeys(notes)))
    demand_alive(recording)
    return replace(recording, notes=(*recording.notes, *oddities(recording)))


def filtered(touched: Touched, way: Filtering = WHOLE) -> tuple[list[Stretch], list[str]]:
    """Return the stretches of an exploration where all signals are known, at 1 kHz, filtered by axis, and notes.

    Trimming comes last, so that it also removes the ends of the filters. Raises TextureDataError on signals that are
    constant, clipped, implausible or too short.
    """
    demand_plausible(touched.acceleration)
    demand_plausible(touched.force)
    moved = _speed(touched)
    signals = (touched.acceleration, moved, touched.force)
    (vibration, speed, force), known, further = on_grid(signals)
    pressed = along(force, touched.normal)
    notes = [*touched.notes, *further]
    if known.any() and np.median(pressed[known]) < 0 and abs(pressed[known].min()) > abs(pressed[known].max()):
        pressed = -pressed  # a sensor that counts the other way
        notes.append("force was negative where the tool pressed; its sign is changed")
    notes += _filters(touched.acceleration, way)
    edges = np.flatnonzero(np.diff(np.r_[False, known, False].astype(int)))
    runs = [
        (a, b)
        for a, b in [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
        if b - a >= SHORTEST_S * RATE_HZ
    ]
    notes += _holes(touched.where, runs, known, signals)
    shifted = []
    for a, b in runs:
        stretch, hum = _filtered(vibration[a:b], np.linalg.norm(speed[a:b], axis=1), pressed[a:b], way)
        shifted.append(replace(stretch, first=a))
        notes += hum
    # leave out what lies within `trim_s` of the exploration's start or end
    length = len(known)
    first = round(way.trim_s * RATE_HZ)
    cut = [stretch.cut(max(0, first - stretch.first), max(0, length - first - stretch.first)) for stretch in shifted]
    remaining = [stretch for stretch in cut if len(stretch.axes)]
    if not remaining:
        raise TooShort(
            f"{touched.where}: nothing of its {length / RATE_HZ:.2f} s is left where {way.trim_s:g} s are trimmed at"
            " both ends: record longer"
        )
    return remaining, notes


def _holes(
    where: str, runs: Sequence[tuple[int, int]], known: NDArray[np.bool_], signals: Sequence[Sampled]
) -> list[str]:  # fmt: skip
    """Return notes on losses by gaps and by signals that end before others.

    Raises TextureDataError if nothing is left.
    """
    if not runs:
        raise TextureDataError(
            f"{where}: nowhere are acceleration, speed and force all known for {SHORTEST_S:g} s; record again"
        )
    used, longest_s = sum(b - a for a, b in runs), max(signal.lasts_s for signal in signals)
    share = f"{used / RATE_HZ:.2f} of {longest_s:.2f} s"
    if used < known.sum() or len(runs) > 1:
        return [f"{len(runs)} stretches between holes, {share}"]
    if longest_s - used / RATE_HZ <= AT_ENDS_S:
        return []
    each_s = ", ".join(f"{signal.what} {signal.known_s:.2f} s" for signal in signals)
    return [f"all signals are known together for {share} ({each_s}): the rest is left out"]


def _speed(touched: Touched) -> Sampled:
    if touched.speed is not None:
        demand_plausible(touched.speed)
        return touched.speed
    if touched.position is None:
        raise TextureDataError(f"{touched.where}: neither a speed nor positions to tell it from")
    moved = speed_from(touched.position, touched.normal)
    demand_plausible(moved)
    return moved


def _filtered(vibration: Array, speed: Array, force: Array, way: Filtering) -> tuple[Stretch, list[str]]:
    """Return one stretch filtered at 1 kHz, and notes on its hum."""

    def banded(axes: Array) -> Array:
        return band_pass(axes, RATE_HZ, way.band_hz)

    felt = banded(vibration)
    hum = without_hum(felt, RATE_HZ)[1] if way.remove_hum else None
    clean = before_filter(vibration, felt, hum, RATE_HZ, banded) if hum else felt
    hand = low_pass(np.stack([speed, force], axis=1), RATE_HZ)
    return Stretch(clean, np.maximum(hand[:, 0], 0.0), hand[:, 1]), [hum.note()] if hum else []


def _filters(acceleration: Sampled, way: Filtering) -> list[str]:
    """Return notes on the filters of every recording, and on oddities of this acceleration."""
    notes = [f"speed and force low-passed at {HAND_HZ:g} Hz, without delay"]
    low_hz, high_hz = way.band_hz
    if not has_upper_edge(RATE_HZ, high_hz):
        notes.append(
            f"acceleration high-passed at {low_hz:g} Hz: the upper edge of {high_hz:g} Hz is left out, as"
            f" {RATE_HZ:g} Hz holds nothing from {RATE_HZ / 2:g} Hz on"
        )
    axes = acceleration.values.shape[1]
    if axes > 1:
        notes.append(f"{axes} axes of acceleration on one by DFT321, in {way.frames}")
    if way.trim_s:
        notes.append(f"the first and last {way.trim_s:g} s are left out")
    if (share := clipped_share(acceleration.values)) > NOTED_CLIPPED:
        notes.append(f"{share:.2%} of the acceleration is clipped at the end of its sensor's range")
    if acceleration.rate_hz < 0.99 * RATE_HZ:
        notes.append(f"acceleration recorded at {acceleration.rate_hz:.4g} Hz: nothing above half of that is known")
    return notes
