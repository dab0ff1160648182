"""Recordings of the Penn Haptic Texture Toolkit (Culbertson, Lopez Delgado and Kuchenbecker 2014).

Ten seconds of a tool on each of a hundred textures: acceleration, force, position and speed at 10 kHz, in XML. The
layouts that are read, and what of them is assumed: docs/reference/texture-data.md, Loaders.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.modeling.textures.hatt_xml import Document, read_document
from palpate.modeling.textures.preparing import UP, Touched, prepared
from palpate.modeling.textures.rates import Sampled, evenly, projected, speed_from
from palpate.modeling.textures.recording import Recording, TextureDataError
from palpate.modeling.textures.units import PLAIN, scale_of_unit
from palpate.protocols.files import file_sha256
from palpate.signals.arrays import Array

RATE_HZ = 10_000.0
"""What the toolkit recorded at, where a file does not say."""
MODEL = "modelset"
NAMES = {
    "acceleration": ("accel", "acceleration"), "force": ("forcenormal", "force"), "position": ("position",),
    "speed": ("speed",),
}  # fmt: skip
"""The elements of each signal, in small letters, the first that is there."""
UNITS = {
    "acceleration": ("accelunits", "accelerationunits"), "force": ("forceunits",), "position": ("positionunits",),
    "speed": ("speedunits",),
}  # fmt: skip
RATES = ("samplerate", "samplingrate")
APART = 2.0
"""Speed and positions of one recording tell speeds that are so many times apart at most."""
MOVES_MM_S = 5.0


@dataclass(frozen=True)
class Source:
    """One texture's files: one with everything in it, or one for each signal."""

    name: str
    files: Mapping[str, Path]


def read_hatt(
    path: Path, textures: Sequence[str] = (), *, normal: tuple[float, float, float] = UP, remove_hum: bool = True
) -> tuple[Recording, ...]:
    """The textures of a recording's file, or of a folder; by name. `textures` are names, all where there is none.

    A folder holds XML files of one texture each, or folders Accel, Force, and Speed or Position with a file of the same
    name for each texture. Raises TextureDataError: what is not there, not read or cut short, other units than those
    known, no rate that a recording has, and signals that no texture can be learned from.
    """
    return tuple(
        prepared(each.name, each.name.replace("_", " "), [touched(each, normal)], remove_hum)
        for each in sources(path, textures)
    )


def sources(path: Path, textures: Sequence[str] = ()) -> list[Source]:
    """The textures that there are in a file or folder, by name; none of them is read yet. Raises TextureDataError."""
    found = _found(path)
    names = [each.name for each in found]
    if missing := [name for name in textures if name not in names]:
        raise TextureDataError(f"{path}: no recording of {missing[0]!r}; there are {', '.join(names[:8])}")
    wanted = [each for each in found if not textures or each.name in textures]
    for file in (file for each in wanted for file in each.files.values()):
        if not file.is_file():
            raise TextureDataError(f"{file}: no such file; every signal of a texture has one of the same name")
    return wanted


def names_in(path: Path) -> list[str]:
    """The textures of which there is a recording, whole or not. Raises TextureDataError where there is none."""
    return [each.name for each in _found(path)]


def touched(source: Source, normal: tuple[float, float, float] = UP) -> Touched:
    """What the sensors recorded of one texture, in m/s^2, N, and mm/s or mm. Raises TextureDataError."""
    documents = {what: read_document(file) for what, file in source.files.items()}
    where = " and ".join(dict.fromkeys(document.where for document in documents.values()))
    told: list[str] = []
    signals = {what: _signal(what, document, len(documents) > 1, told) for what, document in _per_signal(documents)}
    there = {what: each for what, each in signals.items() if each is not None}
    acceleration, force = there.get("acceleration"), there.get("force")
    if acceleration is None or force is None or not ("speed" in there or "position" in there):
        lacks = [what for what in ("acceleration", "force") if what not in there] or ["speed and position"]
        raise TextureDataError(f"{where}: no {lacks[0]}; a recording of the toolkit is expected (Accel, Force, Speed)")
    _demand_as_long(where, there)
    _demand_same_speed(there, normal)
    return Touched(
        where, acceleration, force, there.get("speed"), None if "speed" in there else there["position"], normal,
        tuple(f"{file.name} {file_sha256(file)}" for file in dict.fromkeys(source.files.values())),
        ("recorded by the Penn Haptic Texture Toolkit; see its licence", *dict.fromkeys(told)),
    )  # fmt: skip


