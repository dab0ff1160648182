"""Predicted against actual values, with the line of identity and bands of the ratings' SD (thesis 5.12, 5.13)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from palpate.analysis.figures.drawn import FigureData, FigureKind, Shown
from palpate.analysis.figures.predicted_drawing import draw
from palpate.analysis.figures.predictions import Point, PredictionSettings, chosen, read_points
from palpate.analysis.figures.shown_columns import in_order, pair_names
from palpate.analysis.plans.answers import Row, Selected
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.undefined import nan_to_none

__all__ = ["PREDICTED", "PredictedSettings", "data", "draw"]
INNER, OUTER = 0.5, 1.0
ROUNDING_ULPS = 4
"""A point exactly on the edge of a band counts as within it, whatever the units round it to."""


class PredictedSettings(PredictionSettings):
    """Panels by a column (`panels`: a car, "attribute"), colours and shapes by another (`colour`).

    `sd` is the SD of the participants' ratings: a number, or a column with one SD for each row (its root mean square
    is taken); without either, the SD of the actual values stands in and the caption says so. `band` says over what it
    is taken: all rows shown ("global") or the rows of a panel ("panel"). `low` and `high` are the ends of each
    prediction's interval, drawn as whiskers. `unit` is written at the axes.
    """

    figure: Literal["predicted"]
    panels: str | None = None
    colour: str | None = None
    sd: float | str = "sd"
    band: Literal["global", "panel"] = "global"
    low: str = "low"
    high: str = "high"
    unit: str = ""

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        if self.panels is None:
            yield Idle("band", "without `panels`")
        elif not isinstance(self.sd, str):
            yield Idle("band", "with a number as `sd`")


def data(shown: Shown, settings: PredictedSettings) -> FigureData:
    """One row for each prediction, with its error, its panel's SD and whether it lies within each band.

    Raises DataRefused where a column is missing or an SD is negative.
    """
    selected = shown.selected
    attribute = chosen(settings, "attribute", selected)
    labels = [name for name in (settings.panels, attribute, settings.colour) if name is not None]
    intervals = [name for name in (chosen(settings, end, selected) for end in ("low", "high")) if name is not None]
    column = chosen(settings, "sd", selected) if isinstance(settings.sd, str) else None
    found = read_points(settings, selected, labels, [*intervals, *([column] if column else [])])
    sds = _sds(settings, found.points, column)
    rows = tuple(_row(settings, point, sds[_panel(settings, point)], attribute, intervals) for point in found.points)
    caption = f"{_caption(settings, column, rows)}{found.said()}"
    return FigureData(
        rows, settings.title or "Predicted against actual values", caption, _words(settings, selected, rows)
    )


def _panel(settings: PredictedSettings, point: Point) -> str:
    return point.labels[settings.panels] if settings.panels else ""


def _sds(settings: PredictedSettings, points: tuple[Point, ...], column: str | None) -> dict[str, float]:
    """The SD of each panel, NaN where it is undefined or 0."""
    panels = sorted({_panel(settings, point) for point in points})
    by_panel = {name: [point for point in points if _panel(settings, point) == name] for name in panels}
    if settings.band == "global" or isinstance(settings.sd, float | int):
        return dict.fromkeys(panels, _sd(settings, points, column))
    return {name: _sd(settings, tuple(of), column) for name, of in by_panel.items()}


def _sd(settings: PredictedSettings, points: tuple[Point, ...], column: str | None) -> float:
    if isinstance(settings.sd, float | int):
        found = float(settings.sd)
    elif column is not None:
        given = np.array([point.more[column] for point in points])
        if np.any(given < 0):
            raise DataRefused(f"figure {settings.name!r}: column {column!r} holds an SD below 0")
        known = given[~np.isnan(given)]
        found = math.hypot(*known) / math.sqrt(len(known)) if len(known) else math.nan
    else:
        actual = np.array([point.actual for point in points])
        found = float(np.std(actual - actual[0], ddof=1)) if len(actual) > 1 else math.nan
    if found < 0:
        raise DataRefused(f"figure {settings.name!r}: an SD of {found:g}; above 0 is expected")
    return found if found > 0 else math.nan


def _row(
    settings: PredictedSettings, point: Point, sd: float, attribute: str | None, intervals: list[str]
) -> dict[str, Any]:
    known = not math.isnan(sd)
    return {
        "panel": _panel(settings, point),
        "stimulus": point.stimulus,
        **({"attribute": point.labels[attribute]} if attribute else {}),
        **({"colour": point.labels[settings.colour]} if settings.colour else {}),
        "actual": point.actual,
        "predicted": point.predicted,
        "error": point.error,
        **(
            {end: nan_to_none(point.more[name]) for end, name in zip(("low", "high"), intervals, strict=True)}
            if len(intervals) == 2
            else {}
        ),
        "sd": nan_to_none(sd),
        "within_half_sd": _within(point, INNER * sd) if known else None,
        "within_one_sd": _within(point, OUTER * sd) if known else None,
    }


def _within(point: Point, reach: float) -> bool:
    slack = ROUNDING_ULPS * math.ulp(max(abs(point.actual), abs(point.predicted), reach))
    return abs(point.error) <= reach + slack


def _words(settings: PredictedSettings, selected: Selected, rows: tuple[Row, ...]) -> dict[str, Any]:
    colours = [str(row["colour"]) for row in rows] if settings.colour else []
    levels = in_order(selected, settings.colour, colours) if settings.colour else ()
    names = pair_names(selected, {str(row["attribute"]) for row in rows if row.get("attribute")})
    return {
        "names": names,
        "scale": selected.scale,
        "unit": settings.unit,
        "colour": settings.colour or "",
        "colours": levels,
    }


def _caption(settings: PredictedSettings, column: str | None, rows: tuple[Row, ...]) -> str:
    if isinstance(settings.sd, float | int):
        source = f"an SD of {settings.sd:g}, as given"
    elif column is not None:
        source = f"the SD of the participants' ratings (root mean square of the column {column!r}"
        source += ", all rows)" if settings.band == "global" else ", each panel's rows)"
    else:
        source = "the SD of the actual values shown"
        source += ", not of single ratings" + (" (each panel's own)" if settings.band == "panel" else "")
    without = sorted({str(row["panel"]) for row in rows if row["sd"] is None})
    no_band = f" Without bands, as the SD is undefined or 0: {', '.join(without) or 'all'}." if without else ""
    by = f", a panel for each level of {settings.panels}" if settings.panels else ""
    return (
        f"Predicted against actual values{by}. Dashed: the line of identity; above it the prediction is too high. "
        f"Bands: ± 0.5 SD (dark) and ± 1 SD (light) around it, with {source}; in each panel the share of points "
        f"within each band, MAE and RMSE; open points lie outside ± 1 SD.{_whiskers(rows)}{no_band}"
    )


def _whiskers(rows: tuple[Row, ...]) -> str:
    return " Whiskers: the intervals of the predictions." if rows and "low" in rows[0] else ""


PREDICTED = FigureKind(PredictedSettings, data, draw, takes="table")
