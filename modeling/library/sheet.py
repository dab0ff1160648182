"""A contact sheet of textures: pictures side by side with names, fit and attributes; equal input, equal bytes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from analysis.figures.style import INK, PAPER, SOFT
from modeling.library.asking import Wish, combined
from modeling.library.drawing import (
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
from modeling.library.entries import KINDS, Entry, Felt, Kind, Library, LibraryError, felt
from modeling.library.lettering import Pen

if TYPE_CHECKING:
    from PIL.Image import Image

KINDS_OF_FILE = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG"}
HEAD, FOOT, MOST = 62, 34, 100


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


def sheet(tiles: Sequence[Tile], pictures: Sequence[bytes | None], title: str, below: str) -> Image:
    """The sheet as an image; a picture that is missing or damaged is a plain field with the texture's name.

    Raises LibraryError for no textures, and for so many that nobody could look at them.
    """
    from PIL import Image, ImageDraw

    if not 0 < len(tiles) <= MOST:
        raise LibraryError(f"a contact sheet shows 1 to {MOST} textures; {len(tiles)} were given: choose with -n.")
    columns = min(5, len(tiles)) if len(tiles) <= 20 else min(8, math.ceil(math.sqrt(len(tiles) * 1.5)))
    high = WIDE + height_of(max(len(each.attributes) for each in tiles)) + GAP
    wide = max(columns, 2) * (WIDE + GAP) + GAP
    whole = Image.new("RGB", (wide * FINE, (HEAD + math.ceil(len(tiles) / columns) * high + FOOT) * FINE), PAPER)
    pen = Pen(ImageDraw.Draw(whole))
    _head(pen, title, below, wide)
    places = [(GAP + k % columns * (WIDE + GAP), HEAD + k // columns * high) for k in range(len(tiles))]
    opened = [_opened(each) for each in pictures]
    for tile, seen, (left, top) in zip(tiles, opened, places, strict=True):
        if seen is None:
            draw_empty(pen, tile.name.split("  ")[0], left, top)
        draw_below(pen, tile, left, top + WIDE)
    _legend(pen, tiles, whole.height / FINE - FOOT / 2)
    small = whole.reduce(FINE)
    for seen, place in zip(opened, places, strict=True):
        if seen is not None:
            small.paste(seen, place)
    return small


def write_sheet(path: Path, drawn: Image) -> None:
    """Write the sheet as PNG or JPEG, by the name's ending. Raises LibraryError for another one."""
    kind = demand_kind(path)
    written = BytesIO()
    drawn.save(written, kind, **({"quality": 82, "optimize": True} if kind == "JPEG" else {"compress_level": 9}))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(written.getvalue())


def demand_kind(path: Path) -> str:
    """The format of a file by its ending. Raises LibraryError for another one than PNG or JPEG."""
    kind = KINDS_OF_FILE.get(path.suffix.lower())
    if kind is None:
        raise LibraryError(f"{path}: a contact sheet is written as .png or .jpg.")
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


def _head(pen: Pen, title: str, below: str, wide: int) -> None:
    room = (wide - 2 * GAP) * FINE
    pen.write((GAP * FINE, 28 * FINE), pen.fitted(title, room, 19 * FINE, bold=True), 19 * FINE, INK, bold=True)
    pen.write((GAP * FINE, 47 * FINE), pen.fitted(below, room, 12 * FINE), 12 * FINE, SOFT)


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
