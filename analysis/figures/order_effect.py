"""Ratings and response times along a session, and whether the stimulus of the trial before leaves a trace."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field

from palpate.analysis.figures.drawn import AskedFigure, FigureData, FigureKind, Shown
from palpate.analysis.figures.order_effect_drawing import STEP, TIME, draw, numbers_in
from palpate.analysis.figures.rated import attribute_words, demand_attributes, scale_words
from palpate.analysis.figures.shown_columns import require
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.one_sample import OneSample
from palpate.analysis.ratings.order_effects import OrderEffect, one_per_trial, order_effect
from palpate.protocols.study import Text, Whole
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row, Selected


class OrderFigure(AskedFigure):
    """`bins`: of how many trials' places a mean is shown. `adjust: none` leaves in what the stimuli themselves do.

    `carry_over` also shows how the ratings follow the stimulus before. `position`, `stimulus`: the columns that hold
    the place of a trial in its session and its stimulus.
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
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        if self.adjust == "none":
            yield from (Idle(name, "with `adjust: none`") for name in ("carry_over", "stimulus"))


def _data(shown: Shown, asked: OrderFigure) -> FigureData:
    selected, table = shown.selected, shown.selected.table
    demand_attributes(asked.name, selected)
    require(asked, table, (asked.position, asked.stimulus))
    adjust, why = _adjust(asked, table)
    found = {
        name: _effect(table[table["attribute"] == name], "value", asked, adjust)
        for name in selected.outcomes
        if (table["attribute"] == name).any()
    }
    rows = [row for name, effect in found.items() for row in _rows(name, effect)]
    if times := _times(selected, asked, adjust):
        rows += _rows(TIME, times, logarithmic=True)
    people = table["participant"].nunique()
    share = f"{100 * asked.confidence:g} %"
    kept = (
        f"what the {asked.stimulus} itself does is taken out" if adjust == "stimulus" else f"nothing is taken out{why}"
    )
    caption = (
        f"Points are means over {count(people, 'participant')} by the place of the trial in its session, {kept};"
        f" whiskers are {share} within-participant intervals (Cousineau–Morey). The line is the mean of the"
        f" participants' slopes, written per {STEP} trials with its {share} interval."
    )
    caption += f" {TIME.capitalize()}s are geometric means, their slope in per cent." if times else ""
    if asked.carry_over and adjust == "stimulus":
        caption += " Carry-over: how much of the effect of the stimulus before a rating takes on (+) or turns from (−)."
    scale = scale_words(selected)
    words = {"attributes": attribute_words(selected), "scale": scale, "step": STEP}
    caption += _cut(rows, scale)
    return FigureData(tuple(rows), asked.title or "Ratings along the session.", caption, words)


def _cut(rows: Sequence[Row], scale: Sequence[float]) -> str:
    """Panels never span more than 0.6 of the scale."""
    bins = [row for row in rows if row["kind"] == "bin" and row["measure"] != TIME]
    wide = sum(
        len(b := numbers_in([row], "low", "high")) == 2 and b[1] - b[0] > 0.6 * (scale[1] - scale[0]) for row in bins
    )
    return f" {count(wide, 'whisker')} cut at the edge of a panel; the table has the ends." if wide else ""


def _adjust(asked: OrderFigure, table: pd.DataFrame) -> tuple[Literal["stimulus", "none"], str]:
    """One participant, or one who is alone with a stimulus, cannot tell position from stimulus: said, not hidden."""
    if asked.adjust == "stimulus" and table["participant"].nunique() == 1:
        return "none", " (with one participant, position and stimulus are the same thing)"
    return asked.adjust, ""


def _effect(
    rows: pd.DataFrame, dv: str, asked: OrderFigure, adjust: Literal["stimulus", "none"], carry: bool = True
) -> OrderEffect:
    return order_effect(
        rows.reset_index(drop=True),
        dv,
        stimulus=asked.stimulus,
        position=asked.position,
        bins=asked.bins,
        adjust=adjust,
        carry_over=asked.carry_over and carry and adjust == "stimulus",
        confidence=asked.confidence,
    )


def _times(selected: Selected, asked: OrderFigure, adjust: Literal["stimulus", "none"]) -> OrderEffect | None:
    """The logarithm of the seconds until a trial's last answer; None where no time is known or it is not wanted."""
    table = selected.table
    if not asked.response_time or "response_time_s" not in table.columns:
        return None
    keys = [name for name in ("participant", "session", asked.position, asked.stimulus) if name in table.columns]
    times = one_per_trial(table, keys, "response_time_s")
    times = times[times["response_time_s"] > 0]
    if times.empty:
        return None
    times = times.assign(log=np.log(times["response_time_s"]), **{asked.position: times[asked.position].astype(float)})
    return _effect(times, "log", asked, adjust, carry=False)


def _rows(measure: str, effect: OrderEffect, logarithmic: bool = False) -> list[Row]:
    turn = math.exp if logarithmic else float
    rows: list[Row] = [
        {
            "measure": measure,
            "kind": "bin",
            "first_trial": each.first,
            "last_trial": each.last,
            "n": each.n,
            "value": _known(each.mean, turn),
            "low": _known(each.low, turn),
            "high": _known(each.high, turn),
            "p": None,
            "note": "",
        }
        for each in effect.bins
    ]
    rows.append(_slope_row(measure, f"slope per {STEP} trials", effect.slope, _percent if logarithmic else _per_step))
    if effect.carry_over is not None:
        rows.append(_slope_row(measure, "carry-over", effect.carry_over, float))
    return rows


def _slope_row(measure: str, kind: str, slope: OneSample, turn: Any) -> Row:
    numbers = {"value": slope.mean, "low": slope.low, "high": slope.high}
    return {
        "measure": measure,
        "kind": kind,
        "first_trial": None,
        "last_trial": None,
        "n": slope.n,
        **{name: _known(value, turn) for name, value in numbers.items()},
        "p": _known(slope.p, float),
        "note": slope.note,
    }


def _per_step(slope: float) -> float:
    return STEP * slope


def _percent(slope: float) -> float:
    return 100 * math.expm1(STEP * slope)


def _known(value: float, turn: Any) -> float | None:
    return None if math.isnan(value) else float(turn(value))


ORDER_EFFECT = FigureKind(OrderFigure, _data, draw)
