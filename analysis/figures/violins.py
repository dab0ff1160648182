"""Distributions of values such as absolute errors at each level: violins with quartiles and points (thesis 5.14)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Literal, TypeAlias

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.analysis.figures.columns import (
    bipolar_names,
    fill_columns,
    ordered_levels,
    read_numbers,
    require_columns,
    to_float,
)
from palpate.analysis.figures.distributions import density, summary, swarm
from palpate.analysis.figures.figure_kind import MOST_MARKS, DrawnFigure, FigureData, FigureInput, FigureKind, Marks
from palpate.analysis.figures.lettering import decimals_for, fold, format_number, shorten
from palpate.analysis.figures.predictions import PredictionSettings, chosen_column, read_predictions
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, PAPER, SOFT
from palpate.analysis.plans.answers import Row
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused, natural_key
from palpate.analysis.ratings.person_cells import texts_of
from palpate.protocols.wording import count

HALF = 0.40
"""The height of half a violin, in rows."""
WIDE_IN = 7.6
LevelValue: TypeAlias = tuple[str, str, float]  # level, stimulus, value
FILL, EDGE, DOT = "#d3e4f1", "#5b93bd", OKABE_ITO[0]


class ViolinSettings(PredictionSettings):
    """The settings of violins, one for each level of the column `by` ("attribute", a car, a method).

    The values are the absolute differences of `predicted` and `actual` (`signed: true`: predicted minus actual), or
    the column `value`. `order` keeps the study's order of levels ("given") or puts the smallest median first
    ("median"). `unit` is written at the axis.
    """

    figure: Literal["violins"]
    by: str = "attribute"
    value: str | None = None
    signed: bool = False
    order: Literal["given", "median"] = "given"
    unit: str = ""

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.value is not None:
            yield from (Idle(name, "with `value`") for name in ("actual", "predicted", "signed"))
        if self.by not in ("attribute", self.attribute):
            yield Idle("attribute", "where violins are not of attributes")


def data(inputs: FigureInput, settings: ViolinSettings) -> FigureData:
    """Return a row for each level with n, mean, SD and quartiles (`shows`: "level"), then one per value ("value").

    Raises DataRefused where a column is missing or no row has a value.
    """
    if settings.value is None:
        points = read_predictions(settings, inputs.selected, (settings.by,))
        error = (lambda x: x) if settings.signed else abs
        values = [(p.labels[settings.by], p.stimulus, float(error(p.error))) for p in points.points]
        left_out = points.left_out
    else:
        frame, stimulus = inputs.selected.table, chosen_column(settings, "stimulus", inputs.selected)
        require_columns(settings, frame, (settings.by, settings.value, *([stimulus] if stimulus else [])))
        stimuli = texts_of(frame, stimulus) if stimulus else [""] * len(frame)
        triples = zip(texts_of(frame, settings.by), stimuli, read_numbers(frame, settings.value), strict=True)
        values = [row for row in triples if not math.isnan(row[2])]
        if not values:
            raise DataRefused(f"figure {settings.name!r}: column {settings.value!r} holds no value")
        left_out = len(frame) - len(values)
    levels = list(ordered_levels(inputs.selected, settings.by, {level for level, _, _ in values}))
    summaries = {level: summary([value for item, _, value in values if item == level]) for level in levels}
    if settings.order == "median":
        levels.sort(key=lambda level: summaries[level]["median"] or 0.0)
    rank = {level: i for i, level in enumerate(levels)}
    ordered = sorted(values, key=lambda item: (rank[item[0]], natural_key(item[1]), item[2]))
    rows: list[dict[str, Any]] = [{"shows": "level", "level": level, **summaries[level]} for level in levels]
    rows += [{"shows": "value", "level": level, "stimulus": name, "value": value} for level, name, value in ordered]
    what = "predicted minus actual" if settings.signed else "absolute error"
    what = what if settings.value is None else settings.value
    names = bipolar_names(inputs.selected, levels) if settings.by == settings.attribute else {}
    words: dict[str, Any] = {
        "by": settings.by,
        "levels": levels,
        "names": names,
        "what": what,
        "unit": settings.unit,
        "least": 0.0 if settings.value is None and not settings.signed else None,
    }
    title = settings.title or f"{what[0].upper()}{what[1:]} by {settings.by}"
    return FigureData(fill_columns(rows), title, _caption(what, settings.by, left_out), words)


def _caption(what: str, by: str, left_out: int) -> str:
    """Return the caption: what the violins show, how to read them, and how many rows are not shown."""
    lost = f" Not shown: {count(left_out, 'row')} without a value." if left_out else ""
    return (
        f"The distribution of the {what} at each level of {by}: every value a point, the"
        " violin its Gaussian kernel density (Silverman's bandwidth; all violins equally high; none for fewer than"
        f" three different values), the long line the median, the short ones the quartiles, the diamond the mean.{lost}"
    )


def draw(data: FigureData) -> DrawnFigure:
    """Draw a row for each level, with its name on the left and its n and mean on the right."""
    levels, by = data.words["levels"], str(data.words["by"])
    high = 0.62 if len(levels) <= 12 else 0.42 if len(levels) <= 30 else 0.3
    figure = Figure(figsize=(WIDE_IN, high * len(levels) + 0.75), layout="constrained")
    axes, marks = figure.add_subplot(), Marks()
    values = [row for row in data.rows if row["shows"] == "value"]
    numbers = [to_float(row["value"]) for row in values]
    low, most = min([*numbers, *([data.words["least"]] if data.words["least"] is not None else [])]), max(numbers)
    span = (most - low) or abs(most) or 1.0
    axes.set(xlim=(low - 0.03 * span, most + 0.03 * span), ylim=(len(levels) - 0.45, -0.55))
    (left, right), (bottom, top), (wide, tall) = axes.get_xlim(), axes.get_ylim(), figure.get_size_inches()
    dot_in = 0.055
    diameter = dot_in * (right - left) / (0.68 * wide), dot_in * (bottom - top) / (tall - 0.6)  # in values and in rows
    digits = decimals_for(numbers)
    for place, level in enumerate(levels):
        row = next(row for row in data.rows if row["shows"] == "level" and row["level"] == level)
        own = [row for row in values if row["level"] == level]
        at, heights = density([to_float(value["value"]) for value in own], data.words["least"])
        if len(at):
            axes.fill_between(at, place - HALF * heights, place + HALF * heights, color=FILL, linewidth=0, zorder=1)
            for sign in (-1, 1):
                axes.plot(at, place + sign * HALF * heights, color=EDGE, linewidth=0.7, zorder=1.1)
        _draw_dots(axes, marks, own, place, diameter, str(data.words["what"]), by, len(values) <= MOST_MARKS)
        for name, reach, line in (("q1", 0.20, 1.1), ("median", 0.32, 2.2), ("q3", 0.20, 1.1)):
            x, ends = to_float(row[name]), [place - reach, place + reach]
            axes.plot([x, x], ends, color=INK, linewidth=line, zorder=3, solid_capstyle="butt")
        mean = to_float(row["mean"])
        look: dict[str, Any] = {"markerfacecolor": PAPER, "markeredgecolor": INK, "markeredgewidth": 1.1}
        (diamond,) = axes.plot([mean], [place], marker="D", markersize=5.5, linestyle="", zorder=4, **look)
        parts = [(name, format_number(to_float(row[name]), digits)) for name in ("mean", "median", "q1", "q3")]
        marks.add(diamond, (("level", str(level)), ("n", str(row["n"])), *parts), str(level))
        text = f"{format_number(mean, digits)}   n {row['n']}"
        axes.text(1.015, place, text, transform=axes.get_yaxis_transform(), va="center", fontsize=8, color=SOFT)
    few = len(levels) <= 30
    names = [data.words["names"].get(level, level) for level in levels]
    written = [fold(name, 26) if few else shorten(name, 30) for name in names]
    axes.set_yticks(range(len(levels)), written, fontsize=9 if few else 7)
    axes.text(1.015, -0.6, "mean", transform=axes.get_yaxis_transform(), fontsize=7.5, color=SOFT, va="bottom")
    unit = f" ({data.words['unit']})" if data.words["unit"] else ""
    axes.set_xlabel(f"{data.words['what']}{unit}")
    axes.grid(visible=True, axis="x", color=FAINT)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
    if data.words["least"] is None and axes.get_xlim()[0] < 0 < axes.get_xlim()[1]:
        axes.axvline(0, color=SOFT, linewidth=0.8, zorder=0.5)
    return DrawnFigure(figure, marks.all())


def _draw_dots(
    axes: Axes,
    marks: Marks,
    rows: Sequence[Row],
    place: int,
    size: tuple[float, float],
    what: str,
    by: str,
    marked: bool,
) -> None:
    values = [to_float(row["value"]) for row in rows]
    aside = [a * size[1] / size[0] for a in swarm(values, size[0], HALF * 0.9 * size[0] / size[1])]
    look: dict[str, Any] = {
        "linestyle": "",
        "marker": "o",
        "markersize": 3.4,
        "markeredgewidth": 0,
        "color": DOT,
        "alpha": 0.75,
    }
    if not marked:
        axes.plot(values, [place + a for a in aside], zorder=2, **look)
        return
    for row, value, a in zip(rows, values, aside, strict=True):
        (dot,) = axes.plot([value], [place + a], zorder=2, **look)
        labels = [(name, str(row[column])) for name, column in (("stimulus", "stimulus"), (by, "level")) if row[column]]
        names = {text: (name, text) for name, text in labels}.values()
        marks.add(dot, (*names, (what, format_number(value, decimals_for([value])))), str(row["stimulus"] or ""))


VIOLINS = FigureKind(ViolinSettings, data, draw, takes="table")
