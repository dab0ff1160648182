"""A contact sheet of textures: pictures side by side with names, fit and attributes; equal input, equal bytes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.analysis.figures.style import INK, PAPER, SOFT
from palpate.modeling.library.asking import Wish, combined
from palpate.modeling.library.drawing import (
    FINE,
    GAP,
    WIDE,
    WISHED,
    Tile,
    draw_below,
    draw_empty,
    height_of,
    mark_value,
)
from palpate.modeling.library.entries import KINDS, Entry, Felt, Kind, Library, LibraryError, felt
from palpate.modeling.library.lettering import Pen
from palpate.modeling.library.writing import demand_folder, write_whole

if TYPE_CHECKING:
    from PIL.Image import Image

KINDS_OF_FILE = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG"}
HEAD, FOOT, MOST = 62, 34, 100
NEXT = 17
"""Pixels of height of each further line below the title."""
BESIDE = "   "


def tiles_of(
    entries: Sequence[Entry], library: Library, wishes: Sequence[Wish] = (), kind: Kind | None = None,
    beside: Mapping[str, tuple[str, float | None]] | None = None,
) -> list[Tile]:  # fmt: skip
    """What is drawn of each texture; `beside` holds, by texture, what stands beside its name, and its fit."""
    wished = {pair: soft.met for pair, soft in combined(wishes)}
    found = []
    for entry in entries:
        text, fit = (beside or {}).get(entry.id, ("", None))
        values = [(words, felt(entry, at, kind), wished.get(at)) for at, words in enumerate(library.attributes)]
        name = entry.id if entry.label in ("", entry.id) else f"{entry.id}  {entry.label}"
        found.append(Tile(name, entry.category, text, fit, values))
    return found


def sheet(
    tiles: Sequence[Tile], pictures: Sequence[bytes | None], title: str, below: Sequence[str] = (), foot: str = ""
) -> Image:
    """The sheet as an image; a picture that is missing or damaged is a plain field with the texture's name.

    `below` stands below the title, in as many lines as it takes; `foot` beside the legend.

    Raises LibraryError for no textures, and for so many that nobody could look at them.
    """
    from PIL import Image, ImageDraw

    if not 0 < len(tiles) <= MOST:
        raise LibraryError(
            f"a contact sheet shows 1 to {MOST} textures; {len(tiles)} were given: choose with -n or --class."
        )
    columns = min(5, len(tiles)) if len(tiles) <= 20 else min(8, math.ceil(math.sqrt(len(tiles) * 1.5)))
    high = WIDE + height_of(max(len(each.attributes) for each in tiles)) + GAP
    wide = max(columns, 2) * (WIDE + GAP) + GAP
    lines = _lines(Pen(ImageDraw.Draw(Image.new("RGB", (1, 1)))), below, (wide - 2 * GAP) * FINE)
    head = HEAD + NEXT * max(0, len(lines) - 1)
    whole = Image.new("RGB", (wide * FINE, (head + math.ceil(len(tiles) / columns) * high + FOOT) * FINE), PAPER)
    pen = Pen(ImageDraw.Draw(whole))
    _head(pen, title, lines, wide)
    places = [(GAP + k % columns * (WIDE + GAP), head + k // columns * high) for k in range(len(tiles))]
    opened = [_opened(each) for each in pictures]
    for tile, seen, (left, top) in zip(tiles, opened, places, strict=True):
        if seen is None:
            draw_empty(pen, tile.name.split("  ")[0], left, top)
        draw_below(pen, tile, left, top + WIDE)
    middle = whole.height / FINE - FOOT / 2
    _legend(pen, tiles, middle)
    pen.write(((wide - GAP) * FINE, middle * FINE), foot, 11 * FINE, SOFT, anchor="rm")
    small = whole.reduce(FINE)
    for seen, place in zip(opened, places, strict=True):
        if seen is not None:
            small.paste(seen, place)
    return small


def write_sheet(path: Path, drawn: Image) -> None:
    """Write the sheet as PNG or JPEG, whole or not at all. Raises LibraryError as `demand_writable` does."""
    kind = demand_writable(path)
    written = BytesIO()
    drawn.save(written, kind, **({"quality": 82, "optimize": True} if kind == "JPEG" else {"compress_level": 9}))
    write_whole(path, written.getvalue())


def demand_writable(path: Path) -> str:
    """The format of a file by its ending. Raises LibraryError for another one than PNG or JPEG, and for no folder."""
    kind = KINDS_OF_FILE.get(path.suffix.lower())
    if kind is None:
        raise LibraryError(f"{path}: a contact sheet is written as .png or .jpg.")
    demand_folder(path)
    return kind


def pictures_of(entries: Sequence[Entry], folder: Path) -> list[bytes | None]:
    """The thumbnails that lie beside the index; None where there is none."""
    found = []
    for each in entries:
        path = None if each.picture is None else folder / each.picture
        inside = path is not None and path.resolve().is_relative_to(folder.resolve()) and path.is_file()
        found.append(path.read_bytes() if path is not None and inside else None)
    return found


def _opened(content: bytes | None) -> Image | None:
    from PIL import Image

    if content is None:
        return None
    try:
        with Image.open(BytesIO(content)) as opened:
            seen: Image.Image = opened.convert("RGB").resize((WIDE, WIDE), Image.Resampling.LANCZOS)
            return seen
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None


def _head(pen: Pen, title: str, lines: Sequence[str], wide: int) -> None:
    room = (wide - 2 * GAP) * FINE
    pen.write((GAP * FINE, 28 * FINE), pen.fitted(title, room, 19 * FINE, bold=True), 19 * FINE, INK, bold=True)
    for at, line in enumerate(lines):
        pen.write((GAP * FINE, (47 + NEXT * at) * FINE), pen.fitted(line, room, 12 * FINE), 12 * FINE, SOFT)


def _lines(pen: Pen, parts: Sequence[str], room: float) -> list[str]:
    """The parts beside each other, on a further line where there is no room: none is lost."""
    lines: list[str] = []
    for part in parts:
        together = BESIDE.join((*lines[-1:], part))
        if lines and pen.width(together, 12 * FINE) <= room:
            lines[-1] = together
        else:
            lines.append(part)
    return lines


def _legend(pen: Pen, tiles: Sequence[Tile], middle: float) -> None:
    """What the marks mean; only those that are there."""
    kinds = {found.kind for tile in tiles for _, found, _ in tile.attributes if found is not None}
    words = {"rated": "rated: mean", "predicted": "predicted"}
    left = float(GAP)
    for kind in KINDS:
        if kind in kinds:
            mark_value(pen.draw, Felt(value=50, sd=20, kind=kind), middle, (left, left + 34))
            left = _said(pen, f"{words[kind]}, with 90 %", left + 42, middle)
    if any(wished is not None for tile in tiles for _, _, wished in tile.attributes):
        box = (left * FINE, (middle - 6) * FINE, (left + 30) * FINE, (middle + 6) * FINE)
        pen.draw.rectangle(box, fill=WISHED)
        _said(pen, "wished for", left + 38, middle)


def _said(pen: Pen, text: str, left: float, middle: float) -> float:
    """A word of the legend; where the next one begins."""
    pen.write((left * FINE, middle * FINE), text, 11 * FINE, SOFT, anchor="lm")
    return left + pen.width(text, 11 * FINE) / FINE + 26
