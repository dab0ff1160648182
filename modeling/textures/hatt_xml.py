"""Numbers out of an XML file of the Penn Haptic Texture Toolkit's recordings, read without trust."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from palpate.modeling.textures.recording import TextureDataError
from palpate.signals.arrays import Array
from palpate.signals.xml_text import EntitiesDeclared, xml_root

LARGEST = 256 * 1024**2
"""Bytes of a file; ten seconds of every signal at 10 kHz take some 30 million."""
BETWEEN = re.compile(r"[\s,;]+")
AXES = ("x", "y", "z")
VALUE = "value"


@dataclass(frozen=True)
class Document:
    """The elements of a file by their names in small letters, without namespace; of equal ones the first.

    Axes and values belong to the element around them, and are not among these.
    """

    where: str
    root: ElementTree.Element
    elements: dict[str, ElementTree.Element]

    def text(self, *names: str) -> str:
        """What stands in the first of these elements that is there; "" where none is."""
        found = next((self.elements[name] for name in names if name in self.elements), None)
        return "" if found is None else (found.text or "").strip()

    def numbers(self, *names: str) -> Array | None:
        """(n,) or (n, axes): the numbers of the first of these elements that holds any; None where none does.

        They stand as text between spaces, commas or semicolons, as <value> elements, or so in <x>, <y>, <z>; axes may
        also be elements of their own, as <AccelX>. Raises TextureDataError on what is no finite number, and on axes
        that are missing or of different lengths.
        """
        for name in names:
            axes = {axis: self.elements[name + axis] for axis in AXES if name + axis in self.elements}
            if not axes and name in self.elements:
                axes = {tag: child for child in self.elements[name] if (tag := _name(child)) in AXES}
            if axes:
                return self._axes(name, axes)
            if name in self.elements and len(found := self._series(self.elements[name], name)):
                return found
        return None

    def alone(self) -> Array | None:
        """The numbers of a file that holds one signal, whatever its elements are called."""
        holding = [each for each in self.root.iter() if any(_name(child) == VALUE for child in each)]
        axes = {tag: each for each in holding if (tag := _name(each)) in AXES}
        if axes:
            return self._axes("signal", axes)
        return self._series(holding[0], _name(holding[0])) if len(holding) == 1 else None

    def _axes(self, name: str, axes: dict[str, ElementTree.Element]) -> Array:
        if len(axes) != len(AXES):
            raise TextureDataError(f"{self.where}: {name} has the axes {', '.join(axes)}; x, y and z are expected")
        found = [self._series(axes[axis], f"{name}.{axis}") for axis in AXES]
        if len({len(each) for each in found}) > 1:
            counts = ", ".join(f"{axis} {len(each)}" for axis, each in zip(AXES, found, strict=True))
            raise TextureDataError(f"{self.where}: {name} is cut short: {counts} samples; as many of each are expected")
        return np.stack(found, axis=1)

    def _series(self, element: ElementTree.Element, name: str) -> Array:
        cells = list(_cells(element))
        try:
            found = np.array(cells, dtype=np.float64)
        except ValueError:
            bad = next(place for place, cell in enumerate(cells) if not _is_number(cell))
            raise TextureDataError(
                f"{self.where}: {name}, sample {bad + 1}, is {cells[bad][:40]!r}; a number is expected"
            ) from None
        odd = np.flatnonzero(~np.isfinite(found))
        if odd.size:
            raise TextureDataError(
                f"{self.where}: {name}, sample {odd[0] + 1}, is {found[odd[0]]}, which is not finite"
            )
        return found


def read_document(file: Path) -> Document:
    """The file's elements. Raises TextureDataError: no such file, too large, no XML, cut short, entities declared."""
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
    for each in root.iter():
        if (name := _name(each)) not in (*AXES, VALUE):
            elements.setdefault(name, each)
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


def _cells(element: ElementTree.Element) -> Iterator[str]:
    values = [child for child in element if _name(child) == VALUE]
    for each in values or [element]:
        yield from (cell for cell in BETWEEN.split(each.text or "") if cell)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
