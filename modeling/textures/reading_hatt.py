"""Recordings of the Penn Haptic Texture Toolkit (Culbertson, Lopez Delgado and Kuchenbecker 2014).

Ten seconds of a tool on each of a hundred textures: acceleration, force, position and speed at 10 kHz, in XML. The
supported layouts and the assumptions are described in docs/reference/texture-data.md, Loaders.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from palpate.modeling.textures.preparing import UP, Touched, prepared
from palpate.modeling.textures.rates import Sampled, evenly, projected, speed_from
from palpate.modeling.textures.recording import Recording, TextureDataError
from palpate.modeling.textures.table_columns import PLAIN, is_number, scale_of_unit
from palpate.protocols.files import file_sha256
from palpate.signals.arrays import Array
from palpate.signals.xml_text import EntitiesDeclared, xml_root

RATE_HZ = 10_000.0
"""The toolkit's recording rate, where a file does not give it."""
MODEL = "modelset"
NAMES = {
    "acceleration": ("accel", "acceleration"), "force": ("forcenormal", "force"), "position": ("position",),
    "speed": ("speed",),
}  # fmt: skip
"""The lower-case names of the elements of each signal; the first that exists counts."""
UNITS = {
    "acceleration": ("accelunits", "accelerationunits"), "force": ("forceunits",), "position": ("positionunits",),
    "speed": ("speedunits",),
}  # fmt: skip
RATES = ("samplerate", "samplingrate")
APART = 2.0
"""The greatest ratio of the speed in a recording to the speed from its positions."""
MOVES_MM_S = 5.0
LARGEST = 256 * 1024**2
"""The largest file in bytes; ten seconds of every signal at 10 kHz take some 30 million."""
BETWEEN = re.compile(r"[\s,;]+")
AXES = ("x", "y", "z")
VALUE = "value"


@dataclass(frozen=True)
class Source:
    """The files of one texture: one with all signals, or one for each signal."""

    name: str
    files: Mapping[str, Path]


def read_hatt(
    path: Path, textures: Sequence[str] = (), *, normal: tuple[float, float, float] = UP, remove_hum: bool = True
) -> tuple[Recording, ...]:
    """Return the textures of a recording's file, or of a folder, by name; `textures` are names, by default all.

    A folder holds XML files of one texture each, or folders Accel, Force, and Speed or Position with a file of the same
    name for each texture. Raises TextureDataError for files that are missing, unreadable or cut short, unknown units,
    an implausible rate, and signals that no texture can be learned from.
    """
    return tuple(
        prepared(source.name, source.name.replace("_", " "), [touched(source, normal)], remove_hum)
        for source in sources(path, textures)
    )


def sources(path: Path, textures: Sequence[str] = ()) -> list[Source]:
    """Return the textures of a file or folder, by name, without reading them. Raises TextureDataError."""
    there = _named_sources(path)
    names = [entry.name for entry in there]
    if missing := [name for name in textures if name not in names]:
        raise TextureDataError(f"{path}: no recording of {missing[0]!r}; there are {', '.join(names[:8])}")
    selected = [entry for entry in there if not textures or entry.name in textures]
    for file in (file for entry in selected for file in entry.files.values()):
        if not file.is_file():
            raise TextureDataError(f"{file}: no such file; every signal of a texture has one of the same name")
    return selected


def names_in(path: Path) -> list[str]:
    """Return the textures with a recording, complete or not. Raises TextureDataError where there is none."""
    return [entry.name for entry in _named_sources(path)]


def touched(source: Source, normal: tuple[float, float, float] = UP) -> Touched:
    """Return the recorded signals of one texture, in m/s^2, N, and mm/s or mm. Raises TextureDataError."""
    documents = {what: read_document(file) for what, file in source.files.items()}
    where = " and ".join(dict.fromkeys(document.where for document in documents.values()))
    notes: list[str] = []
    signals = {what: _signal(what, document, len(documents) > 1, notes) for what, document in _per_signal(documents)}
    there = {what: signal for what, signal in signals.items() if signal is not None}
    acceleration, force = there.get("acceleration"), there.get("force")
    if acceleration is None or force is None or not ("speed" in there or "position" in there):
        missing = [what for what in ("acceleration", "force") if what not in there] or ["speed and position"]
        raise TextureDataError(
            f"{where}: no {missing[0]}; a recording of the toolkit is expected (Accel, Force, Speed)"
        )
    # all signals were recorded together: one that ends before the others was cut short
    seconds = {what: len(signal.values) / signal.rate_hz for what, signal in there.items()}
    longest = max(seconds.values())
    if longest - min(seconds.values()) > 1.5 / min(signal.rate_hz for signal in there.values()):
        counts = ", ".join(f"{what} {len(there[what].values)} ({seconds[what]:g} s)" for what in there)
        raise TextureDataError(f"{where}: signals of different lengths: {counts}; is the file cut short?")
    _demand_same_speed(there, normal)
    return Touched(
        where, acceleration, force, there.get("speed"), None if "speed" in there else there["position"], normal,
        tuple(f"{file.name} {file_sha256(file)}" for file in dict.fromkeys(source.files.values())),
        ("recorded by the Penn Haptic Texture Toolkit; see its licence", *dict.fromkeys(notes)),
    )  # fmt: skip


