"""Ratings of generated stimuli on the manipulated attribute beside its target (thesis Figure 5.16)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.analysis.figures.columns import fill_columns, read_numbers, require_columns, to_float
from palpate.analysis.figures.distributions import density, summary, swarm
from palpate.analysis.figures.figure_kind import (
    MOST_MARKS,
    DrawnFigure,
    FigureData,
    FigureInput,
    FigureKind,
    FigureSettings,
    Marks,
)
from palpate.analysis.figures.lettering import decimals_for, fold, format_number
from palpate.analysis.figures.style import INK, PAPER, SOFT, colours_and_shapes, quiet_axes, tint
from palpate.analysis.plans.answers import Row
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.person_cells import PersonCells, person_cells, texts_of
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count

USUAL = ("stimulus.attribute", "manipulated", "target_attribute")
ABREAST = 8
"""The number of attributes in one row of the figure."""
SLOT_IN, HIGH_IN = 1.28, 3.5


class MatchingSettings(FigureSettings):
    """The settings of a figure of ratings of each stimulus on the one attribute that it was made for.

    `attribute_column` is the stimulus column that names this attribute (None: the first of `stimulus.attribute`,
    `manipulated`, `target_attribute` that exists), `target` the column of the wished value on the ratings' scale.
    """

    figure: Literal["matching"]
    attribute_column: str | None = None
    target: str = "target"


def data(inputs: FigureInput, settings: MatchingSettings) -> FigureData:
    """Return rows of two kinds (`shows`): each attribute's "target", and each participant's "value" there.

    A target has n, mean, SD, quartiles and mean absolute error of the ratings; a value is the mean of a participant's
    repeats. Raises DataRefused where a column is missing, a target is no number or no rating is of a manipulated
    attribute.
    """
    selected = inputs.selected
    frame = selected.table
    column = settings.attribute_column or next((name for name in USUAL if name in frame.columns), USUAL[0])
    require_columns(settings, frame, ["participant", "attribute", "value", column, settings.target])
    # The ratings (participant, value, attribute, target) of each stimulus on the attribute that `column` names. A
    # target is the number as a text.
    rated, manipulated = texts_of(frame, "attribute"), texts_of(frame, column)
    if not set(manipulated) & set(rated):
        raise DataRefused(
            f"figure {settings.name!r}: column {column!r} names {manipulated[0]!r}, which is not rated;"
            f" {nearest(manipulated[0], sorted(set(rated)))}"
        )
    matching = np.array([a == b for a, b in zip(rated, manipulated, strict=True)])
    of_target = frame.loc[matching].reset_index(drop=True)
    targets = read_numbers(of_target, settings.target)
    if np.isnan(targets).any():
        raise DataRefused(f"figure {settings.name!r}: column {settings.target!r} has no number in some rows")
    ratings = of_target[["participant", "value"]].assign(
        attribute=[name for name, same in zip(rated, matching, strict=True) if same],
        target=[repr(value) for value in targets],
    )
    by_size = tuple(sorted(set(ratings["target"].tolist()), key=float))
    cells = person_cells(ratings, ["attribute", "target"], levels={**selected.levels, "target": by_size})
    summaries, values = _rows(cells)
    if not summaries:
        raise DataRefused(f"figure {settings.name!r}: every rating of a manipulated attribute is missing")
    attributes = list(dict.fromkeys(str(row["attribute"]) for row in summaries))
    targets = sorted({float(row["target"]) for row in summaries})
    antonyms = {name: selected.antonyms.get(name, "") for name in attributes}
    words = {"attributes": attributes, "targets": targets, "antonyms": antonyms, "scale": selected.scale}
    title = settings.title or "Ratings of the manipulated attribute"
    return FigureData(fill_columns([*summaries, *values]), title, _caption(cells, targets), words)


def _rows(cells: PersonCells) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return a row for each attribute and target with ratings, and one for each participant's value there."""
    summaries: list[dict[str, Any]] = []
    values: list[dict[str, Any]] = []
    for j, (attribute, text) in enumerate(cells.cells):
        answers = [(person, float(cells.values[i, j])) for i, person in enumerate(cells.participants)]
        given = [(person, value) for person, value in answers if not np.isnan(value)]
        if given:
            head, numbers = {"attribute": attribute, "target": float(text)}, [value for _, value in given]
            errors = np.sort(np.abs(np.array(numbers) - float(text)))
            summaries.append({"shows": "target", **head, **summary(numbers), "mae": float(np.mean(errors))})
            values += [{"shows": "value", **head, "participant": person, "value": value} for person, value in given]
    return summaries, values


