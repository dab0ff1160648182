"""A contact sheet of textures: pictures with names, fit and attributes; equal input gives equal bytes.

The font is matplotlib's own, so that it is the same on every machine."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.analysis.figures.style import FAINT, INK, PAPER, SOFT
from palpate.modeling.library.entries import KINDS, Z90, AttributeValue, Entry, Kind, Library, LibraryError, value_of
from palpate.modeling.library.files import demand_folder, write_whole
from palpate.modeling.library.wishes import Wish, combined

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont


FACES = {False: "DejaVuSans.ttf", True: "DejaVuSans-Bold.ttf"}
MORE = "…"
KINDS_OF_FILE = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG"}
HEAD, FOOT, MOST = 62, 34, 100
NEXT = 17
"""The height in pixels of each further line below the title."""
BESIDE = "   "
WIDE, GAP = 288, 22
"""The width in pixels of a tile, and of the gap between two."""
FINE = 3
"""The factor by which all but the pictures is drawn larger and then reduced, for smooth lines."""
NAME, LINE, ROW = 46, 8, 19
"""Heights in pixels: the name with its class, the bar of the fit, a row of an attribute."""
TRACK = (78, 210)
"""The ends of an attribute's scale, in pixels from the tile's left edge."""
WISHED, DOT, PREDICTED = "#bfe3d5", "#0072B2", "#D55E00"


@dataclass
class Pen:
    """A drawing with its fonts; positions and sizes are in pixels."""

    draw: ImageDraw
    opened: dict[tuple[int, bool], FreeTypeFont] = field(default_factory=dict)

    def font(self, size: int, bold: bool = False) -> FreeTypeFont:
        """Return the font in a size, loaded once."""
        import matplotlib
        from PIL import ImageFont

        if (size, bold) not in self.opened:
            face = str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / FACES[bold])
            self.opened[size, bold] = ImageFont.truetype(face, size, layout_engine=ImageFont.Layout.BASIC)
        return self.opened[size, bold]

    def width(self, text: str, size: int, bold: bool = False) -> float:
        """Return the width of a text in pixels."""
        return float(self.font(size, bold).getlength(text))

    def fitted(self, text: str, room: float, size: int, bold: bool = False) -> str:
        """Return the text, shortened with an ellipsis where it is wider than `room`."""
        if self.width(text, size, bold) <= room:
            return text
        most = bisect_right(range(len(text)), room, key=lambda end: self.width(text[:end] + MORE, size, bold))
        return text[: max(0, most - 1)].rstrip() + MORE

    def write(
        self, place: tuple[float, float], text: str, size: int, colour: str, *, bold: bool = False, anchor: str = "ls"
    ) -> None:
        """Write a line of text; `anchor` as Pillow names it (ls: left, on the baseline)."""
        self.draw.text(place, text, fill=colour, font=self.font(size, bold), anchor=anchor)


def tiles_of(
    entries: Sequence[Entry], library: Library, wishes: Sequence[Wish] = (), kind: Kind | None = None,
    beside: Mapping[str, tuple[str, float | None]] | None = None,
) -> list[Tile]:  # fmt: skip
    """Return a tile for each texture; `beside` holds, by texture, a text beside its name and its fit (0 to 1)."""
    wished = {pair: soft.half_fit for pair, soft in combined(wishes)}
    result = []
    for entry in entries:
        text, fit = (beside or {}).get(entry.id, ("", None))
        values = [(words, value_of(entry, at, kind), wished.get(at)) for at, words in enumerate(library.attributes)]
        name = entry.id if entry.label in ("", entry.id) else f"{entry.id}  {entry.label}"
        result.append(Tile(name, entry.category, text, fit, values))
    return result


def sheet(
    tiles: Sequence[Tile], pictures: Sequence[bytes | None], title: str, below: Sequence[str] = (), foot: str = ""
) -> Image:
    """Return the sheet as an image; a missing or damaged picture becomes a plain field with the texture's name.

    `below` are texts below the title, wrapped onto lines; `foot` is a text beside the legend.

    Raises LibraryError for no textures and for more than `MOST`.
    """
    from PIL import Image, ImageDraw

    if not 0 < len(tiles) <= MOST:
        raise LibraryError(
            f"a contact sheet shows 1 to {MOST} textures; {len(tiles)} were given: choose with -n or --class."
        )
    columns = min(5, len(tiles)) if len(tiles) <= 20 else min(8, math.ceil(math.sqrt(len(tiles) * 1.5)))
    high = WIDE + height_of(max(len(tile.attributes) for tile in tiles)) + GAP
    wide = max(columns, 2) * (WIDE + GAP) + GAP
    lines = _lines(Pen(ImageDraw.Draw(Image.new("RGB", (1, 1)))), below, (wide - 2 * GAP) * FINE)
    head = HEAD + NEXT * max(0, len(lines) - 1)
    whole = Image.new("RGB", (wide * FINE, (head + math.ceil(len(tiles) / columns) * high + FOOT) * FINE), PAPER)
    pen = Pen(ImageDraw.Draw(whole))
    room = (wide - 2 * GAP) * FINE
    pen.write((GAP * FINE, 28 * FINE), pen.fitted(title, room, 19 * FINE, bold=True), 19 * FINE, INK, bold=True)
    for at, line in enumerate(lines):
        pen.write((GAP * FINE, (47 + NEXT * at) * FINE), pen.fitted(line, room, 12 * FINE), 12 * FINE, SOFT)
    places = [(GAP + k % columns * (WIDE + GAP), head + k // columns * high) for k in range(len(tiles))]
    images = [_open_picture(picture) for picture in pictures]
    for tile, image, (left, top) in zip(tiles, images, places, strict=True):
        if image is None:
            draw_empty(pen, tile.name.split("  ")[0], left, top)
        draw_below(pen, tile, left, top + WIDE)
    middle = whole.height / FINE - FOOT / 2
    _legend(pen, tiles, middle)
    pen.write(((wide - GAP) * FINE, middle * FINE), foot, 11 * FINE, SOFT, anchor="rm")
    small = whole.reduce(FINE)
    for image, place in zip(images, places, strict=True):
        if image is not None:
            small.paste(image, place)
    return small


def write_sheet(path: Path, drawn: Image) -> None:
    """Write the sheet as PNG or JPEG, atomically. Raises LibraryError as `demand_writable` does."""
    kind = demand_writable(path)
    content = BytesIO()
    drawn.save(content, kind, **({"quality": 82, "optimize": True} if kind == "JPEG" else {"compress_level": 9}))
    write_whole(path, content.getvalue())


def demand_writable(path: Path) -> str:
    """Return the format for a file's ending. Raises LibraryError unless it is PNG or JPEG in a writable folder."""
    kind = KINDS_OF_FILE.get(path.suffix.lower())
    if kind is None:
        raise LibraryError(f"{path}: a contact sheet is written as .png or .jpg.")
    demand_folder(path)
    return kind


