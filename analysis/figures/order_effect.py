"""Ratings and response times over a session, and carry-over from the stimulus of the previous trial."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from pydantic import Field

from palpate.analysis.figures.columns import require_columns
from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind, FigureSettings, Marks
from palpate.analysis.figures.lettering import (
    decimals_for,
    elide,
    format_number,
    format_p,
    format_signed,
    letters_that_fit,
)
from palpate.analysis.figures.rating_axes import attribute_title, attribute_words, demand_attributes, scale_ends
from palpate.analysis.figures.style import INK, OKABE_ITO, PAPER, SOFT, quiet_axes
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.one_sample import OneSample
from palpate.analysis.ratings.order_effects import OrderEffect, one_per_trial, order_effect
from palpate.protocols.study import Text, Whole
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.plans.answers import Row, Selected

TIME = "response time"
STEP = 10
"""The number of trials that slopes refer to."""


class OrderEffectSettings(FigureSettings):
    """The settings: the number of `bins`, each with a mean; `adjust: none` includes the effects of stimuli.

    `carry_over` also shows how ratings depend on the previous stimulus. `position`, `stimulus`: the columns with a
    trial's place in its session and its stimulus.
    """

    figure: Literal["order_effect"]
    bins: Annotated[Whole, Field(ge=2, le=60)] = 9
    adjust: Literal["stimulus", "none"] = "stimulus"
    carry_over: bool = False
    response_time: bool = True
    position: Text = "trial"
    stimulus: Text = "stimulus"
    confidence: Annotated[float, Field(gt=0, lt=1)] = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.adjust == "none":
            yield from (Idle(name, "with `adjust: none`") for name in ("carry_over", "stimulus"))


def data(inputs: FigureInput, settings: OrderEffectSettings) -> FigureData:
    """Return the rows of every attribute and of the response time: bins, slope, carry-over."""
    selected, table = inputs.selected, inputs.selected.table
    demand_attributes(settings.name, selected)
    require_columns(settings, table, (settings.position, settings.stimulus))
    adjust, why = settings.adjust, ""
    if adjust == "stimulus" and table["participant"].nunique() == 1:
        adjust, why = "none", " (with one participant, position and stimulus are the same thing)"
    effects = {
        name: _effect(table[table["attribute"] == name], "value", settings, adjust)
        for name in selected.outcomes
        if (table["attribute"] == name).any()
    }
    rows = [row for name, effect in effects.items() for row in _rows(name, effect)]
    if times := _time_effect(selected, settings, adjust):
        rows += _rows(TIME, times, logarithmic=True)
    people = table["participant"].nunique()
    share = f"{100 * settings.confidence:g} %"
    adjustment = (
        f"what the {settings.stimulus} itself does is taken out"
        if adjust == "stimulus"
        else f"nothing is taken out{why}"
    )
    caption = (
        f"Points are means over {count(people, 'participant')} by the place of the trial in its session, {adjustment};"
        f" whiskers are {share} within-participant intervals (Cousineau–Morey). The line is the mean of the"
        f" participants' slopes, written per {STEP} trials with its {share} interval."
    )
    caption += f" {TIME.capitalize()}s are geometric means, their slope in per cent." if times else ""
    if settings.carry_over and adjust == "stimulus":
        caption += " Carry-over: how much of the effect of the stimulus before a rating takes on (+) or turns from (−)."
    scale = scale_ends(selected)
    words = {"attributes": attribute_words(selected), "scale": scale, "step": STEP}
    # A panel spans at most 0.6 of the scale, so it cuts every wider whisker.
    bins = [row for row in rows if row["kind"] == "bin" and row["measure"] != TIME]
    wide = sum(
        len(b := numbers_in([row], "low", "high")) == 2 and b[1] - b[0] > 0.6 * (scale[1] - scale[0]) for row in bins
    )
    caption += f" {count(wide, 'whisker')} cut at the edge of a panel; the table has the ends." if wide else ""
    return FigureData(tuple(rows), settings.title or "Ratings along the session.", caption, words)


def _effect(
    rows: pd.DataFrame, dv: str, settings: OrderEffectSettings, adjust: Literal["stimulus", "none"], carry: bool = True
) -> OrderEffect:
    """Return the effect of order on the column `dv` of these rows."""
    return order_effect(
        rows.reset_index(drop=True),
        dv,
        stimulus=settings.stimulus,
        position=settings.position,
        bins=settings.bins,
        adjust=adjust,
        carry_over=settings.carry_over and carry and adjust == "stimulus",
        confidence=settings.confidence,
    )


def _time_effect(
    selected: Selected, settings: OrderEffectSettings, adjust: Literal["stimulus", "none"]
) -> OrderEffect | None:
    """Return the effect on the log of the seconds until a trial's last answer; None without times or if not set."""
    table = selected.table
    if not settings.response_time or "response_time_s" not in table.columns:
        return None
    keys = [name for name in ("participant", "session", settings.position, settings.stimulus) if name in table.columns]
    times = one_per_trial(table, keys, "response_time_s")
    times = times[times["response_time_s"] > 0]
    if times.empty:
        return None
    times = times.assign(
        log=np.log(times["response_time_s"]), **{settings.position: times[settings.position].astype(float)}
    )
    return _effect(times, "log", settings, adjust, carry=False)


