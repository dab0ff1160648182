"""Predicted against actual values, with the line of identity and bands of the ratings' SD (thesis 5.12, 5.13)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.analysis.figures.columns import bipolar_names, ordered_levels, to_float
from palpate.analysis.figures.figure_kind import MOST_MARKS, DrawnFigure, FigureData, FigureInput, FigureKind, Marks
from palpate.analysis.figures.lettering import decimals_for, fold, format_number, format_percent, shorten
from palpate.analysis.figures.predictions import Prediction, PredictionSettings, chosen_column, read_predictions
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, PAPER, SOFT, colours_and_shapes
from palpate.analysis.plans.answers import Row
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.undefined import nan_to_none

INNER, OUTER = 0.5, 1.0
ROUNDING_ULPS = 4
"""Tolerance in units of the last place by which a point on the edge of a band counts as within it, in any unit."""
OUTER_BAND, INNER_BAND, BAND_EDGE = "#dbe8f3", "#b3d0e8", "#8fb6d6"
WIDEST_IN = 13.0
GAP, FOOT = 0.2, 0.5


class PredictedSettings(PredictionSettings):
    """The settings of panels by a column (`panels`: a car, "attribute"), colours and shapes by another (`colour`).

    `sd` is the SD of the participants' ratings: a number, or a column with one SD for each row (its root mean square is
    taken); without either, the SD of the actual values is used and the caption says so. `band` says over which rows it
    is computed: all ("global") or those of a panel ("panel"). `low` and `high` are the ends of each prediction's
    interval, drawn as whiskers. `unit` is written at the axes.
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
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.panels is None:
            yield Idle("band", "without `panels`")
        elif not isinstance(self.sd, str):
            yield Idle("band", "with a number as `sd`")


def data(inputs: FigureInput, settings: PredictedSettings) -> FigureData:
    """Return one row per prediction with its error, its panel's SD and whether it is within each band.

    Raises DataRefused where a column is missing or an SD is negative.
    """
    selected = inputs.selected
    attribute = chosen_column(settings, "attribute", selected)
    labels = [name for name in (settings.panels, attribute, settings.colour) if name is not None]
    intervals = [
        name for name in (chosen_column(settings, end, selected) for end in ("low", "high")) if name is not None
    ]
    column = chosen_column(settings, "sd", selected) if isinstance(settings.sd, str) else None
    predictions = read_predictions(settings, selected, labels, [*intervals, *([column] if column else [])])
    panels = sorted({_panel_name(settings, point) for point in predictions.points})
    sds = dict.fromkeys(panels, math.nan)  # of each panel, NaN where it is undefined or 0
    for panel in panels:
        shared = settings.band == "global" or isinstance(settings.sd, float | int)
        own = (point for point in predictions.points if shared or _panel_name(settings, point) == panel)
        sds[panel] = _sd(settings, tuple(own), column)
    rows = tuple(
        _row(settings, point, sds[_panel_name(settings, point)], attribute, intervals) for point in predictions.points
    )
    caption = f"{_caption(settings, column, rows)}{predictions.note()}"
    colours = [str(row["colour"]) for row in rows] if settings.colour else []
    levels = ordered_levels(selected, settings.colour, colours) if settings.colour else ()
    names = bipolar_names(selected, {str(row["attribute"]) for row in rows if row.get("attribute")})
    words = {
        "names": names,
        "scale": selected.scale,
        "unit": settings.unit,
        "colour": settings.colour or "",
        "colours": levels,
    }
    return FigureData(rows, settings.title or "Predicted against actual values", caption, words)


def _panel_name(settings: PredictedSettings, point: Prediction) -> str:
    return point.labels[settings.panels] if settings.panels else ""


def _sd(settings: PredictedSettings, predictions: tuple[Prediction, ...], column: str | None) -> float:
    if isinstance(settings.sd, float | int):
        sd = float(settings.sd)
    elif column is not None:
        sds = np.array([prediction.more[column] for prediction in predictions])
        if np.any(sds < 0):
            raise DataRefused(f"figure {settings.name!r}: column {column!r} holds an SD below 0")
        known = sds[~np.isnan(sds)]
        sd = math.hypot(*known) / math.sqrt(len(known)) if len(known) else math.nan
    else:
        actual = np.array([prediction.actual for prediction in predictions])
        sd = float(np.std(actual - actual[0], ddof=1)) if len(actual) > 1 else math.nan
    if sd < 0:
        raise DataRefused(f"figure {settings.name!r}: an SD of {sd:g}; above 0 is expected")
    return sd if sd > 0 else math.nan


