"""Textures from a lab's ledgers: the recordings of texture_capture sessions, one recording per texture."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate.analysis.streams.recorded_streams import (
    RecordedAttempt,
    Stream,
    StreamError,
    attempts_of,
    counting_attempts,
    streams_in,
)
from palpate.modeling.textures.preparing import UP, Touched, prepared
from palpate.modeling.textures.rates import Sampled
from palpate.modeling.textures.recording import Recording, TextureDataError
from palpate.modeling.textures.table_columns import scale_of_unit
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.files import file_sha256
from palpate.protocols.wording import some
from palpate.studies.collecting.study_sessions import real_or_simulated, sessions_of
from palpate.studies.participants.registry import withdrawn
from palpate.studies.sessions.record import LedgerError
from palpate.studies.sessions.session_files import by_twins, ledgers_in, stimulus_columns

STUDY = "texture_capture"
AXES = ("x", "y", "z")
CHANNELS = {"acceleration": (("ax", "ay", "az"), AXES), "force": (("Fx", "Fy", "Fz"),), "position": (AXES,)}
"""Channels of the streams tool_acceleration, tool_force and tool_position, without the torque."""
SEEN = "seen"
"""A tracker's channel that is 0 where the marker was hidden."""
SIMULATED = "simulated"
"""The note of a recording that a twin made."""


class NoCapture(TextureDataError):
    """No session has a capture that counts."""


@dataclass(frozen=True)
class Capture:
    """One capture that counts; its samples stay in the ledger until `touched_in` reads them."""

    path: Path
    attempt: RecordedAttempt
    label: str
    category: str = ""
    notes: tuple[str, ...] = ()

    @property
    def where(self) -> str:
        """The capture's description for messages."""
        return f"{self.path}: trial {self.attempt.trial} ({self.attempt.stimulus})"

    @property
    def simulated(self) -> bool:
        """Whether a simulated device made it."""
        return SIMULATED in self.notes


def read_lab(
    lab: Path, study: str = STUDY, textures: Collection[str] | None = None, *,
    normal: tuple[float, float, float] = UP, remove_hum: bool = True, simulated: bool | None = None,
) -> tuple[Recording, ...]:  # fmt: skip
    """Return the textures that a lab's sessions captured, in the order of their first appearance.

    `lab` is the folder of a lab, or one session's file. Of each trial the attempt that counts is read, not one that was
    repeated or faulted. Several captures of a texture make one recording with borders (`Joined`). The streams
    tool_acceleration, tool_force and tool_position are read, of any rate, by their own clocks; `normal` points out of
    the surface in the axes of force and position. `textures` are stimuli, None means all. Sessions of people who
    withdrew, and `simulated`, are treated as in `captures_by_texture`. Raises TextureDataError where there is no
    capture, on a capture without a stream or that no texture can be learned from, and on a damaged file.
    """
    by_texture = captures_by_texture(lab, study, textures, simulated)
    files = {capture.path: file_sha256(capture.path) for every in by_texture.values() for capture in every}
    return tuple(
        prepared(
            texture,
            captures[0].label,
            (
                recording
                for capture in captures
                for recording in touched_in(
                    capture, normal, f"{capture.path.name} trial {capture.attempt.trial} {files[capture.path]}"
                )
            ),
            remove_hum,
        )
        for texture, captures in by_texture.items()
    )


def captures_by_texture(
    lab: Path, study: str = STUDY, textures: Collection[str] | None = None, simulated: bool | None = None
) -> dict[str, list[Capture]]:
    """Return the captures that count, by texture in the order of first appearance, without reading samples.

    Sessions of people who withdrew are not read. `simulated` selects recordings of twins, or of a rig; None selects a
    rig's where there are any: the two are never mixed. Raises TextureDataError on a damaged file, and its subclass
    NoCapture where there is no capture.
    """
    captures = list(_captures(lab, study))
    counted, notes = real_or_simulated(captures, simulated, "captures")
    by_texture: dict[str, list[Capture]] = {}
    for capture in counted:
        if textures is None or capture.attempt.stimulus in textures:
            noted = replace(capture, notes=(*capture.notes, *notes))
            by_texture.setdefault(capture.attempt.stimulus, []).append(noted)
    gone = withdrawn(lab.parent.parent if lab.is_file() else lab)
    others = {capture.simulated for capture in captures} - {capture.simulated for capture in counted}
    also = [f"is of a {'simulated' if kind else 'real'} session" for kind in others]
    _demand_all(lab, by_texture, textures, [*(["is of a participant who withdrew"] if gone else []), *also])
    return by_texture