def _rows(measure: str, effect: OrderEffect, logarithmic: bool = False) -> list[Row]:
    convert = math.exp if logarithmic else float

    def per_step(slope: float) -> float:
        return 100 * math.expm1(STEP * slope) if logarithmic else STEP * slope

    rows: list[Row] = [
        {
            "measure": measure,
            "kind": "bin",
            "first_trial": interval.first,
            "last_trial": interval.last,
            "n": interval.n,
            "value": _known(interval.mean, convert),
            "low": _known(interval.low, convert),
            "high": _known(interval.high, convert),
            "p": None,
            "note": "",
        }
        for interval in effect.bins
    ]
    rows.append(_slope_row(measure, f"slope per {STEP} trials", effect.slope, per_step))
    if effect.carry_over is not None:
        rows.append(_slope_row(measure, "carry-over", effect.carry_over, float))
    return rows


def _slope_row(measure: str, kind: str, slope: OneSample, convert: Any) -> Row:
    numbers = {"value": slope.mean, "low": slope.low, "high": slope.high}
    return {
        "measure": measure,
        "kind": kind,
        "first_trial": None,
        "last_trial": None,
        "n": slope.n,
        **{name: _known(value, convert) for name, value in numbers.items()},
        "p": _known(slope.p, float),
        "note": slope.note,
    }


def _known(value: float, convert: Any) -> float | None:
    return None if math.isnan(value) else float(convert(value))


def numbers_in(rows: Sequence[Row], *names: str) -> list[float]:
    """Return the numbers in these columns of these rows, without missing ones."""
    return [float(value) for row in rows for name in names if isinstance(value := row[name], int | float)]


def draw(data: FigureData) -> DrawnFigure:
    """Draw a panel for each attribute, all with one range, then the response time, then the carry-over."""
    measures = list(dict.fromkeys(str(row["measure"]) for row in data.rows))
    carried = [row for row in data.rows if row["kind"] == "carry-over"]
    panels = len(measures) + bool(carried)
    columns = min(panels, 3 if panels in (5, 6, 9) else 4)
    lines = math.ceil(panels / columns)
    width = {1: 6.0, 2: 4.4}.get(columns, 3.1)
    figure = Figure(
        figsize=(width * columns, 2.35 * lines),
        layout=ConstrainedLayoutEngine(h_pad=0.06, w_pad=0.06, hspace=0.04, wspace=0.04),
    )
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    attributes = {attribute["name"]: attribute for attribute in data.words["attributes"]}
    # One span for all attributes: as wide as the widest course, at least an eighth of the scale.
    low, high = data.words["scale"]
    widest = float(high - low) / 8
    for measure in dict.fromkeys(row["measure"] for row in data.rows if row["measure"] != TIME):
        own = [row for row in data.rows if row["measure"] == measure and row["kind"] == "bin"]
        reach = numbers_in(own, "low", "high", "value")
        widest = max(widest, 1.15 * (max(reach) - min(reach)))
    marks, span = Marks(), min(widest, 0.6 * float(high - low))
    for place, (panel, measure) in enumerate(zip(axes, measures, strict=False)):
        own = [row for row in data.rows if row["measure"] == measure]
        _draw_course(panel, own, data.words, None if measure == TIME else span, marks)
        room = letters_that_fit(width - 0.4)
        title = "Response time in s" if measure == TIME else attribute_title(attributes[measure], room)
        panel.set_title(title, fontsize=9)
        if place + columns >= len(measures):
            panel.set_xlabel("trial of the session", fontsize=8, color=SOFT)
    if carried:
        _draw_carry_over(axes[len(measures)], carried, attributes, marks)
    for empty in axes[panels:]:
        empty.set_axis_off()
    return DrawnFigure(figure, marks.all())