def pictures_of(entries: Sequence[Entry], folder: Path) -> list[bytes | None]:
    """Return the thumbnails beside the index as bytes; None where there is none."""
    result = []
    for entry in entries:
        path = None if entry.picture is None else folder / entry.picture
        inside = path is not None and path.resolve().is_relative_to(folder.resolve()) and path.is_file()
        result.append(path.read_bytes() if path is not None and inside else None)
    return result


def _open_picture(content: bytes | None) -> Image | None:
    """Return a picture in a tile's size; None where there is none or it is damaged."""
    from PIL import Image

    if content is None:
        return None
    try:
        with Image.open(BytesIO(content)) as opened:
            image: Image.Image = opened.convert("RGB").resize((WIDE, WIDE), Image.Resampling.LANCZOS)
            return image
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None


def _lines(pen: Pen, parts: Sequence[str], room: float) -> list[str]:
    """Return the parts joined into lines no wider than `room`, where a part fits at all."""
    lines: list[str] = []
    for part in parts:
        together = BESIDE.join((*lines[-1:], part))
        if lines and pen.width(together, 12 * FINE) <= room:
            lines[-1] = together
        else:
            lines.append(part)
    return lines


def _legend(pen: Pen, tiles: Sequence[Tile], middle: float) -> None:
    """Draw the legend of the marks that the tiles have."""
    kinds = {estimate.kind for tile in tiles for _, estimate, _ in tile.attributes if estimate is not None}
    words = {"rated": "rated: mean", "predicted": "predicted"}
    left = float(GAP)
    for kind in KINDS:
        if kind in kinds:
            mark_value(pen.draw, AttributeValue(value=50, sd=20, kind=kind), middle, (left, left + 34))
            left = _write_label(pen, f"{words[kind]}, with 90 %", left + 42, middle)
    if any(wished is not None for tile in tiles for _, _, wished in tile.attributes):
        box = (left * FINE, (middle - 6) * FINE, (left + 30) * FINE, (middle + 6) * FINE)
        pen.draw.rectangle(box, fill=WISHED)
        _write_label(pen, "wished for", left + 38, middle)


def _write_label(pen: Pen, text: str, left: float, middle: float) -> float:
    """Write an entry of the legend at `left`, `middle` (pixels); return where the next one begins."""
    pen.write((left * FINE, middle * FINE), text, 11 * FINE, SOFT, anchor="lm")
    return left + pen.width(text, 11 * FINE) / FINE + 26