def _caption(cells: PersonCells, targets: Sequence[float]) -> str:
    """Return the caption: whose ratings are shown, how to read the drawing, and what the error is."""
    written = ", ".join(f"{target:g}" for target in targets)
    most = int(cells.counts.max(initial=0))
    repeats = f" (the mean of up to {most} repeats)" if most > 1 else ""
    return (
        f"For each attribute the ratings of the stimuli that were made to feel {written} on it, the other attributes'"
        f" ratings not shown. Dots: {count(len(cells.participants), 'participant')}{repeats}; half violins: Gaussian"
        " kernel densities (Silverman's bandwidth), mirrored at the ends of the scale; large marks: means with ± 1 SD;"
        " dashed lines: the targets; below: the mean absolute error (MAE)."
    )


@dataclass(frozen=True)
class _Slot:
    """The place of one target's ratings: beside `x`, towards `side`, at most `reach` wide."""

    x: float
    side: int
    reach: float
    colour: str
    shape: str


def draw(data: FigureData) -> DrawnFigure:
    """Draw a slot for each attribute, with the lower target's ratings left of its middle, the higher one's right."""
    attributes, targets, scale = data.words["attributes"], data.words["targets"], data.words["scale"]
    lines = math.ceil(len(attributes) / ABREAST)
    abreast = math.ceil(len(attributes) / lines)
    slot_in = SLOT_IN * max(1.0, 0.5 * len(targets))
    size = (max(slot_in * abreast + 0.9, 4.4), HIGH_IN * lines + 0.35)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(lines, 1, squeeze=False, sharey=True)[:, 0]
    values = [to_float(row["value"]) for row in data.rows if row["shows"] == "value"]
    ends = [*values, *targets, *(scale or ())]
    low, high = min(ends), max(ends)
    margin = 0.03 * (high - low) or 0.5
    marks, limits = Marks(), (low - margin, high + margin)
    for line, axes in enumerate(grid):
        here = attributes[line * abreast : (line + 1) * abreast]
        axes.set(xlim=(-0.55, abreast - 0.45), ylim=limits, ylabel="rating")
        if scale is not None:
            axes.set_yticks([scale[0] + i * (scale[1] - scale[0]) / 4 for i in range(5)])
        quiet_axes(axes)
        axes.tick_params(axis="x", pad=17)
        _write_below(axes, "MAE", (0, 0), -6, "axes fraction", {"ha": "right", "color": SOFT})
        axes.set_xticks(range(len(here)), [fold(name, 15) for name in here], fontsize=8.5, fontweight="bold")
        for place, attribute in enumerate(here):
            antonym = fold(data.words["antonyms"][attribute], 15)
            look: dict[str, Any] = {"fontsize": 8.5, "fontweight": "bold", "color": INK, "ha": "center", "va": "bottom"}
            axes.text(place, 1.02, antonym, transform=axes.get_xaxis_transform(), **look)
            if place:
                axes.axvline(place - 0.5, color="#e7ebef", linewidth=0.8, zorder=0)
        for place, attribute in enumerate(here):
            for target, slot in zip(targets, _slots(targets, place), strict=True):
                _draw_target(axes, marks, data, (attribute, target), slot)
    handles = [
        Line2D([], [], color=colour, marker=shape, linestyle=(0, (3, 1.6)), markersize=5, markeredgecolor=PAPER)
        for colour, shape in colours_and_shapes(len(targets))
    ]
    names = [f"made to feel {target:g}" for target in targets]
    columns = max(1, int(figure.get_figwidth() / 1.5))
    figure.legend(handles, names, loc="outside upper left", ncols=columns, frameon=False, fontsize=8.5, labelcolor=SOFT)
    return DrawnFigure(figure, marks.all())


def _slots(targets: Sequence[float], place: int) -> list[_Slot]:
    """Return the places of targets: two share a middle, back to back; more are side by side."""
    looks = colours_and_shapes(len(targets))
    if len(targets) <= 2:
        gap = 0.03
        return [_Slot(place + s * gap, s, 0.40, *looks[j]) for j, s in enumerate((-1, 1)[: len(targets)])]
    wide = 0.86 / len(targets)
    return [_Slot(place - 0.43 + wide * (j + 0.12), 1, 0.84 * wide, *looks[j]) for j in range(len(targets))]