def _draw_course(axes: Axes, own: Sequence[Row], words: Mapping[str, Any], span: float | None, marks: Marks) -> None:
    bins = [row for row in own if row["kind"] == "bin"]
    colour = OKABE_ITO[0] if span is not None else OKABE_ITO[1]
    reach = numbers_in(bins, "low", "high", "value")
    middle = (min(reach) + max(reach)) / 2
    half = (1.3 * (max(reach) - min(reach)) or 1.0) / 2 if span is None else span / 2
    axes.set_ylim(middle - 1.25 * half, middle + half)
    x = [(row["first_trial"] + row["last_trial"]) / 2 for row in bins]  # type: ignore[operator]
    values = numbers_in(bins, "value")
    _draw_slope(axes, own, x, values, colour)
    known = [(place, row) for place, row in zip(x, bins, strict=True) if row["low"] is not None]
    ends = (numbers_in([row for _, row in known], end) for end in ("low", "high"))
    axes.vlines([place for place, _ in known], *ends, color=INK, linewidth=0.9, zorder=2.5)
    for place, row in zip(x, bins, strict=True):
        shape = "o" if span is not None else "s"
        (point,) = axes.plot(
            [place], numbers_in([row], "value"), shape, color=colour, markersize=5.5, markeredgecolor=PAPER, zorder=3
        )
        trials = f"{row['first_trial']} to {row['last_trial']}"
        details = [
            ("measure", str(row["measure"])),
            ("trials", trials),
            ("mean", format_number(numbers_in([row], "value")[0])),
        ]
        marks.add(point, (*details, ("participants", str(row["n"]))))
    axes.set_xlim(0.5, max(float(row["last_trial"]) for row in bins) + 0.5)  # type: ignore[arg-type]
    axes.yaxis.set_major_formatter(
        lambda value, _: format_signed(round(value, 9), tuple(words["scale"]) if span else (0, 1))
    )
    axes.locator_params(axis="y", nbins=5)
    axes.tick_params(labelsize=8)
    quiet_axes(axes)


def _draw_slope(axes: Axes, own: Sequence[Row], x: Sequence[float], values: Sequence[float], colour: str) -> None:
    """Draw the mean slope through the middle of the course, with its numbers below."""
    (slope,) = [row for row in own if str(row["kind"]).startswith("slope")]
    if slope["value"] is None:
        text = str(slope["note"])
    else:
        percent = slope["measure"] == TIME
        unit = " %" if percent else ""
        value = numbers_in([slope], "value")[0]
        middle = sum(x) / len(x)
        ends = np.array([min(x), max(x)])
        if percent:
            level = math.exp(sum(map(math.log, values)) / len(values))
            height = level * (1 + value / 100) ** ((ends - middle) / STEP)
        else:
            height = sum(values) / len(values) + value * (ends - middle) / STEP
        axes.plot(ends, height, color=colour, linewidth=1.3, alpha=0.8, zorder=2)
        bounds, p = numbers_in([slope], "low", "high"), next(iter(numbers_in([slope], "p")), None)
        decimals = max(2, decimals_for(bounds or [value]) - 1)
        text = f"{_format_difference(value, decimals)}{unit} per {STEP} trials"
        if bounds:
            low, high = (_format_difference(bound, decimals) for bound in bounds)
            text += f"  [{low}, {high}], {format_p(p)}"
    box = {"facecolor": PAPER, "edgecolor": "none", "pad": 1.5}
    note = axes.text(0.02, 0.03, elide(text, 60), transform=axes.transAxes, fontsize=7.0, va="bottom", bbox=box)
    note.set_in_layout(False)


def _format_difference(value: float, decimals: int) -> str:
    written = format_number(value, decimals)
    return f"+{written}" if value > 0 and float(written) else written


def _draw_carry_over(axes: Axes, carried: Sequence[Row], attributes: Mapping[str, Any], marks: Marks) -> None:
    """Draw the carry-over of every attribute with its interval, around zero."""
    axes.axvline(0, color=SOFT, linewidth=0.8)
    names = [elide(str(row["measure"]), 14) for row in carried]
    for place, row in enumerate(carried):
        bounds, value = numbers_in([row], "low", "high"), numbers_in([row], "value")
        if len(bounds) == 2:
            axes.hlines([-place], *bounds, color=INK, linewidth=0.9)
        if not value:
            axes.text(0, -place, f" undefined: {row['note']}", fontsize=7, color=SOFT, va="center")
        else:
            (point,) = axes.plot(value, [-place], "D", color=OKABE_ITO[2], markersize=5, markeredgecolor=PAPER)
            details = (
                ("carry-over", attribute_title(attributes[str(row["measure"])])),
                ("slope", format_number(value[0], 3)),
            )
            marks.add(point, (*details, ("interval", " to ".join(format_number(b, 3) for b in bounds) or "none")))
    axes.set_yticks([-k for k in range(len(carried))], names, fontsize=8)
    axes.set_ylim(-len(carried) + 0.4, 0.6)
    axes.set_title("Carry-over of the trial before", fontsize=9)
    axes.grid(visible=True, axis="x")
    axes.tick_params(labelsize=8)
    axes.locator_params(axis="x", nbins=5)
    axes.set_xlabel("slope on its effect", fontsize=8, color=SOFT)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)


ORDER_EFFECT = FigureKind(OrderEffectSettings, data, draw)