def _named_sources(path: Path) -> list[Source]:
    """Return all sources. Raises TextureDataError for none, or for two of one name."""
    result = list(_sources_in(path))
    names = [entry.name for entry in result]
    if not result:
        raise TextureDataError(f"{path}: no recording; no XML file is there")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise TextureDataError(f"{path}: two recordings are named {twice!r}; a texture has one")
    return result


def _sources_in(path: Path) -> Iterator[Source]:
    if path.is_file():
        yield _whole(path)
        return
    if not path.is_dir():
        raise TextureDataError(f"{path}: no such file or folder; recordings of the toolkit are expected")
    folders = {entry.name.lower(): entry for entry in path.iterdir() if entry.is_dir()}
    apart = {what: folder for what, names in NAMES.items() for name in names if (folder := folders.get(name))}
    if "acceleration" not in apart:
        yield from (_whole(file) for file in _xml_in(path))
        return
    for file in _xml_in(apart["acceleration"]):
        yield Source(file.stem, {what: folder / file.name for what, folder in apart.items()})


def _whole(file: Path) -> Source:
    return Source(file.stem, {"all": file})


def _xml_in(folder: Path) -> list[Path]:
    return sorted(entry for entry in folder.iterdir() if entry.suffix.lower() == ".xml" and entry.name[0] != ".")


def _per_signal(documents: Mapping[str, Document]) -> Iterator[tuple[str, Document]]:
    for document in documents.values():
        if document.root.tag.lower() == MODEL:
            why = "a model of a texture, no recording; palpate render plays it"
            raise TextureDataError(f"{document.where}: {why}")
    for what in NAMES:
        held = documents.get(what) or documents.get("all")
        if held is not None:
            yield what, held


def _signal(what: str, document: Document, apart: bool, notes: list[str]) -> Sampled | None:
    values = document.numbers(*NAMES[what])
    if values is None and apart:
        values = document.alone()
    if values is None:
        return None
    where = f"{document.where}: {what}"
    unit = document.text(*UNITS[what], *(("units", "unit") if apart else ()))
    if not unit:
        notes.append(f"{what} in {PLAIN[what]}: the file gives no unit")
    return evenly(what, values * scale_of_unit(what, unit or PLAIN[what], where), _rate(document, notes), where)


def _rate(document: Document, notes: list[str]) -> float:
    text = document.text(*RATES)
    if not text:
        notes.append(f"{RATE_HZ:g} Hz, as the toolkit documents: the file gives no rate")
        return RATE_HZ
    try:
        rate_hz = float(text)
    except ValueError:
        rate_hz = float("nan")
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise TextureDataError(f"{document.where}: SampleRate is {text[:40]!r}; a number above 0 is expected")
    return rate_hz


def _demand_same_speed(signals: Mapping[str, Sampled], normal: Sequence[float]) -> None:
    """Raise TextureDataError where speed and positions contradict each other: a wrong rate or unit shows here."""
    speed, position = signals.get("speed"), signals.get("position")
    if speed is None or position is None:
        return
    moved = projected(speed_from(position, normal).values, normal)
    recorded, derived = (
        float(np.median(np.linalg.norm(velocity[np.isfinite(velocity).all(axis=1)], axis=1)))
        for velocity in (speed.values, moved)
    )
    if max(recorded, derived) > MOVES_MM_S and not derived / APART <= recorded <= derived * APART:
        raise TextureDataError(
            f"{speed.where}: the median is {recorded:.3g} mm/s, and the positions tell {derived:.3g} mm/s: is "
            f"SampleRate ({position.rate_hz:g} Hz) right, and are SpeedUnits and PositionUnits?"
        )


