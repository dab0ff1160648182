"""A line for each attribute within each family of levels, with a panel per category (thesis Figure 5.10)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from matplotlib.figure import Figure

from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind, Marks
from palpate.analysis.figures.lettering import format_signed, widest_pt
from palpate.analysis.figures.level_means import (
    Key,
    LevelPlaces,
    LevelSettings,
    level_name,
    level_rows,
    level_words,
    missing_whiskers_note,
    unequal_ratings_note,
    whisker_ends,
)
from palpate.analysis.figures.rating_axes import (
    attribute_title,
    by_category,
    count_people,
    cut_note,
    draw_band,
    fit_labels,
    move_apart,
    scale_note,
    set_level_axis,
    set_scale_axis,
)
from palpate.analysis.figures.style import PAPER, SOFT, colours_and_shapes
from palpate.protocols.wording import phrase

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.plans.answers import Row

Ends = tuple[float, float]
WIDTH = 10.6


class TrendsSettings(LevelSettings):
    """The settings of a figure of trends; `whiskers: none` draws only the lines."""

    figure: Literal["trends"]
    whiskers: Literal["sd", "cousineau_morey", "loftus_masson", "between", "none"] = "cousineau_morey"


def data(inputs: FigureInput, settings: TrendsSettings) -> FigureData:
    """Return a row for each attribute and level: its mean, n, SD and the ends of its whisker."""
    selected = inputs.selected
    rows = level_rows(selected, settings)
    words = level_words(selected, settings, rows)
    places = LevelPlaces(words)
    family = settings.families or (settings.by[0] if len(settings.by) > 1 else "")
    whiskers = f" Whiskers: {words['whiskers']}." if words["whiskers"] else " Their spread is not drawn here."
    caption = f"Points are means over {count_people(rows)}, {scale_note(selected)}.{whiskers}"
    caption += f" Lines join the levels of one {family}." if family else " A line joins the levels in their order."
    if places.reference:
        caption += f" A hollow mark and the dotted line across mark {level_name(places.reference)}, the reference."
    title = settings.title or f"Mean ratings within each {family or phrase(list(settings.by))}."
    caption += (
        unequal_ratings_note(rows) + missing_whiskers_note(rows, settings) + cut_note(whisker_ends(rows), _scale(words))
    )
    return FigureData(rows, title, caption, words)


def draw(data: FigureData) -> DrawnFigure:
    """Draw the lines with names at their ends; the reference, if there is one, is the ring on the left."""
    words, places, marks = data.words, LevelPlaces(data.words), Marks()
    categories = by_category(words["attributes"])
    titles = [attribute_title(attribute, 44) for attribute in words["attributes"]]
    names_in = widest_pt(titles, 8.5, "bold") / 72 + 0.35
    panel_width = WIDTH - 1.2 - names_in
    names = [places.written[key] for key in places.at]
    below = fit_labels(list(places.at.values()), names, panel_width).inches
    figure = Figure(figsize=(WIDTH, (3.45 + below) * len(categories) + 0.2), layout="constrained")
    panels = figure.subplots(len(categories), 1, squeeze=False)[:, 0]
    for panel, (category, attributes) in zip(panels, categories.items(), strict=True):
        _draw_panel(panel, data, attributes, places, marks, panel_width)
        title = attribute_title(attributes[0], 70) if len(attributes) == 1 else "All attributes"
        if category:
            title = f"{category} attributes".capitalize()
        panel.set_title(title, pad=22 if any(places.members) else 8)
        if any(attribute["high"] for attribute in attributes):
            low, high = (format_signed(end, _scale(words)) for end in words["scale"])
            panel.set_ylabel(f"mean rating ({low}: first word, {high}: second)", color=SOFT, fontsize=8.0)
    return DrawnFigure(figure, marks.all())


def _scale(words: Mapping[str, Any]) -> Ends:
    return words["scale"][0], words["scale"][1]


def _draw_panel(
    axes: Axes,
    data: FigureData,
    attributes: Sequence[Mapping[str, Any]],
    places: LevelPlaces,
    marks: Marks,
    width: float,
) -> None:
    scale = _scale(data.words)
    reach = [float(row[end]) for row in data.rows for end in ("low", "high", "mean") if row[end] is not None]  # type: ignore[arg-type]
    middle = (scale[0] + scale[1]) / 2
    set_scale_axis(axes, scale, reach, line=middle if scale[0] < 0 < scale[1] else None)
    set_level_axis(axes, list(places.at.values()), [places.written[key] for key in places.at], width)
    span = max(places.at.values()) + 1.4
    for name, keys in places.members.items():
        if name:
            draw_band(axes, places.at[keys[0]] - 0.55, places.at[keys[-1]] + 0.55, name, width, span)
    ends: list[tuple[float, str, str]] = []
    for i, (attribute, look) in enumerate(zip(attributes, colours_and_shapes(len(attributes)), strict=True)):
        rows_at = places.rows(data.rows, attribute["name"])
        shift = 0.09 * (i - (len(attributes) - 1) / 2)
        # The line is broken at a level without a mean; the reference goes across, dotted.
        for keys in places.members.values():
            if keys == [places.reference]:
                continue
            x = [places.at[key] + shift for key in keys]
            y = [float(rows_at[key]["mean"] or 0.0) if key in rows_at else float("nan") for key in keys]
            axes.plot(x, y, color=look[0], linewidth=1.8, zorder=3)
        if places.reference is not None and places.reference in rows_at:
            height = float(rows_at[places.reference]["mean"] or 0.0)
            axes.axhline(height, color=look[0], linewidth=0.8, linestyle=(0, (1, 2.5)), zorder=2)
        _draw_points(axes, rows_at, data, places, look, shift, marks)
        if rows_at:
            height = float(list(rows_at.values())[-1]["mean"] or 0.0)
            ends.append((height, attribute_title(attribute, 44), look[0]))
    # Each line is named at its end; names that would overlap are moved apart, keeping their order.
    last = max(places.at.values())
    apart = move_apart([height for height, _, _ in ends], 0.075 * (scale[1] - scale[0]))
    step = (last + 1.4) * 0.045
    for (end, name, colour), height in zip(ends, apart, strict=True):
        axes.annotate(
            name,
            (last + 0.25 * step, end),
            (last + 0.7 + step, height),
            color=colour,
            fontsize=8.5,
            va="center",
            fontweight="bold",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.6, "shrinkA": 1, "shrinkB": 3},
        )


def _draw_points(
    axes: Axes,
    rows_at: Mapping[Key, Row],
    data: FigureData,
    places: LevelPlaces,
    look: tuple[str, str],
    shift: float,
    marks: Marks,
) -> None:
    """Draw a shape for each attribute, distinguishable without colour; the reference is hollow."""
    size = 5.6 if len(places.keys) <= 40 else 3.6
    for key, row in rows_at.items():
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
        marks.add(point, places.details(row, data.words), level_name(key))
    known = [(places.at[key] + shift, row) for key, row in rows_at.items() if row["low"] is not None]
    if known:
        low, high = ([float(row[end] or 0.0) for _, row in known] for end in ("low", "high"))
        axes.vlines([x for x, _ in known], low, high, color=look[0], linewidth=0.9, alpha=0.7, zorder=2.5)


TRENDS = FigureKind(TrendsSettings, data, draw)
