"""Answers on a scale with a word at each end: boxes with every participant, or diverging bars (thesis Figure 5.18)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from pydantic import Field

from palpate.analysis.figures.columns import fill_columns, ordered_levels, require_columns, to_float
from palpate.analysis.figures.distributions import summary, whiskers
from palpate.analysis.figures.figure_kind import (
    MOST_MARKS,
    DrawnFigure,
    FigureData,
    FigureInput,
    FigureKind,
    FigureSettings,
    Marks,
)
from palpate.analysis.figures.lettering import fold, format_number, format_percent
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, PAPER, SOFT, readable_ink
from palpate.analysis.plans.answers import Row
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.person_cells import PersonCells, person_cells, texts_of
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count

MOST_POINTS = 15
WIDE_IN = 7.2
BOX = "#dfeaf3"
LOW, MIDDLE, HIGH = ("#9a4a00", "#e8a361"), "#e6e6e6", ("#7fb6dc", "#0b4f86")
BARS_WIDE_IN = 7.6


class LikertSettings(FigureSettings):
    """The settings of a figure of the items of one form (its column `form`; None: whatever is in the table).

    `points` are the ends of the scale (None: the plan's scale), `ends` their words. `style` draws "boxes" (quartiles,
    every participant a dot, the mean) or "bars" (shares of the points, diverging from the middle). `order` keeps the
    form's order ("given") or puts the highest mean first ("mean").
    """

    figure: Literal["likert"]
    style: Literal["boxes", "bars"] = "boxes"
    form: str | None = "likert"
    points: tuple[int, int] | None = None
    ends: tuple[str, str] = ("", "")
    order: Literal["given", "mean"] = "given"
    letters: int = Field(default=24, ge=6, le=80)


def data(inputs: FigureInput, settings: LikertSettings) -> FigureData:
    """Return rows of three kinds (`shows`): each item, its points, and each participant's answer.

    An "item" has n, mean, SD, quartiles and whiskers, a "point" the number who chose it, an "answer" the mean of a
    participant's answers. Raises DataRefused where the scale is unknown, an answer is beyond it, or bars have an answer
    between points.
    """
    # The ends of the scale.
    ends = settings.points or inputs.selected.scale
    if ends is None:
        raise DataRefused(f"figure {settings.name!r}: the scale is not known; set `points`, as points: [1, 7]")
    low, high = ends
    if low != int(low) or high != int(high) or not 1 <= high - low < MOST_POINTS:
        raise DataRefused(
            f"figure {settings.name!r}: points from {low:g} to {high:g}; two whole numbers, the lower one first and"
            f" at most {MOST_POINTS} points, are expected"
        )
    low, high = int(low), int(high)
    frame = inputs.selected.table
    require_columns(settings, frame, ["participant", "attribute", "value"])
    # The rows of the form that is set; all rows where none is set or the table names no forms.
    if settings.form is None or "form" not in frame.columns:
        rows_of_form = frame
    else:
        forms = texts_of(frame, "form")
        if settings.form not in forms:
            raise DataRefused(
                f"figure {settings.name!r}: no form {settings.form!r}; {nearest(settings.form, sorted(set(forms)))}"
            )
        rows_of_form = frame.loc[[form == settings.form for form in forms]]
    cells = person_cells(rows_of_form, ["attribute"], levels=inputs.selected.levels)
    items = {item[0]: _answers(settings, cells, j, (low, high)) for j, item in enumerate(cells.cells)}
    known = {item: answers for item, answers in items.items() if answers}
    if not known:
        raise DataRefused(f"figure {settings.name!r}: nobody answered any of these items with a number")
    order = list(ordered_levels(inputs.selected, "attribute", known))
    if settings.order == "mean":
        order.sort(key=lambda item: -float(np.mean(sorted(known[item].values()))))
    words = {"items": order, "low": low, "high": high, "ends": settings.ends, "style": settings.style}
    words["letters"] = settings.letters
    title = settings.title or "Answers to the questionnaire"
    silent = [item for item, answers in items.items() if not answers]
    caption = _caption(settings, cells, (low, high), silent)
    rows = _rows({item: known[item] for item in order}, (low, high))
    return FigureData(fill_columns(rows), title, caption, words)


def _rows(answers_of: Mapping[str, Mapping[str, float]], ends: tuple[int, int]) -> list[dict[str, Any]]:
    """Return a row for each item, then for each of its points, then for each participant's answer to it."""
    rows: list[dict[str, Any]] = []
    for item, answers in answers_of.items():
        values = list(answers.values())
        lowest, highest = whiskers(values)
        rows.append({"shows": "item", "item": item, **summary(values), "whisker_low": lowest, "whisker_high": highest})
    for item, answers in answers_of.items():
        chosen = list(answers.values())
        if all(value == int(value) for value in chosen):  # not where answers lie between points, which bars refuse
            counts = {point: chosen.count(point) for point in range(ends[0], ends[1] + 1)}
            rows += [
                {"shows": "point", "item": item, "value": float(point), "count": n, "share": n / len(chosen)}
                for point, n in counts.items()
            ]
    rows += [
        {"shows": "answer", "item": item, "participant": person, "value": value}
        for item, answers in answers_of.items()
        for person, value in answers.items()
    ]
    return rows


