"""One line for each attribute within each family of levels, a panel for each category (thesis Figure 5.10)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from matplotlib.figure import Figure

from palpate.analysis.figures.figure_kind import Drawn, FigureData, FigureKind, Marking, Shown
from palpate.analysis.figures.lettering import signed, widest_pt
from palpate.analysis.figures.level_means import (
    Key,
    LevelFigure,
    Places,
    key_text,
    level_rows,
    level_words,
    unequal,
    unknown,
    whisker_ends,
)
from palpate.analysis.figures.rating_axes import (
    band,
    by_category,
    cut_note,
    lettered,
    level_axis,
    on_scale,
    people_text,
    scale_axis,
    spread,
    title_of,
)
from palpate.analysis.figures.style import PAPER, SOFT, looks
from palpate.protocols.wording import phrase

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.plans.answers import Row

Ends = tuple[float, float]
WIDTH = 10.6


class Trends(LevelFigure):
    """The settings of a figure of trends; `whiskers: none` leaves the lines alone."""

    figure: Literal["trends"]
    whiskers: Literal["sd", "cousineau_morey", "loftus_masson", "between", "none"] = "cousineau_morey"


def _data(shown: Shown, asked: Trends) -> FigureData:
    selected = shown.selected
    rows = level_rows(selected, asked)
    words = level_words(selected, asked, rows)
    places = Places(words)
    family = asked.families or (asked.by[0] if len(asked.by) > 1 else "")
    whiskers = f" Whiskers: {words['whiskers']}." if words["whiskers"] else " Their spread is not drawn here."
    caption = f"Points are means over {people_text(rows)}, {on_scale(selected)}.{whiskers}"
    caption += f" Lines join the levels of one {family}." if family else " A line joins the levels in their order."
    if places.reference:
        caption += f" A hollow mark and the dotted line across mark {key_text(places.reference)}, the reference."
    title = asked.title or f"Mean ratings within each {family or phrase(list(asked.by))}."
    caption += unequal(rows) + unknown(rows, asked) + cut_note(whisker_ends(rows), _scale(words))
    return FigureData(rows, title, caption, words)


def draw(data: FigureData) -> Drawn:
    """The lines, named at their ends; the reference, where there is one, is the ring at the left."""
    words, places, marking = data.words, Places(data.words), Marking()
    categories = by_category(words["attributes"])
    titles = [title_of(attribute, 44) for attribute in words["attributes"]]
    names_in = widest_pt(titles, 8.5, "bold") / 72 + 0.35
    panel_width = WIDTH - 1.2 - names_in
    names = [places.written[key] for key in places.at]
    below = lettered(list(places.at.values()), names, panel_width).inches
    figure = Figure(figsize=(WIDTH, (3.45 + below) * len(categories) + 0.2), layout="constrained")
    panels = figure.subplots(len(categories), 1, squeeze=False)[:, 0]
    for panel, (category, attributes) in zip(panels, categories.items(), strict=True):
        _panel(panel, data, attributes, places, marking, panel_width)
        panel.set_title(_heading(category, attributes), pad=22 if any(places.members) else 8)
        if any(attribute["high"] for attribute in attributes):
            low, high = (signed(end, _scale(words)) for end in words["scale"])
            panel.set_ylabel(f"mean rating ({low}: first word, {high}: second)", color=SOFT, fontsize=8.0)
    return Drawn(figure, marking.all())


def _scale(words: Mapping[str, Any]) -> Ends:
    return words["scale"][0], words["scale"][1]


def _heading(category: str, attributes: Sequence[Mapping[str, Any]]) -> str:
    if category:
        return f"{category} attributes".capitalize()
    return title_of(attributes[0], 70) if len(attributes) == 1 else "All attributes"


def _panel(
    axes: Axes,
    data: FigureData,
    attributes: Sequence[Mapping[str, Any]],
    places: Places,
    marking: Marking,
    width: float,
) -> None:
    scale = _scale(data.words)
    reach = [float(row[end]) for row in data.rows for end in ("low", "high", "mean") if row[end] is not None]  # type: ignore[arg-type]
    middle = (scale[0] + scale[1]) / 2
    scale_axis(axes, scale, reach, line=middle if scale[0] < 0 < scale[1] else None)
    level_axis(axes, list(places.at.values()), [places.written[key] for key in places.at], width)
    span = max(places.at.values()) + 1.4
    for name, keys in places.members.items():
        if name:
            band(axes, places.at[keys[0]] - 0.55, places.at[keys[-1]] + 0.55, name, width, span)
    ends: list[tuple[float, str, str]] = []
    for i, (attribute, look) in enumerate(zip(attributes, looks(len(attributes)), strict=True)):
        found = places.rows(data.rows, attribute["name"])
        shift = 0.09 * (i - (len(attributes) - 1) / 2)
        _line(axes, found, places, look, shift)
        _points(axes, found, data, places, look, shift, marking)
        if found:
            last = float(list(found.values())[-1]["mean"] or 0.0)
            ends.append((last, title_of(attribute, 44), look[0]))
    _direct_labels(axes, ends, max(places.at.values()), scale)


def _line(axes: Axes, found: Mapping[Key, Row], places: Places, look: tuple[str, str], shift: float) -> None:
    """Through the levels of each family; broken where a level has no mean; the reference goes across, dotted."""
    for keys in places.members.values():
        if keys == [places.reference]:
            continue
        x = [places.at[key] + shift for key in keys]
        y = [float(found[key]["mean"] or 0.0) if key in found else float("nan") for key in keys]
        axes.plot(x, y, color=look[0], linewidth=1.8, zorder=3)
    if places.reference is not None and places.reference in found:
        height = float(found[places.reference]["mean"] or 0.0)
        axes.axhline(height, color=look[0], linewidth=0.8, linestyle=(0, (1, 2.5)), zorder=2)


def _points(
    axes: Axes,
    found: Mapping[Key, Row],
    data: FigureData,
    places: Places,
    look: tuple[str, str],
    shift: float,
    marking: Marking,
) -> None:
    """A shape for each attribute, told apart without colour too; the reference is hollow."""
    size = 5.6 if len(places.keys) <= 40 else 3.6
    for key, row in found.items():
        x = places.at[key] + shift
        (point,) = axes.plot(
            [x],
            [float(row["mean"] or 0.0)],
            linestyle="none",
            marker=look[1],
            markersize=size + (1.2 if key == places.reference else 0),
            markerfacecolor=PAPER if key == places.reference else look[0],
            markeredgecolor=look[0] if key == places.reference else PAPER,
            markeredgewidth=1.7 if key == places.reference else 0.6,
            zorder=4,
        )
        marking.add(point, places.told(row, data.words), key_text(key))
    known = [(places.at[key] + shift, row) for key, row in found.items() if row["low"] is not None]
    if known:
        low, high = ([float(row[end] or 0.0) for _, row in known] for end in ("low", "high"))
        axes.vlines([x for x, _ in known], low, high, color=look[0], linewidth=0.9, alpha=0.7, zorder=2.5)


def _direct_labels(axes: Axes, ends: list[tuple[float, str, str]], last: float, scale: Ends) -> None:
    """Each line is named at its end; names that would overlap are moved apart, keeping their order."""
    placed = spread([height for height, _, _ in ends], 0.075 * (scale[1] - scale[0]))
    step = (last + 1.4) * 0.045
    for (height, name, colour), y in zip(ends, placed, strict=True):
        axes.annotate(
            name,
            (last + 0.25 * step, height),
            (last + 0.7 + step, y),
            color=colour,
            fontsize=8.5,
            va="center",
            fontweight="bold",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.6, "shrinkA": 1, "shrinkB": 3},
        )


TRENDS = FigureKind(Trends, _data, draw)
