"""Touch signals and features of a lab's captures, with one texture in memory at a time (thesis 3.4.1).

A ledger of fifty textures of 60 s has 700 MB of samples in one file. It is read once, event by event, to verify it;
then each texture's samples are read when they are needed, here or in a job.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

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
from palpate.analysis.features.touch_features import touch_features
from palpate.modeling.textures.plausible import demand_level, steady
from palpate.modeling.textures.preparing import UP, Filtering, Touched, filtered
from palpate.modeling.textures.rates import FASTEST_HZ, SLOWEST_HZ
from palpate.modeling.textures.reading_ledgers import SIMULATED, STUDY, Capture, captures_by_texture, touched_in
from palpate.modeling.textures.recording import TextureDataError, TooShort
from palpate.protocols.events import event_hash

APART = 0.05
"""The share by which a signal may be longer or shorter than force, since sensors start and stop at different times."""
STREAMS = ("tool_acceleration", "tool_force", "tool_position")


def filtering(trim_s: float = TRIM_S, remove_hum: bool = True) -> Filtering:
    """Return the filtering of chapter 3: 20 to 500 Hz, by default 2.5 s trimmed at both ends.

    Raises TextureDataError for an invalid `trim_s`.
    """
    return Filtering(remove_hum, BAND_HZ, trim_s, f"segments of {SEGMENT_S:g} s")


def touch_of(
    texture: str, touched: Iterable[Touched], way: Filtering | None = None
) -> tuple[Touch, tuple[str, ...]]:  # fmt: skip
    """Return one texture's filtered explorations, read one at a time, and notes; `way` is by default `filtering()`.

    Raises TextureDataError where there is no exploration; for signals that are constant, silent, clipped, implausible,
    or have a rate that is too low or wrong; where less than a segment is left after trimming; and where the tool is
    never in contact.
    """
    stretches: list[Stretch] = []
    notes: list[str] = []
    for exploration in touched:
        _demand_as_long(exploration)
        filtered_stretches, further = filtered(exploration, way or filtering())
        stretches += filtered_stretches
        notes += further
    if not stretches:
        raise TextureDataError(f"{texture}: there is no recording of it")
    longest = max(len(stretch.axes) for stretch in stretches)
    if longest < SEGMENT:
        raise TooShort(
            f"{texture}: after trimming, the longest stretch without a hole is {longest / RATE_HZ:.3g} s; a segment"
            f" takes {SEGMENT_S:g} s: record longer"
        )
    energy = sum(float((stretch.axes**2).sum()) for stretch in stretches)
    demand_level(texture, float(np.sqrt(energy / sum(len(stretch.axes) for stretch in stretches))))
    odd = steady(
        *(np.concatenate(parts) for parts in zip(*((s.speed_mm_s, s.force_N) for s in stretches), strict=True))
    )
    touch = Touch(texture, tuple(stretches))
    return touch, tuple(dict.fromkeys((*notes, *odd, *_lifted(touch))))


def _demand_as_long(touched: Touched) -> None:
    """Raise TextureDataError for a signal whose duration differs from force's, since its stated rate is then wrong."""
    force, moved = touched.force, touched.position if touched.speed is None else touched.speed
    for signal in (touched.acceleration, moved):
        if (
            signal is None
            or min(len(signal.times_s), len(force.times_s)) < 2
            or not (SLOWEST_HZ[signal.what] <= signal.rate_hz <= FASTEST_HZ)
        ):
            continue  # refused with its own message when it is filtered
        if abs(signal.lasts_s - force.lasts_s) > APART * force.lasts_s:
            raise TextureDataError(
                f"{touched.where}: {signal.what} lasts {signal.lasts_s:.4g} s at {signal.rate_hz:g} Hz, and force"
                f" {force.lasts_s:.4g} s at {force.rate_hz:g} Hz: they were recorded together, so at most {APART:.0%}"
                " are expected between them; is the rate of each right, and is neither cut short?"
            )


def _lifted(touch: Touch) -> Iterator[str]:
    """Yield a note on the number of segments without contact. Raises TextureDataError where all are."""
    try:
        pressed = contact(touch)
    except FeatureError as error:
        raise TextureDataError(str(error)) from None
    if not pressed.all():
        share = f"{int((~pressed).sum())} of {len(pressed)} segments ({(~pressed).mean():.0%})"
        yield f"{share} are without contact (mean force below {CONTACT_N:g} N): left out"


@dataclass(frozen=True)
class TextureTouch:
    """The filtered touch signals of one texture.

    `made_from` are the SHA-256 of the samples of each capture: textures that share one are one group in any split.
    """

    id: str
    label: str
    category: str
    touch: Touch
    made_from: frozenset[str]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class FeltRows:
    """One texture's touch features by kind, (segments, features) each."""

    id: str
    label: str
    category: str
    touch: dict[str, NDArray[np.float32]]
    made_from: frozenset[str]
    notes: tuple[str, ...]

    @property
    def simulated(self) -> bool:
        """Whether it was recorded by a simulated device."""
        return SIMULATED in self.notes