def _caption(settings: LikertSettings, cells: PersonCells, points: tuple[int, int], silent: Sequence[str]) -> str:
    """Return the caption: who answered on which scale, how to read it, and which items have no numeric answer."""
    low, high = points
    people = count(len(cells.participants), "participant")
    ends = f" ({low} = {settings.ends[0]}, {high} = {settings.ends[1]})" if any(settings.ends) else ""
    lost = f" Without an answer in numbers: {', '.join(silent)}." if silent else ""
    several = " The mean of a participant's answers counts." if cells.counts.max(initial=0) > 1 else ""
    reading = {
        "boxes": "Boxes: quartiles, the heavy line the median; whiskers: the furthest answers within 1.5 interquartile"
        " ranges; dots: participants, equal answers side by side; diamonds: means.",
        "bars": "Bars: the share of participants that chose each point, to the left and right of the scale's middle; at"
        " the sides the shares below and above it.",
    }[settings.style]
    return f"Answers of {people} on a scale from {low} to {high}{ends}. {reading}{several}{lost}"


def _answers(settings: LikertSettings, cells: PersonCells, j: int, ends: tuple[int, int]) -> dict[str, float]:
    """Return each participant's answer to one item. Raises DataRefused for an answer beyond the scale."""
    answers = {
        person: float(cells.values[i, j])
        for i, person in enumerate(cells.participants)
        if not np.isnan(cells.values[i, j])
    }
    for person, value in answers.items():
        where = f"figure {settings.name!r}: {person} answered {cells.cells[j][0]} with {value:g}"
        if not ends[0] <= value <= ends[1]:
            raise DataRefused(f"{where}; the scale goes from {ends[0]} to {ends[1]}: set `points`, or leave it out")
        if settings.style == "bars" and value != int(value):
            raise DataRefused(f"{where} (the mean of several answers?); bars count points: keep one session in `where`")
    return answers


def draw(data: FigureData) -> DrawnFigure:
    """Draw boxes or diverging bars, depending on the settings."""
    return _draw_bars(data) if data.words["style"] == "bars" else _draw_boxes(data)