@dataclass(frozen=True)
class Tile:
    """A texture on the sheet. `fit` is the filled share of the bar, 0 to 1; None for no bar."""

    name: str
    below: str
    beside: str
    fit: float | None
    attributes: Sequence[tuple[tuple[str, str], AttributeValue | None, tuple[float, float] | None]]
    """For each attribute both words, the value, and the range that the wishes ask for."""


def height_of(attributes: int) -> int:
    """Return the height in pixels of what is drawn below a tile's picture."""
    return NAME + LINE + 6 + ROW * attributes + 4


def draw_below(pen: Pen, tile: Tile, left: float, top: float) -> None:
    """Draw all below the picture; `left` and `top` in pixels of the reduced sheet."""
    room = WIDE - pen.width(tile.beside, 13 * FINE, bold=True) / FINE - 10
    name = pen.fitted(tile.name, room * FINE, 14 * FINE, bold=True)
    pen.write((left * FINE, (top + 19) * FINE), name, 14 * FINE, INK, bold=True)
    beside = ((left + WIDE) * FINE, (top + 19) * FINE)
    pen.write(beside, tile.beside, 13 * FINE, INK, bold=True, anchor="rs")
    below = pen.fitted(tile.below, WIDE * FINE, 11 * FINE)
    pen.write((left * FINE, (top + 36) * FINE), below, 11 * FINE, SOFT)
    if tile.fit is not None:
        _bar(pen.draw, left, top + NAME, WIDE, 4, FAINT)
        _bar(pen.draw, left, top + NAME, WIDE * tile.fit, 4, INK)
    for place, (words, estimate, wished) in enumerate(tile.attributes):
        _attribute(pen, words, estimate, wished, left, top + NAME + LINE + 6 + ROW * place)


def draw_empty(pen: Pen, name: str, left: float, top: float) -> None:
    """Draw a plain field with the texture's name in place of a missing picture."""
    box = (left * FINE, top * FINE, (left + WIDE) * FINE - 1, (top + WIDE) * FINE - 1)
    pen.draw.rectangle(box, fill="#f0f2f4", outline=FAINT, width=FINE)
    middle = (left + WIDE / 2) * FINE
    shown = pen.fitted(name, (WIDE - 40) * FINE, 30 * FINE, bold=True)
    pen.write((middle, (top + WIDE / 2) * FINE), shown, 30 * FINE, SOFT, bold=True, anchor="ms")
    pen.write((middle, (top + WIDE / 2 + 26) * FINE), "no picture", 12 * FINE, SOFT, anchor="ms")


def _attribute(
    pen: Pen,
    words: tuple[str, str],
    estimate: AttributeValue | None,
    wished: tuple[float, float] | None,
    left: float,
    top: float,
) -> None:
    """Draw both words, the scale between them, the range of the wishes, and the value with its 90 % interval."""
    start, end = (left + place for place in TRACK)
    middle, size = top + ROW / 2, 11 * FINE
    for word, place, anchor in ((words[0], start - 8, "rm"), (words[1], end + 8, "lm")):
        shown = pen.fitted(word, (TRACK[0] - 8) * FINE, size)
        pen.write((place * FINE, middle * FINE), shown, size, INK, anchor=anchor)
    if wished is not None:
        low, high = (_at(end_value, start, end) for end_value in wished)
        _bar(pen.draw, low, middle - 6, high - low, 12, WISHED)
    _bar(pen.draw, start, middle - 0.5, end - start, 1, SOFT)
    _bar(pen.draw, (start + end) / 2 - 0.5, middle - 3, 1, 6, SOFT)
    if estimate is not None:
        mark_value(pen.draw, estimate, middle, (start, end))


def mark_value(draw: ImageDraw, estimate: AttributeValue, middle: float, track: tuple[float, float]) -> None:
    """Draw a value, a disc where people rated and a ring where a model predicted, with a bar for its 90 % interval."""
    colour = DOT if estimate.kind == "rated" else PREDICTED
    low, high, at = (_at(estimate.value + way * Z90 * estimate.sd, *track) for way in (-1, 1, 0))
    _bar(draw, low, middle - 1, high - low, 2, colour)
    box = ((at - 4) * FINE, (middle - 4) * FINE, (at + 4) * FINE, (middle + 4) * FINE)
    draw.ellipse(box, fill=colour if estimate.kind == "rated" else PAPER, outline=colour, width=2 * FINE - 1)


def _at(value: float, start: float, end: float) -> float:
    return start + (end - start) * min(100.0, max(0.0, value)) / 100


def _bar(draw: ImageDraw, left: float, top: float, wide: float, high: float, colour: str) -> None:
    if wide > 0:
        box = (left * FINE, top * FINE, max(left * FINE, (left + wide) * FINE - 1), (top + high) * FINE - 1)
        draw.rectangle(box, fill=colour)