def _row(
    settings: PredictedSettings, point: Prediction, sd: float, attribute: str | None, intervals: list[str]
) -> dict[str, Any]:
    known = not math.isnan(sd)
    return {
        "panel": _panel_name(settings, point),
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


def _within(point: Prediction, reach: float) -> bool:
    slack = ROUNDING_ULPS * math.ulp(max(abs(point.actual), abs(point.predicted), reach))
    return abs(point.error) <= reach + slack


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
    whiskers = " Whiskers: the intervals of the predictions." if rows and "low" in rows[0] else ""
    return (
        f"Predicted against actual values{by}. Dashed: the line of identity; above it the prediction is too high. "
        f"Bands: ± 0.5 SD (dark) and ± 1 SD (light) around it, with {source}; in each panel the share of points "
        f"within each band, MAE and RMSE; open points lie outside ± 1 SD.{whiskers}{no_band}"
    )


def draw(data: FigureData) -> DrawnFigure:
    """Draw a square panel for each level, all with the same axes; points outside +-1 SD are open."""
    panels = list(dict.fromkeys(str(row["panel"]) for row in data.rows))
    values = [
        to_float(row[name])
        for row in data.rows
        for name in ("actual", "predicted", "low", "high")
        if row.get(name) is not None
    ]
    low, high = min(values), max(values)
    scale = data.words["scale"]
    if scale is not None and scale[0] <= low and high <= scale[1]:
        low, high = scale
    margin = 0.03 * (high - low) or 0.03 * abs(high) or 0.5
    limits, levels = (low - margin, high + margin), data.words["colours"]
    look = dict(zip(levels, colours_and_shapes(len(levels)), strict=True)) or {"": (OKABE_ITO[1], "o")}
    sheet = _sheet(data, panels, limits)
    wide, tall = sheet.size
    figure, marks = Figure(figsize=(wide, tall)), Marks()
    for place, panel in enumerate(panels):
        line, column = divmod(place, sheet.columns)
        top = sheet.key_high + line * (sheet.side + sheet.head) + sheet.head
        corner = (sheet.left + column * (sheet.side + GAP)) / wide, 1 - (top + sheet.side) / tall
        axes = figure.add_axes((*corner, sheet.side / wide, sheet.side / tall))
        rows = [row for row in data.rows if row["panel"] == panel]
        _draw_panel(axes, rows, limits, sheet.side)
        axes.tick_params(labelleft=place % sheet.columns == 0, labelbottom=place + sheet.columns >= len(panels))
        _draw_points(axes, marks, rows, look, len(data.rows) <= MOST_MARKS)
        axes.set_title(sheet.titles[place], fontsize=sheet.title_pt)
    written = f" ({data.words['unit']})" if data.words["unit"] else ""
    middle = (sheet.left + (wide - GAP)) / 2 / wide, 1 - (sheet.key_high + (tall - FOOT)) / 2 / tall
    figure.text(middle[0], 0.12 / tall, f"actual{written}", ha="center", va="center", fontsize=9.5)
    figure.text(0.14 / wide, middle[1], f"predicted{written}", ha="center", va="center", rotation=90, fontsize=9.5)
    if sheet.keys:
        handles = [
            Line2D([], [], linestyle="", marker=shape, markersize=5.5, markerfacecolor=colour, markeredgecolor=PAPER)
            for colour, shape in look.values()
        ]
        figure.legend(
            handles, sheet.keys, loc="upper left", bbox_to_anchor=(sheet.left / wide, 1 - 0.02 / tall), borderaxespad=0,
            ncols=sheet.key_columns, frameon=False, fontsize=8, labelcolor=SOFT, handletextpad=0.2, columnspacing=1.2,
        )  # fmt: skip
    return DrawnFigure(figure, marks.all())


@dataclass(frozen=True)
class _Sheet:
    """The figure's measures in inches, set by hand because ninety panels would keep a layout engine busy for long."""

    columns: int
    lines: int
    side: float
    left: float
    titles: tuple[str, ...]
    title_pt: float
    keys: tuple[str, ...]
    key_columns: int

    @property
    def head(self) -> float:
        """The height of a panel's title."""
        return 0.1 + 1.35 * self.title_pt / 72 * max(title.count("\n") + 1 for title in self.titles)

    @property
    def key_high(self) -> float:
        """The height of the key."""
        return 0.1 + 0.19 * math.ceil(len(self.keys) / self.key_columns) if self.keys else 0.04

    @property
    def size(self) -> tuple[float, float]:
        """The width and height."""
        wide = self.left + self.columns * (self.side + GAP)
        return wide, FOOT + self.lines * (self.side + self.head) + self.key_high


def _sheet(data: FigureData, panels: Sequence[str], limits: tuple[float, float]) -> _Sheet:
    columns = grid_columns(len(panels))
    side = min(2.6 if len(panels) > 1 else 4.2, WIDEST_IN / columns - GAP)
    titles = tuple(fold(_level_name(data, panel), max(8, int(9.5 * side))) for panel in panels)
    keys = tuple(shorten(_level_name(data, level), 40) for level in data.words["colours"])
    left = 0.5 + 0.075 * min(max(len(f"{limit:.4g}") for limit in limits), 9)
    across = max(1, int((columns * (side + GAP)) / (0.42 + 0.072 * max(map(len, keys), default=1))))
    title_pt = 10.0 if side > 1.8 else 7.0
    return _Sheet(columns, math.ceil(len(panels) / columns), side, left, titles, title_pt, keys, across)


def _level_name(data: FigureData, level: str) -> str:
    return str(data.words["names"].get(level, level))


def grid_columns(panels: int) -> int:
    """Return the number of columns with the fewest empty places, between the number of rows and 1.6 times that."""
    least = math.ceil(math.sqrt(panels))
    return min(range(least, max(least, math.floor(1.6 * math.sqrt(panels))) + 1), key=lambda c: (-panels % c, c))


def _draw_panel(axes: Axes, rows: Sequence[Row], limits: tuple[float, float], side: float) -> None:
    """Draw the bands, the line of identity, and in the two empty corners the shares within the bands."""
    axes.set(xlim=limits, ylim=limits, aspect="equal")
    axes.tick_params(labelsize=8 if side > 1.8 else 6)
    axes.locator_params(nbins=5 if side > 1.8 else 3)
    axes.grid(visible=True, color=FAINT, linewidth=0.4)
    ends, sd = np.array(limits), rows[0]["sd"]
    if sd is not None:
        for reach, colour in ((1.0, OUTER_BAND), (0.5, INNER_BAND)):
            spread = reach * to_float(sd)
            axes.fill_between(ends, ends - spread, ends + spread, color=colour, linewidth=0, zorder=1.1)
            for sign in (-1, 1):
                axes.plot(ends, ends + sign * spread, color=BAND_EDGE, linewidth=0.5, zorder=1.2)
    axes.plot(ends, ends, color=INK, linewidth=1.0, linestyle=(0, (4, 3)), zorder=1.4)
    size = 7.5 if side > 1.8 else 4.8
    boxed: dict[str, Any] = {"facecolor": PAPER, "alpha": 0.75, "edgecolor": "none", "pad": 1.0}
    place: dict[str, Any] = {"transform": axes.transAxes, "fontsize": size, "color": INK, "zorder": 5, "bbox": boxed}
    shares, counts = "", f"n {len(rows)}"
    if sd is not None:
        within = (sum(bool(row[name]) for row in rows) / len(rows) for name in ("within_half_sd", "within_one_sd"))
        inner, outer = map(format_percent, within)
        shares = f"± 0.5 SD: {inner}\n± 1 SD: {outer}" if side > 1.8 else f"{inner}\n{outer}"
    if side > 1.8:
        errors = np.array([to_float(row["error"]) for row in rows])
        largest = float(np.max(np.abs(errors))) or 1.0
        mae, rmse = float(np.mean(np.abs(errors))), largest * float(np.sqrt(np.mean((errors / largest) ** 2)))
        digits = decimals_for([rmse])
        counts = f"n = {len(rows)}\nMAE {format_number(mae, digits)}\nRMSE {format_number(rmse, digits)}"
    axes.text(0.03, 0.97, shares, va="top", **place)
    axes.text(0.97, 0.03, counts, va="bottom", ha="right", **place)


def _draw_points(axes: Axes, marks: Marks, rows: Sequence[Row], look: Mapping[str, tuple[str, str]], few: bool) -> None:
    for row in rows:
        colour, shape = look[str(row.get("colour", ""))]
        outside = row["within_one_sd"] is False
        face = PAPER if outside else colour
        if row.get("low") is not None and row.get("high") is not None:
            axes.plot(
                [to_float(row["actual"])] * 2,
                [to_float(row["low"]), to_float(row["high"])],
                color=colour,
                linewidth=0.7,
                alpha=0.7,
                zorder=2,
            )
        style: dict[str, Any] = {"markerfacecolor": face, "markeredgecolor": colour if outside else PAPER}
        size: dict[str, Any] = {"markersize": 4.6, "markeredgewidth": 1.0 if outside else 0.4}
        (point,) = axes.plot(
            [to_float(row["actual"])],
            [to_float(row["predicted"])],
            linestyle="",
            marker=shape,
            zorder=3,
            **style,
            **size,
        )
        if few:
            marks.add(point, details(row), str(row["stimulus"]))


def details(row: Row) -> tuple[tuple[str, str], ...]:
    """Return the names and values of a point's mark."""
    names = [(name, str(row[name])) for name in ("stimulus", "attribute", "panel", "colour") if row.get(name)]
    different = list({text: (name, text) for name, text in reversed(names)}.values())[::-1]
    error, digits = row["error"], decimals_for([to_float(row[name]) for name in ("actual", "predicted")])
    values = [(name, format_number(to_float(row[name]), digits)) for name in ("actual", "predicted")]
    sd = row["sd"]
    in_sd = [("error in SD", format_number(to_float(error) / to_float(sd), 2))] if sd is not None else []
    return (*different, *values, ("error", format_number(to_float(error), digits)), *in_sd)


PREDICTED = FigureKind(PredictedSettings, data, draw, takes="table")