def _draw_boxes(data: FigureData) -> DrawnFigure:
    """Draw a row for each item: box, dots and mean over one axis of points."""
    items = data.words["items"]
    tall = 0.62 if len(items) <= 12 else 0.42
    figure = Figure(figsize=(WIDE_IN, tall * len(items) + 0.85), layout="constrained")
    axes, marks = figure.add_subplot(), Marks()
    low, high = data.words["low"], data.words["high"]
    axes.set(xlim=(low - 0.4, high + 0.4), ylim=(len(items) - 0.45, -0.6))
    few = sum(row["shows"] == "answer" for row in data.rows) <= MOST_MARKS
    for place, item in enumerate(items):
        row = next(row for row in data.rows if row["shows"] == "item" and row["item"] == item)
        answers = [row for row in data.rows if row["shows"] == "answer" and row["item"] == item]
        # The box stands above the middle of the row, so that the dots have the room below.
        q1, middle, q3 = (to_float(row[name]) for name in ("q1", "median", "q3"))
        y, half = place - 0.12, 0.17
        reach = [to_float(row["whisker_low"]), to_float(row["whisker_high"])]
        axes.plot(reach, [y, y], color=SOFT, linewidth=1.0, zorder=2)
        for at in reach:
            axes.plot([at, at], [y - half / 2, y + half / 2], color=SOFT, linewidth=1.0, zorder=2)
        box = Rectangle((q1, y - half), q3 - q1, 2 * half, facecolor=BOX, edgecolor=SOFT, linewidth=1.0, zorder=3)
        axes.add_patch(box)
        axes.plot([middle, middle], [y - half, y + half], color=INK, linewidth=2.4, zorder=4, solid_capstyle="butt")
        _draw_dots(axes, marks, answers, place, few)
        _draw_mean(axes, marks, row, place)
    axes.set_yticks([i - 0.05 for i in range(len(items))], [item_name(data, item) for item in items], fontsize=9)
    axes.set_xticks(range(low, high + 1))
    axes.grid(visible=True, axis="x", color=FAINT)
    axes.axvline((low + high) / 2, color=SOFT, linewidth=0.8, zorder=0.6)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
    axes.text(1.01, -0.62, "mean ± SD", transform=axes.get_yaxis_transform(), va="bottom", fontsize=7.5, color=SOFT)
    for at, word, ha in ((low, data.words["ends"][0], "left"), (high, data.words["ends"][1], "right")):
        look: dict[str, Any] = {
            "xycoords": ("data", "axes fraction"),
            "textcoords": "offset points",
            "ha": ha,
            "va": "top",
        }
        outside = at - 0.1 if ha == "left" else at + 0.1
        axes.annotate(fold(word, 30), (outside, 0), (0, -20), fontsize=8.5, color=SOFT, **look)
    return DrawnFigure(figure, marks.all())


