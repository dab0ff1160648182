"""The two figures of a rating study: the means of every level (thesis Figure 5.9) and their trends (5.10)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from analysis.figures.style import FAINT, INK, OKABE_ITO, SOFT, quiet_axes
from analysis.reporting.figure_data import Picture, RatedAttribute, reference_level

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine


def means_figure(picture: Picture) -> Figure:
    """Figure 5.9: for each attribute the mean of every level as a bar, its SD over participants as a whisker.

    One panel for each attribute, all on the study's scale, the two poles written at its ends.
    """
    import numpy as np
    from matplotlib.figure import Figure

    grid = _grid(picture)
    key_row = len({len(column) for column in grid}) == 1
    rows = max(map(len, grid))
    heights = [1.0] * rows + [0.3 + 0.09 * len(picture.families())] * key_row
    figure = Figure(figsize=(5.8 * max(len(grid), 1.25), 1.95 * sum(heights) + 0.35), layout=_layout())
    axes = figure.subplots(len(heights), len(grid), squeeze=False, height_ratios=heights)
    for (i, j), panel in np.ndenumerate(axes):
        if i < len(grid[j]):
            _means_panel(panel, picture, grid[j][i])
        else:
            panel.set_axis_off()
    for column, first in zip(grid, axes[0], strict=True):
        if len({attribute.category for attribute in column}) == 1 and column[0].category:
            first.set_title(f"{column[0].category} attributes".capitalize())
    _key(axes[-1][0] if key_row or len(grid[0]) < rows else axes[-1][-1], picture)
    return figure


def _layout() -> ConstrainedLayoutEngine:
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return ConstrainedLayoutEngine(h_pad=0.06, w_pad=0.08, hspace=0.05, wspace=0.02)


def trends_figure(picture: Picture) -> Figure:
    """Figure 5.10: one line for each attribute within each family, a panel for each category of attributes.

    The reference level, where there is one, is the ring at the left and the dotted line across.
    """
    from matplotlib.figure import Figure

    categories = _by_category(picture)
    figure = Figure(figsize=(10.2, 4.0 * len(categories) + 0.2), layout="constrained")
    panels = figure.subplots(len(categories), 1, squeeze=False)[:, 0]
    for panel, (category, attributes) in zip(panels, categories.items(), strict=True):
        _trend_panel(panel, picture, attributes)
        panel.set_title(_heading(category, attributes), pad=22)
        if any(attribute.high for attribute in attributes):
            low, high = (_number(end, picture.scale) for end in picture.scale)
            panel.set_ylabel(f"mean rating ({low}: first word, {high}: second)", color=SOFT, fontsize=8.0)
    return figure


def _heading(category: str, attributes: list[RatedAttribute]) -> str:
    if category:
        return f"{category} attributes".capitalize()
    return attributes[0].title if len(attributes) == 1 else "All attributes"


def _by_category(picture: Picture) -> dict[str, list[RatedAttribute]]:
    found: dict[str, list[RatedAttribute]] = {}
    for attribute in picture.attributes:
        found.setdefault(attribute.category, []).append(attribute)
    return found


def _grid(picture: Picture) -> list[list[RatedAttribute]]:
    """Two columns: the categories where there are two of about equal length, else simply the halves."""
    columns = list(_by_category(picture).values())
    if len(columns) == 2 and abs(len(columns[0]) - len(columns[1])) <= 2:
        return columns
    if len(picture.attributes) == 1:
        return [list(picture.attributes)]
    half = (len(picture.attributes) + 1) // 2
    return [list(picture.attributes[:half]), list(picture.attributes[half:])]


def _positions(picture: Picture, gap: float = 0.6) -> dict[str, float]:
    """Where each level stands: one apart, with a gap between families."""
    places: dict[str, float] = {}
    for i, (_, levels) in enumerate(picture.families()):
        places |= {level: len(places) + j + i * gap for j, level in enumerate(levels)}
    return places


def _scale_axis(axes: Axes, picture: Picture) -> None:
    """The study's scale with its middle drawn; wider only where a whisker reaches beyond it."""
    low, high = picture.scale
    middle, margin = (low + high) / 2, 0.02 * (high - low)
    reach = [dot.mean + sign * (dot.sd or 0.0) for dot in picture.dots.values() for sign in (-1, 1)]
    axes.set_ylim(min([low, *reach]) - margin, max([high, *reach]) + margin)
    axes.set_yticks([low, (low + middle) / 2, middle, (middle + high) / 2, high])
    axes.yaxis.set_major_formatter(lambda value, _: _number(value, picture.scale))
    axes.axhline(_base(picture), color=SOFT, linewidth=0.7, zorder=1.5)
    quiet_axes(axes)


def _number(value: float, scale: tuple[float, float]) -> str:
    """With its sign where the scale has both, and a true minus."""
    sign = "+" if scale[0] < 0 < scale[1] and value else ""
    return f"{value:{sign}g}".replace("-", "−")


def _base(picture: Picture) -> float:
    """Where bars start: zero where the scale has it, else its nearest end."""
    return min(max(0.0, picture.scale[0]), picture.scale[1])


def _level_axis(axes: Axes, picture: Picture, places: Mapping[str, float], room: int) -> None:
    """The levels' names, slanted where they have more letters than there is room for."""
    axes.set_xticks(list(places.values()), [picture.written(level) for level in places])
    axes.set_xlim(-0.7, max(places.values()) + 0.7)
    many = len(places) > 24
    slanted = sum(len(picture.written(level)) for level in places) > room
    size = max(3.5, 8.0 * 24 / len(places)) if many else 7.5 if slanted else 8.0
    axes.tick_params(axis="x", rotation=90 if many else 30 if slanted else 0, labelsize=size)


