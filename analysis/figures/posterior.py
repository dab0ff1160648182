"""The posterior of thresholds: a density for each function of a test, with its interval, its estimate and the prior."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from palpate.analysis.figures.columns import to_float
from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind, Marks
from palpate.analysis.figures.function_panels import (
    FunctionSettings,
    functions_of,
    name_of,
    note_of,
    panels,
    row_of,
    words_of,
    write_note,
)
from palpate.analysis.figures.lettering import format_interval, format_number
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, PAPER, SOFT, tint
from palpate.analysis.ratings.dataset import DataRefused

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row

COLUMNS = ("panel", "shows", "level", "density", "prior_density", "low", "high", "bound", "note")
NEGLIGIBLE = 0.015
"""The share of the highest density below which a density is not shown."""
FLOOR = -0.2
"""The lower end of a panel, in units of the highest density: room for the interval."""


class PosteriorSettings(FunctionSettings):
    """The settings of a figure of the posterior of thresholds."""

    figure: Literal["posterior"]


def data(inputs: FigureInput, settings: PosteriorSettings) -> FigureData:
    """Return a row for each point of a "density", and one for each "threshold" with its interval or inequality.

    Raises DataRefused where no function of the test has a posterior.
    """
    answer, by = functions_of(inputs, settings)
    rows: list[Row] = []
    for row in answer.more.get("posterior", ()):
        own = {key: row[key] for key in ("level", "density", "prior_density")}
        rows.append(row_of(COLUMNS, panel=name_of(row, by), shows="density", **own))
    if not rows:
        raise DataRefused(f"figure {settings.name!r}: no function of the test has a posterior")
    drawn = {row["panel"] for row in rows}
    for row in answer.rows:
        name = name_of(row, by)
        ends = {"low": row["threshold_low"], "high": row["threshold_high"], "bound": row["bound"]}
        if name in drawn:
            rows.append(
                row_of(COLUMNS, panel=name, shows="threshold", level=row["threshold"], note=note_of(row), **ends)
            )
    caption = (
        "The density of the threshold after the answers (filled) and before them (dotted), each panel with a height of "
        f"its own; the diamond is the estimate, the bar its interval. {answer.method}."
    )
    return FigureData(tuple(rows), settings.title or "Posterior of thresholds.", caption, words_of(inputs, settings))


def draw(data: FigureData) -> DrawnFigure:
    """Draw a panel for each function, all with the same levels."""
    names = list(dict.fromkeys(str(row["panel"]) for row in data.rows))
    figure, axes = panels(
        names,
        int(data.words["columns"]),
        (f"threshold, {data.words['level']}" if data.words["level"] != "level" else "threshold", "density"),
    )
    marks = Marks()
    shown: list[float] = []
    placed = {row["panel"] for row in data.rows if row["shows"] == "threshold" and row["level"] is not None}
    for name, panel in axes.items():
        points = [row for row in data.rows if row["panel"] == name and row["shows"] == "density"]
        x, y, before = ([float(row[key] or 0) for row in points] for key in ("level", "density", "prior_density"))
        top = max(y)
        if name in placed or not placed:
            shown += [at for at, height in zip(x, y, strict=True) if height > NEGLIGIBLE * top]
        y, before = [height / top for height in y], [height / top for height in before]
        panel.fill_between(x, 0, y, color=tint(OKABE_ITO[0], 0.28), linewidth=0, zorder=2)
        panel.plot(x, y, color=OKABE_ITO[0], linewidth=1.5, zorder=3)
        panel.plot(x, before, color=SOFT, linewidth=1.0, linestyle=(0, (1, 1.6)), zorder=3.5)
        panel.axhline(0, color=FAINT, linewidth=0.8, zorder=1)
        panel.set_ylim(FLOOR, 1.08)
        panel.set_yticks([])
        panel.spines["left"].set_visible(False)
        for row in data.rows:
            if row["panel"] == name and row["shows"] == "threshold":
                _draw_threshold(panel, row, marks)
                ends = (row["level"], row["low"], row["high"], row["bound"])
                shown += [float(end) for end in ends if end is not None]
    room = 0.08 * ((max(shown) - min(shown)) or 1.0)
    for panel in axes.values():
        panel.set_xlim(min(shown) - room, max(shown) + room)
    return DrawnFigure(figure, marks.all())


def _draw_threshold(panel: Any, row: Row, marks: Marks) -> None:
    """Draw the estimate and its interval below the density; an inequality in words."""
    if row["level"] is None:
        write_note(panel, row, (0.5, 0.03), "center")
        return
    level, height = float(row["level"]), FLOOR / 2
    low, high = (None if row[end] is None else to_float(row[end]) for end in ("low", "high"))
    if low is not None and high is not None:
        panel.hlines([height], low, high, color=INK, linewidth=1.3, zorder=4)
    panel.vlines([level], 0, 1, color=INK, linewidth=0.7, linestyle=(0, (3, 2)), zorder=2.5)
    (point,) = panel.plot([level], [height], "D", color=INK, markersize=4.8, markeredgecolor=PAPER, zorder=5)
    name = str(row["panel"])
    marks.add(
        point, (("function", name), ("threshold", format_number(level)), ("interval", format_interval(low, high))), name
    )


POSTERIOR = FigureKind(PosteriorSettings, data, draw, takes="choices")