def _draw_dots(axes: Axes, marks: Marks, rows: Sequence[Row], place: int, few: bool) -> None:
    """Draw equal answers side by side, centred, in lines of up to nine below the box."""
    values = [to_float(row["value"]) for row in rows]
    look: dict[str, Any] = {
        "linestyle": "",
        "marker": "o",
        "markersize": 4.2,
        "markeredgewidth": 0.4,
        "markeredgecolor": PAPER,
    }
    most = max(map(list(values).count, values), default=1)
    abreast, lines = 9, -(-most // 9)
    step, down = 0.078, min(0.1, 0.22 / max(lines - 1, 1))
    seen: dict[float, int] = {}
    places = []
    for value in values:
        i = seen[value] = seen.get(value, -1) + 1
        count = min(abreast, list(values).count(value) - i // abreast * abreast)
        places.append((value + step * (i % abreast - (count - 1) / 2), i // abreast * down))
    for row, (x, down) in zip(rows, places, strict=True):
        (dot,) = axes.plot([x], [place + 0.15 + down], color=OKABE_ITO[0], zorder=5, **look)
        if few:
            person, answer = str(row["participant"]), format_number(to_float(row["value"]), 1).removesuffix(".0")
            marks.add(dot, (("participant", person), (str(row["item"]), answer)), person)


def _draw_mean(axes: Axes, marks: Marks, row: Row, place: int) -> None:
    mean = to_float(row["mean"])
    look: dict[str, Any] = {
        "markerfacecolor": OKABE_ITO[1],
        "markeredgecolor": PAPER,
        "markeredgewidth": 0.9,
        "markersize": 7,
    }
    (mark,) = axes.plot([mean], [place - 0.12], marker="D", linestyle="", zorder=6, **look)
    names = {"mean": "mean", "sd": "SD", "median": "median"}
    parts = [(name, format_number(to_float(row[of]))) for of, name in names.items() if row[of] is not None]
    marks.add(mark, (("item", str(row["item"])), *parts, ("n", str(row["n"]))), str(row["item"]))
    spread = "" if row["sd"] is None else f" ± {format_number(to_float(row['sd']))}"
    place_of = axes.get_yaxis_transform()
    axes.text(1.01, place - 0.1, format_number(mean), transform=place_of, va="center", fontsize=9, fontweight="bold")
    axes.text(1.075, place - 0.1, spread, transform=place_of, va="center", fontsize=8, color=SOFT)


def item_name(data: FigureData, item: str) -> str:
    """Return an item's name in the drawing."""
    return fold(item.replace("_", " "), int(data.words["letters"]))


def _draw_bars(data: FigureData) -> DrawnFigure:
    """Draw a bar for each item; points below the middle extend to the left, with a hatch that shows in grey print."""
    items = data.words["items"]
    tall = 0.5 if len(items) <= 12 else 0.34
    figure = Figure(figsize=(BARS_WIDE_IN, tall * len(items) + 1.0), layout="constrained")
    axes, marks = figure.add_subplot(), Marks()
    points = list(range(data.words["low"], data.words["high"] + 1))
    for place, item in enumerate(items):
        rows = [row for row in data.rows if row["shows"] == "point" and row["item"] == item]
        _draw_bar(axes, marks, rows, place, points)
    bars: list[Any] = list(axes.patches)
    ends = [x for bar in bars for x in (bar.get_x(), bar.get_x() + bar.get_width())]
    left, right = min(-0.15, *ends), max(0.15, *ends)
    axes.set(xlim=(left - 0.02 * (right - left), right + 0.02 * (right - left)), ylim=(len(items) - 0.45, -0.55))
    names = [fold(item.replace("_", " "), int(data.words["letters"])) for item in items]
    axes.set_yticks(range(len(items)), names, fontsize=9)
    axes.tick_params(axis="y", pad=36)
    axes.set_xticks([])
    axes.axvline(0, color=INK, linewidth=0.9, zorder=0.5)
    for spine in axes.spines.values():
        spine.set_visible(False)
    low, high = data.words["ends"]
    labels = [str(point) for point in points]
    for x, word, ha in ((0.0, low, "left"), (1.0, high, "right")):
        look: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": ha, "va": "top"}
        axes.annotate(fold(word, 22), (x, 0), (0, -7), fontsize=8, color=SOFT, **look)
    hatches = ["////" if i < len(points) // 2 else "" for i in range(len(points))]
    looks = zip(point_colours(len(points)), hatches, strict=True)
    handles = [Patch(facecolor=fill, edgecolor=PAPER, hatch=hatch) for fill, hatch in looks]
    axes.legend(
        handles, labels, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=len(points), frameon=False, fontsize=8,
        labelcolor=SOFT, handlelength=1.1, handleheight=1.1, columnspacing=0.9, handletextpad=0.4,
    )  # fmt: skip
    return DrawnFigure(figure, marks.all())


def point_colours(points: int) -> list[str]:
    """Return colours from the low to the high end, with a grey middle if there is one."""
    half = points // 2
    low = LinearSegmentedColormap.from_list("low", LOW)
    high = LinearSegmentedColormap.from_list("high", HIGH)
    steps = [i / max(half - 1, 1) for i in range(half)]
    return [*(to_hex(low(s)) for s in steps), *([MIDDLE] if points % 2 else []), *(to_hex(high(s)) for s in steps)]


def _draw_bar(axes: Axes, marks: Marks, rows: Sequence[Row], place: int, points: Sequence[int]) -> None:
    half, odd = len(points) // 2, len(points) % 2
    below = sum(to_float(row["share"]) for row in rows[:half])
    above = sum(to_float(row["share"]) for row in rows[half + odd :])
    at = -below - (to_float(rows[half]["share"]) / 2 if odd else 0.0)
    for i, (row, fill) in enumerate(zip(rows, point_colours(len(points)), strict=True)):
        share = to_float(row["share"])
        if share > 0:
            hatch = "////" if i < half else ""
            look: dict[str, Any] = {"color": fill, "edgecolor": PAPER, "linewidth": 0.8, "hatch": hatch}
            bar = axes.barh([float(place)], [share], 0.72, left=[at], **look)[0]
            chosen = f"{row['count']} ({format_percent(share)})"
            details = (("item", str(row["item"])), ("point", f"{to_float(row['value']):g}"), ("chosen by", chosen))
            marks.add(bar, details, str(row["item"]))
            if share >= 0.06:  # room for the number who chose it
                boxed = {"facecolor": fill, "edgecolor": "none", "pad": 0.8} if hatch else None
                look = {"ha": "center", "va": "center", "fontsize": 8, "color": readable_ink(fill), "bbox": boxed}
                axes.text(at + share / 2, float(place), str(row["count"]), **look)
        at += share
    for x, share, side in ((-0.01, below, "right"), (1.01, above, "left")):
        look = {"transform": axes.get_yaxis_transform(), "ha": side, "va": "center", "fontsize": 8.5, "color": INK}
        axes.text(x, place, format_percent(share), **look)


LIKERT = FigureKind(LikertSettings, data, draw, takes="forms")