def _captures(lab: Path, study: str) -> Iterator[Capture]:
    """Yield the captures of every session that count. Raises TextureDataError on a damaged file, and for no session."""
    if not (lab.is_file() or ledgers_in(lab, study)):
        where = "a lab's folder or a session's file is expected (or --tables, --simulated)"
        raise TextureDataError(f"{lab}: no session of {study}; {where}")
    try:
        for record in sessions_of(lab, study):
            rows, notes = stimulus_columns(record.header), (SIMULATED,) if by_twins(record.header) else ()
            for attempt in counting_attempts(attempts_of(record)).values():
                row = rows.get(attempt.stimulus, {})
                label, category = row.get("label") or attempt.stimulus, row.get("class") or ""
                yield Capture(record.path, attempt, label, category, notes)
    except LedgerError as error:
        raise TextureDataError(str(error)) from None


def touched_in(capture: Capture, normal: tuple[float, float, float], made_from: str) -> Iterator[Touched]:
    """Yield each recording of a capture, with its samples from the ledger. Raises TextureDataError."""
    where = capture.where
    try:
        streams = streams_in(capture.attempt)
    except StreamError as error:
        raise TextureDataError(f"{capture.path}: {error}") from None
    touches = [stream for stream in streams if stream.name.startswith("tool_")] or streams
    for act in dict.fromkeys(stream.act for stream in touches):  # others hold what was recorded beside the session
        of_act = {stream.name: stream for stream in streams if stream.act == act}
        yield Touched(
            where, _sampled("acceleration", of_act, where), _sampled("force", of_act, where),
            position=_sampled("position", of_act, where), normal=normal, made_from=(made_from,), notes=capture.notes,
        )  # fmt: skip


def _sampled(what: str, streams: dict[str, Stream], where: str) -> Sampled:
    """Return a stream's samples in m/s^2, N or mm at the times of its clock."""
    name = f"tool_{what}"
    if name not in streams:
        raise TextureDataError(f"{where}: no stream {name!r} was recorded; there are {some(streams) or 'none'}")
    stream = streams[name]
    try:
        values, clock = stream.values(), stream.timing
    except StreamError as error:
        raise TextureDataError(f"{where}: {error}") from None
    times_s = clock.t0_s + stream.numbers() / clock.rate_hz
    columns = _columns(what, stream, where)
    scales = [scale_of_unit(what, stream.units[column], f"{where}: {stream.name}") for column in columns]
    scaled = values[:, columns] * np.array(scales)
    if SEEN in stream.channels:
        scaled[values[:, stream.channels.index(SEEN)] == 0] = np.nan
    return Sampled(what, times_s, np.asarray(scaled), float(clock.rate_hz), f"{where}: {name}")


def _columns(what: str, stream: Stream, where: str) -> list[int]:
    """Return the indices of the axes; an accelerometer, or a force sensor along the normal, may have a single one."""
    for names in CHANNELS[what]:
        if set(names) <= set(stream.channels):
            return [stream.channels.index(name) for name in names]
    if what != "position" and len(stream.channels) == 1:
        return [0]
    raise TextureDataError(
        f"{where}: {stream.name} has the channels {', '.join(stream.channels)}; {', '.join(CHANNELS[what][0])} are"
        " expected"
    )


def _demand_all(
    lab: Path, captures: Mapping[str, Sequence[Capture]], textures: Collection[str] | None, also: Sequence[str]
) -> None:
    """Raise NoCapture where a texture, or all, are missing; `also` are further reasons why a capture may not count."""
    for texture in textures or ():
        if texture not in captures:
            raise NoCapture(f"{lab}: no capture of {texture!r} counts; {nearest(texture, captures)}")
    if not captures:
        why = "".join(f", or {source}" for source in also)
        raise NoCapture(f"{lab}: no capture counts: every attempt was repeated, left or faulted{why}")
