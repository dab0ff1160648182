"""Common parts of figures of ratings: the axis of the scale with its poles, the axis of levels, attributes in words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from palpate.analysis.figures.columns import read_numbers
from palpate.analysis.figures.lettering import Ends, elide, fold, format_signed, widest_pt
from palpate.analysis.figures.style import FAINT, INK, SOFT, quiet_axes
from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.plans.answers import Row, Selected


BEYOND = 0.2
"""The share of the scale by which an axis may extend beyond its ends, however long a whisker is."""


def round_ends(values: Iterable[float]) -> Ends:
    """Return round ends for values without a declared scale."""
    known = [value for value in values if math.isfinite(value)]
    low, high = (min(known), max(known)) if known else (0.0, 1.0)
    if not low < high:
        return low - 1.0, high + 1.0
    step = 10.0 ** math.floor(math.log10(high - low))
    return math.floor(low / step) * step, math.ceil(high / step) * step


def bar_base(scale: Ends) -> float:
    """Return where bars start: at zero if the scale includes it, else at its nearest end."""
    return min(max(0.0, scale[0]), scale[1])


def quarters(scale: Ends) -> list[float]:
    """Return the ends of a scale, its middle, and the middles of both halves."""
    low, high = scale
    return [low + (high - low) * k / 4 for k in range(5)]


def cut_note(reach: Iterable[float], scale: Ends) -> str:
    """Return the caption's note if a whisker extends beyond the axis, else ""."""
    most = BEYOND * (scale[1] - scale[0])
    cut = sum(not scale[0] - most <= value <= scale[1] + most for value in reach)
    return f" {count(cut, 'whisker')} cut at the edge of the picture; the table has the ends." if cut else ""


def set_scale_axis(axes: Axes, scale: Ends, reach: Iterable[float] = (), line: float | None = None) -> None:
    """Draw the scale as the vertical axis, wider only if something extends beyond it; `line` is drawn across."""
    low, high = scale
    margin, most = 0.025 * (high - low), BEYOND * (high - low)
    known = [min(max(value, low - most), high + most) for value in reach if math.isfinite(value)]
    axes.set_ylim(min([low, *known]) - margin, max([high, *known]) + margin)
    axes.set_yticks(quarters(scale))
    axes.yaxis.set_major_formatter(lambda value, _: format_signed(value, scale))
    if line is not None:
        axes.axhline(line, color=SOFT, linewidth=0.7, zorder=1.5)
    quiet_axes(axes)


class AxisLabels(NamedTuple):
    """The layout of level names along an axis, and the inches that it needs below."""

    names: list[str]
    size: float
    rotation: int
    inches: float


def fit_labels(places: Sequence[float], names: Sequence[str], width_in: float) -> AxisLabels:
    """Return how names fit along an axis of this width: smaller, broken, slanted or upright if they lack room."""
    room = 72.0 * width_in / (max(places) - min(places) + 1.4 if places else 1.0)
    for size in (8.0, 7.5, 7.0, 6.5):
        if widest_pt(names, size) <= room - 2.0:
            return AxisLabels(list(names), size, 0, 0.25)
    folds = [fold(name, max(6, int(room / 4.6))) for name in names]
    if widest_pt(folds, 7.0) <= room - 2.0 and max(name.count("\n") for name in folds) < 4:
        return AxisLabels(folds, 7.0, 0, 0.15 + 0.125 * (1 + max(name.count("\n") for name in folds)))
    size = max(4.5, min(8.0, 0.86 * room))
    rotation = 35 if room > 1.6 * size else 90
    short = [elide(name, 26 if rotation == 35 else 18) for name in names]
    wide = widest_pt(short, size) / 72
    return AxisLabels(short, size, rotation, 0.15 + (0.62 * wide if rotation == 35 else wide))


def set_level_axis(axes: Axes, places: Sequence[float], names: Sequence[str], width_in: float) -> None:
    """Write the levels' names along an axis of this width."""
    labels = fit_labels(places, names, width_in)
    axes.set_xticks(list(places), labels.names)
    axes.set_xlim(min(places, default=0) - 0.7, max(places, default=0) + 0.7)
    axes.tick_params(axis="x", rotation=labels.rotation, labelsize=labels.size)
    if labels.rotation == 35:
        for label in axes.get_xticklabels():
            label.set(ha="right", rotation_mode="anchor")


