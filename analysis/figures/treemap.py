"""The relevance of words as a treemap: areas are relevance, kept words are outlined (thesis Figure 5.5)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from pydantic import Field

from palpate.analysis.figures.columns import find_answer, finite_or_nan, to_float
from palpate.analysis.figures.figure_kind import (
    DrawnFigure,
    FigureData,
    FigureInput,
    FigureKind,
    FigureSettings,
    Marks,
    rows_without_effect,
)
from palpate.analysis.figures.lettering import format_percent, line_breaks, width_pt
from palpate.analysis.figures.style import INK, OKABE_ITO, PAPER, SOFT, readable_ink, shade_scale
from palpate.analysis.plans.answers import Row
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused, natural_key
from palpate.protocols.undefined import nan_to_none
from palpate.protocols.wording import count, phrase

INCH = 72.0
FOOT = 24.0
LARGEST, SMALLEST, LEADING = 17.0, 4.6, 1.2
ROUNDING = 1e-12


class TreemapSettings(FigureSettings):
    """The settings of a treemap of the words of one `relevance` test.

    `words` selects all words or only the kept ones. `threshold` (a share) is named in caption and foot; it must be the
    test's. `width_in` and `height_in` are the picture's size.
    """

    figure: Literal["treemap"]
    words: Literal["all", "kept"] = "all"
    threshold: float | None = Field(default=None, ge=0, le=1)
    width_in: float = Field(default=9.6, ge=3, le=30)
    height_in: float = Field(default=6.2, ge=2, le=30)

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from rows_without_effect("in a treemap, which shows the answer of its test as it is")


def data(inputs: FigureInput, settings: TreemapSettings) -> FigureData:
    """Return the words by relevance, most relevant first, equal ones by name. Raises DataRefused if none was chosen."""
    answer = find_answer(settings, inputs, ("word", "relevance", "kept"), "relevance")
    rows: list[dict[str, Any]] = []
    for row in answer.rows:
        where, kept = f"figure {settings.name!r}, word {row['word']!r}", bool(row["kept"])
        share = finite_or_nan(row["relevance"], where)
        if not (math.isnan(share) or 0 <= share <= 1):
            raise DataRefused(f"{where}: a relevance of {share:g}; a share between 0 and 1 is expected")
        threshold = settings.threshold
        if threshold is not None and not math.isnan(share) and kept != (share >= threshold - ROUNDING):
            raise DataRefused(
                f"{where}: relevance {share:g}, {'kept' if kept else 'not kept'}: the test's threshold is not"
                f" {threshold:g}"
            )
        columns: dict[str, Any] = {"word": str(row["word"]), "relevance": nan_to_none(share)}
        for end in ("low", "high"):
            columns[end] = nan_to_none(finite_or_nan(row.get(end, row.get(f"ci_{end}")), where))
        if kept or settings.words == "all":
            rows.append(columns | {"kept": kept} | {name: row[name] for name in ("ticks", "n") if name in row})
    ranked = sorted(rows, key=lambda row: (-_size(row), natural_key(str(row["word"]))))
    if not any(_size(row) > 0 for row in ranked):
        raise DataRefused(f"figure {settings.name!r}: no word has a relevance above 0; there is no box to draw")
    numbered: list[Row] = [{"rank": i, **row} for i, row in enumerate(ranked, 1)]
    least = ""
    if settings.threshold is not None:
        least = f"at least {format_percent(settings.threshold, 1).replace('.0', '')}"
    outlined, outline = sum(bool(row["kept"]) for row in ranked), least or "kept"
    outline = outline if outlined else f"none ({outline})"
    boxless = sum(_size(row) == 0 for row in ranked)
    foot = f"Outlined: {outline}." + (f"  No box: {count(boxless, 'word')} at 0 %." if boxless else "")
    words = {"width_in": settings.width_in, "height_in": settings.height_in, "foot": foot}
    title = settings.title or "Relevance of the words"
    reading = "Boxes are as large as a word's relevance and stand in its order; outlined are the words that are kept"
    reading += f" ({least})" if least else ""
    irrelevant = [str(row["word"]) for row in ranked if row["relevance"] == 0]
    undefined = [str(row["word"]) for row in ranked if row["relevance"] is None]
    reasons = [(irrelevant, "relevance 0"), (undefined, "undefined relevance")]
    without = "".join(f" Without a box, at {why}: {phrase(names)}." for names, why in reasons if names)
    caption = f"{reading}, {outlined} of {len(ranked)}. {answer.method}{without}"
    return FigureData(tuple(numbered), title, caption, words)


def _size(row: Row) -> float:
    return float(row["relevance"] or 0.0)


def draw(data: FigureData) -> DrawnFigure:
    """Draw the boxes, largest first from the upper left corner; words that are too long appear on pointing."""
    words, marks = data.words, Marks()
    width, height = float(words["width_in"]) * INCH, float(words["height_in"]) * INCH
    figure = Figure(figsize=(width / INCH, height / INCH))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set(xlim=(0, width), ylim=(height, 0))
    rows = [row for row in data.rows if _size(row) > 0]
    boxes = squarify([_size(row) for row in rows], width - 8, height - FOOT - 4)
    colour, top = shade_scale(), _size(rows[0])
    for row, place in zip(rows, boxes, strict=True):
        fill = colour(0.06 + 0.46 * _size(row) / top) if row["kept"] else "#eceff2"
        box = Box(place.left + 4, place.top + 4, place.width, place.height)
        corner, sides = (box.left + 0.8, box.top + 0.8), (max(box.width - 1.6, 0.3), max(box.height - 1.6, 0.3))
        patch = Rectangle(corner, *sides, facecolor=fill, edgecolor=PAPER, linewidth=0)
        axes.add_patch(patch)
        marks.add(patch, details(row), str(row["word"]))
        if row["kept"]:
            edge = min(1.8, box.width / 4, box.height / 4)
            inset = (corner[0] + edge / 2, corner[1] + edge / 2)
            sides = (sides[0] - edge, sides[1] - edge)
            axes.add_patch(Rectangle(inset, *sides, fill=False, edgecolor=OKABE_ITO[1], linewidth=edge))
        ink = readable_ink(fill) if row["kept"] else INK
        # The word as large as its box lets it be, with its per cent where there is room.
        word, share = str(row["word"]), format_percent(_size(row))
        fitted = max((_fit_lines(lines, share, box) for lines in line_breaks(word, 3)), default=(0.0, "", False))
        size, text, with_share = fitted
        if size < SMALLEST:
            continue
        x, y = box.left + box.width / 2, box.top + box.height / 2
        up = 0.36 * size * LEADING if with_share else 0.0
        axes.text(x, y - up, text, fontsize=size, color=ink, ha="center", va="center", linespacing=LEADING)
        if with_share:
            down = ((text.count("\n") + 1) / 2) * size * LEADING
            axes.text(x, y + down, share, fontsize=0.72 * size, color=ink, ha="center", va="center")
    axes.text(6, height - FOOT / 2 + 1, str(words["foot"]), fontsize=8, color=SOFT, va="center")
    return DrawnFigure(figure, marks.all())


def details(row: Row) -> tuple[tuple[str, str], ...]:
    """Return the names and values of a word's mark: relevance, interval, reference, and whether it is kept."""
    parts = [("word", str(row["word"])), ("relevance", format_percent(_size(row), 1))]
    if row.get("low") is not None and row.get("high") is not None:
        parts.append(
            ("interval", f"{format_percent(to_float(row['low']), 1)} to {format_percent(to_float(row['high']), 1)}")
        )
    parts += [(name, str(row[name])) for name in ("ticks", "n") if row.get(name) is not None]
    return (*parts, ("kept", "yes" if row["kept"] else "no"))


