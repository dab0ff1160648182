"""How values such as absolute errors are distributed at each level: violins with quartiles and points (thesis 5.14)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal

from palpate.analysis.figures.drawn import FigureData, FigureKind, Shown
from palpate.analysis.figures.predictions import PredictionSettings, chosen, read_points
from palpate.analysis.figures.shown_columns import in_order, numbers, pair_names, require, uniform
from palpate.analysis.figures.spots import summary
from palpate.analysis.figures.violins_drawing import draw
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused, natural_key
from palpate.analysis.ratings.person_cells import texts_of
from palpate.protocols.wording import count

__all__ = ["VIOLINS", "ViolinSettings", "data", "draw"]


class ViolinSettings(PredictionSettings):
    """A violin for each level of the column `by` ("attribute", a car, a method).

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
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        if self.value is not None:
            yield from (Idle(name, "with `value`") for name in ("actual", "predicted", "signed"))
        if self.by not in ("attribute", self.attribute):
            yield Idle("attribute", "where violins are not of attributes")


def data(shown: Shown, settings: ViolinSettings) -> FigureData:
    """A row for each level with its n, mean, SD and quartiles (`shows`: "level"), then one for each value ("value").

    Raises DataRefused where a column is missing or no row has a value.
    """
    found, left_out = _values(shown, settings)
    levels = list(in_order(shown.selected, settings.by, {level for level, _, _ in found}))
    told = {level: summary([value for each, _, value in found if each == level]) for level in levels}
    if settings.order == "median":
        levels.sort(key=lambda level: told[level]["median"] or 0.0)
    rank = {level: i for i, level in enumerate(levels)}
    ordered = sorted(found, key=lambda each: (rank[each[0]], natural_key(each[1]), each[2]))
    rows: list[dict[str, Any]] = [{"shows": "level", "level": level, **told[level]} for level in levels]
    rows += [{"shows": "value", "level": level, "stimulus": name, "value": value} for level, name, value in ordered]
    names = pair_names(shown.selected, levels) if settings.by == settings.attribute else {}
    words: dict[str, Any] = {
        "by": settings.by,
        "levels": levels,
        "names": names,
        "what": _what(settings),
        "unit": settings.unit,
    }
    words["least"] = 0.0 if settings.value is None and not settings.signed else None
    what = _what(settings)
    title = settings.title or f"{what[0].upper()}{what[1:]} by {settings.by}"
    return FigureData(uniform(rows), title, _caption(settings, left_out), words)


def _values(shown: Shown, settings: ViolinSettings) -> tuple[list[tuple[str, str, float]], int]:
    """Level, stimulus and value of each row that has one, and how many rows have none."""
    if settings.value is None:
        points = read_points(settings, shown.selected, (settings.by,))
        error = (lambda x: x) if settings.signed else abs
        return [(p.labels[settings.by], p.stimulus, float(error(p.error))) for p in points.points], points.left_out
    frame = shown.selected.table
    stimulus = chosen(settings, "stimulus", shown.selected)
    require(settings, frame, (settings.by, settings.value, *([stimulus] if stimulus else [])))
    names = texts_of(frame, stimulus) if stimulus else [""] * len(frame)
    rows = zip(texts_of(frame, settings.by), names, numbers(frame, settings.value), strict=True)
    found = [row for row in rows if not math.isnan(row[2])]
    if not found:
        raise DataRefused(f"figure {settings.name!r}: column {settings.value!r} holds no value")
    return found, len(frame) - len(found)


def _what(settings: ViolinSettings) -> str:
    if settings.value is not None:
        return settings.value
    return "predicted minus actual" if settings.signed else "absolute error"


def _caption(settings: ViolinSettings, left_out: int) -> str:
    lost = f" Not shown: {count(left_out, 'row')} without a value." if left_out else ""
    return (
        f"The distribution of the {_what(settings)} at each level of {settings.by}: every value a point, the violin its"
        " Gaussian kernel density (Silverman's bandwidth; all violins equally high; none for fewer than three different"
        f" values), the long line the median, the short ones the quartiles, the diamond the mean.{lost}"
    )


VIOLINS = FigureKind(ViolinSettings, data, draw, takes="table")