def write_poles(axes: Axes, attribute: Mapping[str, Any], scale: Ends, size: float = 9.0, room: int = 22) -> None:
    """Write the two words at the ends of the scale that they name; a single word becomes the title."""
    if not attribute["high"]:
        axes.set_title(elide(attribute["name"], 60))
        return
    place = axes.get_yaxis_transform()
    for word, height, side in ((attribute["high"], scale[1], "top"), (attribute["low"], scale[0], "bottom")):
        axes.text(
            1.01,
            height,
            elide(word, room),
            transform=place,
            ha="left",
            va=side,
            fontweight="bold",
            fontsize=size,
            color=INK,
        )


def draw_band(axes: Axes, left: float, right: float, name: str, width_in: float, span: float) -> None:
    """Draw a pale stripe with its name above, for levels of one group."""
    room = 72.0 * width_in * (right - left) / span
    size = 8.5 if widest_pt([name], 8.5) <= room + 12.0 else 7.0
    letters = 60 if widest_pt([name], size) <= room + 12.0 else max(3, int((room + 8.0) / (0.6 * size)))
    axes.axvspan(left, right, color=FAINT, alpha=0.35, linewidth=0, zorder=0)
    axes.text(
        (left + right) / 2,
        1.02,
        elide(name, letters),
        transform=axes.get_xaxis_transform(),
        ha="center",
        va="bottom",
        fontsize=size,
        color=SOFT,
    )


def move_apart(heights: Sequence[float], step: float) -> list[float]:
    """Return the heights moved apart to at least `step` in the same order, around their common mean."""
    order = sorted(range(len(heights)), key=lambda i: (heights[i], i))
    clusters: list[tuple[list[int], float]] = []
    for i in order:
        members, centre = [i], heights[i]
        while clusters and centre - clusters[-1][1] < step * (len(members) + len(clusters[-1][0])) / 2:
            members = clusters.pop()[0] + members
            centre = sum(heights[m] for m in members) / len(members)
        clusters.append((members, centre))
    placed = list(heights)
    for members, centre in clusters:
        for k, member in enumerate(members):
            placed[member] = centre + (k - (len(members) - 1) / 2) * step
    return placed


def attribute_words(selected: Selected) -> list[dict[str, str]]:
    """Return each attribute's name, its words at both ends ("" for a scale with one word) and its category."""
    return [
        {
            "name": name,
            "low": name,
            "high": selected.antonyms.get(name, ""),
            "category": selected.categories.get(name, ""),
        }
        for name in selected.outcomes
    ]


def attribute_title(attribute: Mapping[str, Any], letters: int = 10_000) -> str:
    """Return both words from the low end to the high one, in at most about `letters` letters."""
    if not attribute["high"]:
        return elide(attribute["name"], letters)
    low, high = attribute["low"], attribute["high"]
    half = (letters - 3) // 2
    low = elide(low, max(half, letters - 3 - len(high)))
    return f"{low} → {elide(high, max(half, letters - 3 - len(low)))}"


def scale_ends(selected: Selected) -> list[float]:
    """Return the ends of the declared scale, else round numbers around the values."""
    low, high = selected.scale if selected.scale is not None else round_ends(read_numbers(selected.table, "value"))
    return [float(low), float(high)]


def scale_note(selected: Selected) -> str:
    """Return the caption's note on the scale."""
    return "on the rating scale" if selected.scale is not None else "on the range of the data, which have no scale"


def count_people(rows: Sequence[Row], column: str = "n") -> str:
    """Return a text that says over how many participants the numbers in `column` are."""
    n = sorted({value for row in rows if isinstance(value := row.get(column), int) and value > 0})
    if not n:
        return "no participant"
    return count(n[-1], "participant") if len(n) == 1 else f"{n[0]} to {n[-1]} participants"


def demand_attributes(name: str, selected: Selected) -> None:
    """Raise DataRefused for a figure of ratings whose table has no attribute or no value."""
    for column in ("attribute", "value", "participant"):
        if column not in selected.table.columns:
            raise DataRefused(f"figure {name!r} shows ratings, and its table has no column {column!r}")
    if not selected.outcomes:
        raise DataRefused(f"figure {name!r}: no attribute is left to show; look at `outcomes`")


def by_category(attributes: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Return the attributes of each category, in order."""
    categories: dict[str, list[Mapping[str, Any]]] = {}
    for attribute in attributes:
        categories.setdefault(attribute["category"], []).append(attribute)
    return categories