def _write_below(
    axes: Axes, text: str, at: tuple[float, float], right: float, system: Any, look: dict[str, Any]
) -> None:
    """Write a small word between the axis and the names below it."""
    place: dict[str, Any] = {"xycoords": system, "textcoords": "offset points", "annotation_clip": False}
    axes.annotate(text, at, (right, -5), va="top", fontsize=7.5, **place, **look)


def _draw_target(axes: Axes, marks: Marks, data: FigureData, place: tuple[str, float], slot: _Slot) -> None:
    rows = [row for row in data.rows if (row["attribute"], row["target"]) == place]
    if not rows:
        return
    row, values = rows[0], [row for row in rows if row["shows"] == "value"]
    ends = (slot.x, slot.x + slot.side * slot.reach)
    axes.plot(ends, [place[1]] * 2, color=slot.colour, linewidth=1.5, linestyle=(0, (3, 1.6)), zorder=2.5)
    at, heights = density([to_float(value["value"]) for value in values], *(data.words["scale"] or (None, None)))
    if len(at):
        edge = slot.x + slot.side * 0.9 * slot.reach * heights
        axes.fill_betweenx(at, slot.x, edge, color=tint(slot.colour, 0.25), linewidth=0, zorder=1)
        axes.plot(edge, at, color=tint(slot.colour, 0.7), linewidth=0.7, zorder=1.1)
    few = sum(row["shows"] == "value" for row in data.rows) <= MOST_MARKS
    _draw_dots(axes, marks, values, slot, axes.get_ylim(), few)
    x, mean = slot.x + slot.side * 0.045, to_float(row["mean"])
    if row["sd"] is not None:
        axes.errorbar([x], [mean], [to_float(row["sd"])], fmt="none", ecolor=INK, elinewidth=1.1, zorder=4)
    look: dict[str, Any] = {"markerfacecolor": PAPER, "markeredgecolor": INK, "markeredgewidth": 1.2, "markersize": 6.5}
    (mark,) = axes.plot([x], [mean], marker=slot.shape, linestyle="", zorder=5, **look)
    names = {"mean": "mean", "sd": "SD", "mae": "MAE"}
    parts = [(name, format_number(to_float(row[of]), 1)) for of, name in names.items() if row[of] is not None]
    where = (("attribute", str(row["attribute"])), ("target", f"{to_float(row['target']):g}"))
    marks.add(mark, (*where, *parts, ("n", str(row["n"]))), str(row["attribute"]))
    middle = slot.x + slot.side * slot.reach / 2
    mae = format_number(to_float(row["mae"]), decimals_for([to_float(row["mae"])]))
    _write_below(axes, mae, (middle, 0), 0, axes.get_xaxis_transform(), {"ha": "center", "color": slot.colour})


def _draw_dots(
    axes: Axes, marks: Marks, rows: Sequence[Row], slot: _Slot, limits: tuple[float, float], few: bool
) -> None:
    """Draw each participant as a dot, from the middle outwards."""
    values = [to_float(row["value"]) for row in rows]
    tall = 0.055 / (HIGH_IN - 0.7) * (limits[1] - limits[0])
    wide = 0.055 / SLOT_IN
    most = (slot.reach - 0.16) * tall / wide
    aside = [a * wide / tall for a in swarm(values, tall, most, one_sided=True)]
    look: dict[str, Any] = {
        "linestyle": "",
        "marker": slot.shape,
        "markersize": 3.6,
        "markeredgewidth": 0.3,
        "markeredgecolor": PAPER,
    }
    for row, value, a in zip(rows, values, aside, strict=True):
        (dot,) = axes.plot([slot.x + slot.side * (0.13 + a)], [value], color=slot.colour, zorder=3, **look)
        if few:
            parts = [(name, str(row[name])) for name in ("participant", "attribute")]
            numbers = [
                (name, format_number(to_float(row[of]), 1).removesuffix(".0"))
                for name, of in (("target", "target"), ("rating", "value"))
            ]
            marks.add(dot, (*parts, *numbers), str(row["participant"]))


MATCHING = FigureKind(MatchingSettings, data, draw)