def _fit_lines(lines: tuple[str, ...], share: str, box: Box) -> tuple[float, str, bool]:
    """Return the largest size at which these lines fit the box, with the percentage below them if possible."""
    wide = max(width_pt(line, 10.0) for line in (*lines, "")) / 10 or 1.0
    room_x, room_y = box.width - 11, box.height - 8
    cap = min(LARGEST, 0.19 * math.sqrt(box.width * box.height))
    with_share = min(cap, room_x / max(wide, 0.072 * width_pt(share, 10.0)), room_y / (LEADING * (len(lines) + 0.8)))
    if with_share >= SMALLEST + 0.6:
        return with_share, "\n".join(lines), True
    return min(cap, room_x / wide, room_y / (LEADING * len(lines))), "\n".join(lines), False


TREEMAP = FigureKind(TreemapSettings, data, draw, takes="words")


@dataclass(frozen=True)
class Box:
    """A rectangle by its upper left corner, its width and its height; `top` grows downwards."""

    left: float
    top: float
    width: float
    height: float


def squarify(sizes: Sequence[float], width: float, height: float) -> tuple[Box, ...]:
    """Return a box for each size in the given order, with area in proportion; largest first gives the squarest boxes.

    Raises ValueError for a size that is not above 0.
    """
    if not all(0 < size < float("inf") for size in sizes):
        raise ValueError("a treemap has boxes only for sizes above 0")
    largest = max(sizes, default=1.0)
    total = sum(size / largest for size in sizes)
    areas = [size / largest / total * width * height for size in sizes]
    boxes: list[Box] = []
    free, start = Box(0.0, 0.0, width, height), 0
    while start < len(areas):
        # A row along the shorter side of what is free: as many boxes as bring its worst one nearest to a square.
        side = min(free.width, free.height)
        end, worst = start + 1, _worst_ratio(areas[start : start + 1], side)
        while end < len(areas) and (longer := _worst_ratio(areas[start : end + 1], side)) <= worst:
            end, worst = end + 1, longer
        upright = free.width >= free.height
        depth, along = sum(areas[start:end]) / side if side > 0 else 0.0, 0.0
        for area in areas[start:end]:
            length = area / depth if depth > 0 else 0.0
            if upright:
                boxes.append(Box(free.left, free.top + along, depth, length))
            else:
                boxes.append(Box(free.left + along, free.top, length, depth))
            along += length
        if upright:
            free = Box(free.left + depth, free.top, max(free.width - depth, 0.0), free.height)
        else:
            free = Box(free.left, free.top + depth, free.width, max(free.height - depth, 0.0))
        start = end
    return tuple(boxes)


def _worst_ratio(areas: Sequence[float], side: float) -> float:
    """Return the largest ratio of sides in a row of these areas along `side`."""
    if side <= 0:
        return float("inf")
    depth = sum(areas) / side
    return max(max(depth * depth / area, area / (depth * depth)) for area in areas)
