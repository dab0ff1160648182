"""Answers on points with a word at each end: boxes with every participant, or diverging bars (thesis Figure 5.18)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field

from palpate.analysis.figures.drawn import AskedFigure, FigureData, FigureKind, Shown
from palpate.analysis.figures.likert_drawing import draw
from palpate.analysis.figures.shown_columns import in_order, require, uniform
from palpate.analysis.figures.spots import summary, whiskers
from palpate.analysis.plans.answers import Selected
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.person_cells import PersonCells, person_cells, texts_of
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count

__all__ = ["LIKERT", "LikertSettings", "data", "draw"]
MOST_POINTS = 15


class LikertSettings(AskedFigure):
    """The items of one form (its column `form`; None: whatever is in the table), one row of the drawing for each.

    `points` are the ends of the scale (None: the plan's scale), `ends` the words that stand there. `style` draws
    "boxes" (quartiles, every participant a dot, the mean) or "bars" (shares of the points, diverging from the middle).
    `order` keeps the form's order ("given") or puts the highest mean first ("mean").
    """

    figure: Literal["likert"]
    style: Literal["boxes", "bars"] = "boxes"
    form: str | None = "likert"
    points: tuple[int, int] | None = None
    ends: tuple[str, str] = ("", "")
    order: Literal["given", "mean"] = "given"
    letters: int = Field(default=24, ge=6, le=80)


def data(shown: Shown, settings: LikertSettings) -> FigureData:
    """Rows of three sorts (`shows`): each "item" with n, mean, SD, quartiles and whiskers, each of its "point"s with
    how many chose it, and each participant's "answer" (the mean of theirs, where they answered more than once).

    Raises DataRefused where the scale is not known, an answer lies beyond it, or bars meet an answer between points.
    """
    low, high = _points(settings, shown.selected)
    cells = _cells(settings, shown.selected)
    items = {item[0]: _answers(settings, cells, j, (low, high)) for j, item in enumerate(cells.cells)}
    known = {item: answers for item, answers in items.items() if answers}
    if not known:
        raise DataRefused(f"figure {settings.name!r}: nobody answered any of these items with a number")
    order = list(in_order(shown.selected, "attribute", known))
    if settings.order == "mean":
        order.sort(key=lambda item: -float(np.mean(sorted(known[item].values()))))
    rows = [{"shows": "item", "item": item, **_told(list(known[item].values()))} for item in order]
    rows += [row for item in order for row in _counted(item, list(known[item].values()), low, high)]
    rows += [
        {"shows": "answer", "item": item, "participant": person, "value": value}
        for item in order
        for person, value in known[item].items()
    ]
    words = {"items": order, "low": low, "high": high, "ends": settings.ends, "style": settings.style}
    words["letters"] = settings.letters
    title = settings.title or "Answers to the questionnaire"
    return FigureData(uniform(rows), title, _caption(settings, cells, items, words), words)


def _points(settings: LikertSettings, selected: Selected) -> tuple[int, int]:
    """The ends of the scale. Raises DataRefused where they are not known or no whole numbers in order."""
    found = settings.points or selected.scale
    if found is None:
        raise DataRefused(f"figure {settings.name!r}: the scale is not known; set `points`, as points: [1, 7]")
    low, high = found
    if low != int(low) or high != int(high) or not 1 <= high - low < MOST_POINTS:
        raise DataRefused(
            f"figure {settings.name!r}: points from {low:g} to {high:g}; two whole numbers, the lower one first and"
            f" at most {MOST_POINTS} points, are expected"
        )
    return int(low), int(high)


def _cells(settings: LikertSettings, selected: Selected) -> PersonCells:
    """Participants x items of the form."""
    frame = selected.table
    require(settings, frame, ["participant", "attribute", "value"])
    if settings.form is not None and "form" in frame.columns:
        forms = texts_of(frame, "form")
        if settings.form not in forms:
            raise DataRefused(
                f"figure {settings.name!r}: no form {settings.form!r}; {nearest(settings.form, sorted(set(forms)))}"
            )
        frame = frame.loc[[form == settings.form for form in forms]]
    return person_cells(frame, ["attribute"], levels=selected.levels)


def _answers(settings: LikertSettings, cells: PersonCells, j: int, ends: tuple[int, int]) -> dict[str, float]:
    """Each participant's answer to one item."""
    found = {
        person: float(cells.values[i, j])
        for i, person in enumerate(cells.participants)
        if not np.isnan(cells.values[i, j])
    }
    for person, value in found.items():
        where = f"figure {settings.name!r}: {person} answered {cells.cells[j][0]} with {value:g}"
        if not ends[0] <= value <= ends[1]:
            raise DataRefused(f"{where}; the scale goes from {ends[0]} to {ends[1]}: set `points`, or leave it out")
        if settings.style == "bars" and value != int(value):
            raise DataRefused(f"{where} (the mean of several answers?); bars count points: keep one session in `where`")
    return found


def _told(values: list[float]) -> dict[str, Any]:
    low, high = whiskers(values)
    return {**summary(values), "whisker_low": low, "whisker_high": high}


def _counted(item: str, values: Sequence[float], low: int, high: int) -> list[dict[str, Any]]:
    """How many chose each point; for bars only, as answers may lie between points otherwise."""
    if any(value != int(value) for value in values):
        return []
    chosen = [int(value) for value in values]
    return [
        {
            "shows": "point",
            "item": item,
            "value": float(point),
            "count": chosen.count(point),
            "share": chosen.count(point) / len(chosen),
        }
        for point in range(low, high + 1)
    ]


def _caption(
    settings: LikertSettings, cells: PersonCells, items: dict[str, dict[str, float]], words: dict[str, Any]
) -> str:
    people = count(len(cells.participants), "participant")
    ends = f" ({words['low']} = {settings.ends[0]}, {words['high']} = {settings.ends[1]})" if any(settings.ends) else ""
    silent = [item for item, answers in items.items() if not answers]
    lost = f" Without an answer in numbers: {', '.join(silent)}." if silent else ""
    several = " The mean of a participant's answers counts." if cells.counts.max(initial=0) > 1 else ""
    said = {
        "boxes": "Boxes: quartiles, the heavy line the median; whiskers: the furthest answers within 1.5 interquartile"
        " ranges; dots: participants, equal answers side by side; diamonds: means.",
        "bars": "Bars: the share of participants that chose each point, to the left and right of the scale's middle; at"
        " the sides the shares below and above it.",
    }[settings.style]
    return f"Answers of {people} on a scale from {words['low']} to {words['high']}{ends}. {said}{several}{lost}"


LIKERT = FigureKind(LikertSettings, data, draw, takes="forms")