@dataclass(frozen=True)
class Recorded:
    """All captures of one texture, and how they are filtered; without samples, so that it can be sent to a job."""

    id: str
    label: str
    category: str
    captures: tuple[Capture, ...]
    way: Filtering = field(default_factory=filtering)
    normal: tuple[float, float, float] = UP

    @property
    def name(self) -> str:
        """The job's name in progress reports and errors."""
        return self.id

    @property
    def made_from(self) -> frozenset[str]:
        """The SHA-256 of the samples of each capture, which does not depend on session, trial and time."""
        return frozenset(_samples_sha256(capture) for capture in self.captures)

    @property
    def key(self) -> str:
        """The SHA-256 of all that the features depend on, except the code; it needs no samples."""
        digest = hashlib.sha256(f"{self.way} {self.normal}".encode())
        for capture in self.captures:
            for event in (event for act in capture.attempt.acts for event in act):
                digest.update(event_hash(event.kind, event).encode())
            digest.update("\0".join(capture.notes).encode())
        return digest.hexdigest()

    def rows(self) -> FeltRows:
        """Read the samples and return the texture's features. Raises TextureDataError as `touch_of` does."""
        return rows_from(felt(self))


def recorded(
    lab: Path, textures: Collection[str] | None = None, *, study: str = STUDY, way: Filtering | None = None,
    normal: tuple[float, float, float] = UP, simulated: bool | None = None,
) -> tuple[Recorded, ...]:  # fmt: skip
    """Return the textures that a lab's sessions, or one session's file, captured: verified, but without their samples.

    Sessions of people who withdrew are left out; `simulated` is as in `captures_by_texture`. Raises TextureDataError
    where no capture counts, where one of `textures` was not captured, and for a damaged file.
    """
    captures = captures_by_texture(lab, study, textures, simulated)
    return tuple(
        Recorded(texture, every[0].label, every[0].category, tuple(every), way or filtering(), normal)
        for texture, every in captures.items()
    )


def felt(texture: Recorded) -> TextureTouch:
    """Read the samples of one texture and return its touch signals. Raises TextureDataError as `touch_of` does."""
    touched = (
        part
        for capture in texture.captures
        for part in touched_in(capture, texture.normal, f"{capture.path.name} trial {capture.attempt.trial}")
    )
    touch, notes = touch_of(texture.id, touched, texture.way)
    return TextureTouch(texture.id, texture.label, texture.category, touch, texture.made_from, notes)


def felt_of(
    texture: str, label: str, category: str, touched: Iterable[Touched], way: Filtering | None = None
) -> TextureTouch:  # fmt: skip
    """Return the touch signals of one texture from recordings of other sources than a lab (tables, HaTT, Cluster).

    Recordings are read one at a time. Raises TextureDataError as `touch_of` does.
    """
    made_from: set[str] = set()

    def passing() -> Iterator[Touched]:
        for exploration in touched:
            made_from.add(_values_sha256(exploration))
            yield exploration

    touch, notes = touch_of(texture, passing(), way)
    return TextureTouch(texture, label, category, touch, frozenset(made_from), notes)


def touches(
    lab: Path, textures: Collection[str] | None = None, *, study: str = STUDY, way: Filtering | None = None,
    normal: tuple[float, float, float] = UP, simulated: bool | None = None,
) -> Iterator[TextureTouch]:  # fmt: skip
    """Return an iterator over the touch signals of a lab's textures, with one texture in memory at a time.

    `way` is a `filtering(...)`: the trimmed seconds, and whether hum is removed. Raises TextureDataError as `recorded`
    and `felt` do.
    """
    return map(felt, recorded(lab, textures, study=study, way=way, normal=normal, simulated=simulated))


def rows_from(felt: TextureTouch) -> FeltRows:
    """Return the features of touch signals."""
    return FeltRows(
        felt.id, felt.label, felt.category, touch_features(felt.touch), felt.made_from, felt.notes
    )  # fmt: skip


def rows_of(texture: Recorded) -> FeltRows:
    """Return `texture.rows()`, as a function for `palpate.modeling.training.jobs.run_jobs`."""
    return texture.rows()


def _samples_sha256(capture: Capture) -> str:
    digest = hashlib.sha256()
    for act in capture.attempt.acts:
        for block in (block for event in act for block in event.samples if block.stream in STREAMS):
            head = (block.stream, block.channels, block.units, float(block.rate_hz), block.first)
            digest.update(repr(head).encode() + block.sha256())
    return digest.hexdigest()


def _values_sha256(touched: Touched) -> str:
    digest = hashlib.sha256()
    for signal in (touched.acceleration, touched.force, touched.speed, touched.position):
        if signal is not None:
            digest.update(f"{signal.what} {signal.values.shape} {signal.rate_hz:.9g}".encode())
            digest.update(np.ascontiguousarray(signal.values, dtype="<f8").tobytes())
    return digest.hexdigest()