@dataclass(frozen=True)
class Document:
    """The elements of a file by their lower-case names, without namespace; of equal names the first.

    Elements of axes and values belong to the element around them, and are not included.
    """

    where: str
    root: ElementTree.Element
    elements: dict[str, ElementTree.Element]

    def text(self, *names: str) -> str:
        """Return the text of the first of these elements that exists; "" if none does."""
        element = next((self.elements[name] for name in names if name in self.elements), None)
        return "" if element is None else (element.text or "").strip()

    def numbers(self, *names: str) -> Array | None:
        """Return the numbers (n,) or (n, axes) of the first of these elements that has any; None if none has.

        They are text separated by spaces, commas or semicolons, or <value> elements, possibly within <x>, <y>, <z>;
        axes may also be separate elements such as <AccelX>. Raises TextureDataError on a number that is not finite, and
        on axes that are missing or of different lengths.
        """
        for name in names:
            axes = {axis: self.elements[name + axis] for axis in AXES if name + axis in self.elements}
            if not axes and name in self.elements:
                axes = {tag: child for child in self.elements[name] if (tag := _name(child)) in AXES}
            if axes:
                return self._axes(name, axes)
            if name in self.elements and len(result := self._series(self.elements[name], name)):
                return result
        return None

    def alone(self) -> Array | None:
        """Return the numbers of a file with a single signal, whatever its elements are called."""
        holding = [element for element in self.root.iter() if any(_name(child) == VALUE for child in element)]
        axes = {tag: element for element in holding if (tag := _name(element)) in AXES}
        if axes:
            return self._axes("signal", axes)
        return self._series(holding[0], _name(holding[0])) if len(holding) == 1 else None

    def _axes(self, name: str, axes: dict[str, ElementTree.Element]) -> Array:
        if len(axes) != len(AXES):
            raise TextureDataError(f"{self.where}: {name} has the axes {', '.join(axes)}; x, y and z are expected")
        series = [self._series(axes[axis], f"{name}.{axis}") for axis in AXES]
        if len({len(values) for values in series}) > 1:
            counts = ", ".join(f"{axis} {len(values)}" for axis, values in zip(AXES, series, strict=True))
            raise TextureDataError(f"{self.where}: {name} is cut short: {counts} samples; as many of each are expected")
        return np.stack(series, axis=1)

    def _series(self, element: ElementTree.Element, name: str) -> Array:
        holders = [child for child in element if _name(child) == VALUE] or [element]
        cells = [cell for holder in holders for cell in BETWEEN.split(holder.text or "") if cell]
        try:
            result = np.array(cells, dtype=np.float64)
        except ValueError:
            bad = next(place for place, cell in enumerate(cells) if not is_number(cell))
            raise TextureDataError(
                f"{self.where}: {name}, sample {bad + 1}, is {cells[bad][:40]!r}; a number is expected"
            ) from None
        odd = np.flatnonzero(~np.isfinite(result))
        if odd.size:
            raise TextureDataError(
                f"{self.where}: {name}, sample {odd[0] + 1}, is {result[odd[0]]}, which is not finite"
            )
        return result


def read_document(file: Path) -> Document:
    """Read a file's elements.

    Raises TextureDataError where it is missing, too large, not XML, cut short, or has entities.
    """
    where = str(file)
    try:
        root = xml_root(_content(file))
    except UnicodeDecodeError as error:
        raise TextureDataError(f"{file}: byte {error.start} is not UTF-8; a recording of the toolkit is") from None
    except EntitiesDeclared:
        raise TextureDataError(
            f"{file}: it declares entities, which recordings have no need of; it is not read"
        ) from None
    except (ElementTree.ParseError, ValueError) as error:
        raise TextureDataError(f"{where}: no whole XML ({error}); is the file cut short?") from None
    elements: dict[str, ElementTree.Element] = {}
    for element in root.iter():
        if (name := _name(element)) not in (*AXES, VALUE):
            elements.setdefault(name, element)
    return Document(where, root, elements)


def _content(file: Path) -> bytes:
    try:
        size = file.stat().st_size
        if size > LARGEST:
            raise TextureDataError(f"{file}: {size} bytes; a recording of the toolkit has at most {LARGEST}")
        return file.read_bytes()
    except OSError as error:
        raise TextureDataError(f"{file}: cannot be read ({error.strerror})") from None


def _name(element: ElementTree.Element) -> str:
    return str(element.tag).rpartition("}")[2].lower()