def _means_panel(axes: Axes, picture: Picture, attribute: RatedAttribute) -> None:
    places, colours, base = _positions(picture), picture.colours(), _base(picture)
    _scale_axis(axes, picture)
    dots = {level: picture.dots[attribute.name, level] for level in places if (attribute.name, level) in picture.dots}
    heights = [dot.mean - base for dot in dots.values()]
    filled = [colours[picture.family_of[level]] for level in dots]
    at = [places[level] for level in dots]
    axes.bar(at, heights, 0.74, bottom=base, color=filled, alpha=0.85, linewidth=0, zorder=2)
    known = [(places[level], dot.mean, dot.sd) for level, dot in dots.items() if dot.sd is not None]
    if known:
        x, mean, sd = zip(*known, strict=True)
        axes.errorbar(x, mean, sd, fmt="none", ecolor=INK, elinewidth=0.9, capsize=2.2, zorder=3)
    _level_axis(axes, picture, places, 60 if len(picture.attributes) > 1 else 100)
    _poles(axes, attribute, picture.scale)


def _poles(axes: Axes, attribute: RatedAttribute, scale: tuple[float, float]) -> None:
    """The two words stand at the two ends of the scale that they name."""
    if not attribute.high:
        axes.set_title(attribute.name)
        return
    for word, height, side in ((attribute.high, scale[1], "top"), (attribute.low, scale[0], "bottom")):
        place = axes.get_yaxis_transform()
        axes.text(1.01, height, word, transform=place, ha="left", va=side, fontweight="bold", color=INK)


def _key(axes: Axes, picture: Picture) -> None:
    """What the colours and the whiskers mean."""
    from matplotlib.patches import Patch

    colours = picture.colours()
    handles = [Patch(facecolor=colours[name], alpha=0.85) for name, _ in picture.families()]
    labels = [_key_label(picture, name, levels) for name, levels in picture.families()]
    axes.legend(handles, labels, loc="center left", frameon=False, handlelength=1.1, handleheight=1.1)
    note = f"Bars: means. Whiskers: ± 1 SD\nacross {picture.people()}."
    axes.text(0.98, 0.5, note, transform=axes.transAxes, ha="right", va="center", fontsize=8.0, color=SOFT)


def _key_label(picture: Picture, family: str, levels: list[str]) -> str:
    ends = [picture.written(levels[0]), picture.written(levels[-1])]
    if [family] == levels or len({picture.written(level) for level in picture.levels}) < len(picture.levels):
        return family
    return f"{family}  ({ends[0]})" if len(levels) == 1 else f"{family}  ({ends[0]} – {ends[1]})"


def _trend_panel(axes: Axes, picture: Picture, attributes: list[RatedAttribute]) -> None:
    places = _positions(picture)
    _scale_axis(axes, picture)
    _shade(axes, picture, places)
    ends: list[tuple[float, str, str]] = []
    for attribute, colour in zip(attributes, _line_colours(len(attributes)), strict=True):
        _trend(axes, picture, attribute, colour, places)
        known = [picture.dots[attribute.name, x].mean for x in picture.levels if (attribute.name, x) in picture.dots]
        if known:
            ends.append((known[-1], attribute.title, colour))
    _level_axis(axes, picture, places, 110)
    _direct_labels(axes, ends, max(places.values()), picture.scale)


def _line_colours(count: int) -> list[str]:
    return [OKABE_ITO[i % len(OKABE_ITO)] for i in range(count)]


def _shade(axes: Axes, picture: Picture, places: Mapping[str, float]) -> None:
    for name, levels in picture.families():
        left, right = places[levels[0]] - 0.55, places[levels[-1]] + 0.55
        axes.axvspan(left, right, color=FAINT, alpha=0.35, linewidth=0, zorder=0)
        axes.text(
            (left + right) / 2,
            1.02,
            name,
            transform=axes.get_xaxis_transform(),
            ha="center",
            va="bottom",
            fontsize=8.5,
            color=SOFT,
        )


def _trend(axes: Axes, picture: Picture, attribute: RatedAttribute, colour: str, places: Mapping[str, float]) -> None:
    reference = reference_level(picture)
    for _, levels in picture.families():
        known = [
            (places[level], picture.dots[attribute.name, level].mean)
            for level in levels
            if (attribute.name, level) in picture.dots
        ]
        if known and levels != [reference]:
            axes.plot(*zip(*known, strict=True), color=colour, linewidth=1.9, marker="o", markersize=5, zorder=3)
    if reference is not None and (start := picture.dots.get((attribute.name, reference))):
        axes.axhline(start.mean, color=colour, linewidth=0.8, linestyle=(0, (1, 2.5)), zorder=2)
        axes.plot(
            [places[reference]],
            [start.mean],
            marker="o",
            markersize=6.5,
            markerfacecolor="white",
            markeredgecolor=colour,
            markeredgewidth=1.8,
            zorder=3,
        )


def _direct_labels(axes: Axes, ends: list[tuple[float, str, str]], last: float, scale: tuple[float, float]) -> None:
    """Each line is named at its end; names that would overlap are moved apart, keeping their order."""
    step = 0.075 * (scale[1] - scale[0])
    placed = spread([height for height, _, _ in ends], step)
    for (height, name, colour), y in zip(ends, placed, strict=True):
        axes.annotate(
            name,
            (last + 0.12, height),
            (last + 0.75, y),
            color=colour,
            fontsize=8.5,
            va="center",
            fontweight="bold",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.6, "shrinkA": 1, "shrinkB": 3},
        )


def spread(heights: list[float], step: float) -> list[float]:
    """The heights moved apart to at least `step`, in their order; those that move do so around their mean."""
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