def _found(path: Path) -> list[Source]:
    """What there is, by name; a file beside may lack."""
    found = list(_there(path))
    names = [each.name for each in found]
    if not found:
        raise TextureDataError(f"{path}: no recording; no XML file is there")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise TextureDataError(f"{path}: two recordings are named {twice!r}; a texture has one")
    return found


def _there(path: Path) -> Iterator[Source]:
    if path.is_file():
        yield _whole(path)
        return
    if not path.is_dir():
        raise TextureDataError(f"{path}: no such file or folder; recordings of the toolkit are expected")
    folders = {each.name.lower(): each for each in path.iterdir() if each.is_dir()}
    apart = {what: folder for what, names in NAMES.items() for name in names if (folder := folders.get(name))}
    if "acceleration" not in apart:
        yield from (_whole(file) for file in _xml_in(path))
        return
    for file in _xml_in(apart["acceleration"]):
        yield Source(file.stem, {what: folder / file.name for what, folder in apart.items()})


def _whole(file: Path) -> Source:
    return Source(file.stem, {"all": file})


def _xml_in(folder: Path) -> list[Path]:
    return sorted(each for each in folder.iterdir() if each.suffix.lower() == ".xml" and each.name[0] != ".")


def _per_signal(documents: Mapping[str, Document]) -> Iterator[tuple[str, Document]]:
    for document in documents.values():
        if document.root.tag.lower() == MODEL:
            told = "a model of a texture, no recording; palpate render plays it"
            raise TextureDataError(f"{document.where}: {told}")
    for what in NAMES:
        held = documents.get(what) or documents.get("all")
        if held is not None:
            yield what, held


def _signal(what: str, document: Document, apart: bool, told: list[str]) -> Sampled | None:
    values = document.numbers(*NAMES[what])
    if values is None and apart:
        values = document.alone()
    if values is None:
        return None
    where = f"{document.where}: {what}"
    unit = document.text(*UNITS[what], *(("units", "unit") if apart else ()))
    if not unit:
        told.append(f"{what} in {PLAIN[what]}: the file says no unit")
    return evenly(what, values * scale_of_unit(what, unit or PLAIN[what], where), _rate(document, told), where)


def _rate(document: Document, told: list[str]) -> float:
    said = document.text(*RATES)
    if not said:
        told.append(f"{RATE_HZ:g} Hz, as the toolkit documents: the file says no rate")
        return RATE_HZ
    try:
        rate_hz = float(said)
    except ValueError:
        rate_hz = float("nan")
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise TextureDataError(f"{document.where}: SampleRate is {said[:40]!r}; a number above 0 is expected")
    return rate_hz


def _demand_as_long(where: str, signals: Mapping[str, Sampled]) -> None:
    """All signals were recorded together: one that ends before the others was cut short."""
    seconds = {what: len(each.values) / each.rate_hz for what, each in signals.items()}
    longest = max(seconds.values())
    if longest - min(seconds.values()) > 1.5 / min(each.rate_hz for each in signals.values()):
        counts = ", ".join(f"{what} {len(signals[what].values)} ({seconds[what]:g} s)" for what in signals)
        raise TextureDataError(f"{where}: signals of different lengths: {counts}; is the file cut short?")


def _demand_same_speed(signals: Mapping[str, Sampled], normal: Sequence[float]) -> None:
    """Where speed and positions are both there, they must tell about the same: a wrong rate or unit shows here."""
    speed, position = signals.get("speed"), signals.get("position")
    if speed is None or position is None:
        return
    moved = projected(speed_from(position, normal).values, normal)
    told, found = (float(np.median(np.linalg.norm(_known(each), axis=1))) for each in (speed.values, moved))
    if max(told, found) > MOVES_MM_S and not found / APART <= told <= found * APART:
        raise TextureDataError(
            f"{speed.where}: the median is {told:.3g} mm/s, and the positions tell {found:.3g} mm/s: is SampleRate"
            f" ({position.rate_hz:g} Hz) right, and are SpeedUnits and PositionUnits?"
        )


def _known(values: Array) -> Array:
    return values[np.isfinite(values).all(axis=1)]
