"""What a table's header says: the name, the kind and the unit of each column."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.textures.units import PLAIN, known_scale, scale_of_unit

NAMES = (
    (re.compile("t|time|timestamp"), "time", "time"),
    (re.compile("acc|accel|acceleration"), "acceleration", "acceleration"),
    (re.compile("(?:a|acc|accel|acceleration)([xyz])"), "acceleration", "a"),
    (re.compile("speed|velocity|vel"), "speed", "speed"),
    (re.compile("(?:pos|position)?([xyz])"), "position", ""),
    (re.compile("force|normalforce|forcenormal|fn|forcen"), "force", "force"),
    (re.compile("(?:f|force)([xyz])"), "force", "f"),
)
"""How a column may be called, without case, spaces and underscores; what it is; its name, before its axis."""
BRACKETS = re.compile(r"(?P<name>[^\[(]+)[\[(](?P<unit>.*)[\])]\s*")
BETWEEN = re.compile(r"[\s_/]+(?:in\s+)?")
"""What may stand between a name and a unit that has no brackets."""


@dataclass(frozen=True)
class Heading:
    """A column that is known: where it stands, its name and kind, what its numbers are multiplied by, and whether the
    header says its unit."""

    place: int
    name: str
    what: str
    scale: float
    said: bool


def headings(where: str, header: Sequence[str]) -> dict[str, Heading]:
    """The columns that are known, by name. Raises TextureDataError on a name that comes twice and a foreign unit."""
    found: dict[str, Heading] = {}
    for place, text in enumerate(header):
        read = _read(text)
        if read is None:
            continue
        name, what, unit = read
        if name in found:
            raise TextureDataError(f"{where}: the column {name!r} stands there twice")
        scale = scale_of_unit(what, unit or PLAIN[what], f"{where}, column {text.strip()!r}")
        found[name] = Heading(place, name, what, scale, bool(unit))
    return found


def _read(text: str) -> tuple[str, str, str] | None:
    """Name, kind and unit ("" where it says none) of a header's cell; None where it is no column of ours."""
    bracketed = BRACKETS.fullmatch(text)
    if bracketed:
        known = _named(bracketed["name"])
        return (*known, bracketed["unit"].strip()) if known else None
    for cut in BETWEEN.finditer(text):
        known, unit = _named(text[: cut.start()]), text[cut.end() :]
        if known and known_scale(known[1], unit) is not None:
            return *known, unit
    known = _named(text)
    return (*known, "") if known else None


def _named(text: str) -> tuple[str, str] | None:
    """Name and kind of a column."""
    squeezed = re.sub(r"[\s_/]", "", text).lower()
    for pattern, what, name in NAMES:
        match = pattern.fullmatch(squeezed)
        if match:
            return name + "".join(match.groups()), what
    return None
