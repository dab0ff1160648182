"""What figures of psychometric functions share: a panel for each function of a test, and its settings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from matplotlib.figure import Figure
from pydantic import Field

from palpate.analysis.figures.columns import answer_of_test
from palpate.analysis.figures.figure_kind import FigureInput, FigureSettings, rows_without_effect
from palpate.analysis.figures.lettering import elide, format_number, letters_that_fit
from palpate.analysis.figures.style import FAINT, INK, PAPER, SOFT, quiet_axes
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.study import Whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.plans.answers import Answer, Row

MOST = 24
PANEL_IN = (2.75, 2.25)
NAMED = ("level", "share", "low", "high", "n", "hits", "expected", "deviance_residual", "correct")
"""Columns of the tables beside a test's rows that do not name its functions."""


class FunctionSettings(FigureSettings):
    """The settings of a figure with a panel for each function of a test `psychometric` with `source: choices`.

    `columns` is the number of panels in a row.
    """

    columns: Annotated[Whole, Field(ge=1, le=6)] = 3

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from rows_without_effect("in this figure, which shows the functions of its test as they are")


def functions_of(inputs: FigureInput, settings: FunctionSettings) -> tuple[Answer, tuple[str, ...]]:
    """Return the answer that the figure shows, and the columns that name a function.

    Raises DataRefused where the test has no functions, or more than 24.
    """
    name = settings.tests[0] if settings.tests else ""
    answer = answer_of_test(settings, inputs, name)
    if "curve" not in answer.more or "trials" not in answer.more:
        raise DataRefused(
            f"figure {settings.name!r}: `tests` must name a test of kind psychometric with `source: choices`"
        )
    if len(answer.rows) > MOST:
        raise DataRefused(
            f"figure {settings.name!r}: {len(answer.rows)} functions; up to {MOST} have a place, name fewer in the"
            " `where` of the test"
        )
    return answer, tuple(key for key in answer.more["trials"][0] if key not in NAMED)


def words_of(inputs: FigureInput, settings: FunctionSettings) -> dict[str, Any]:
    """Return the number of panels in a row, and the name of the levels: their column, where all tracks have one."""
    columns = {track.procedure.grids[0].column for track in inputs.selected.tracks.values()}
    return {"columns": settings.columns, "level": columns.pop() if len(columns) == 1 else "level"}


def name_of(row: Row, by: Sequence[str]) -> str:
    """Return the name of a function's panel."""
    return ", ".join(str(row[key]) for key in by) or "all choices"


def row_of(columns: Sequence[str], **values: Any) -> dict[str, Any]:
    """Return a row of a figure's data: a column without a value is None, a note without one is empty."""
    return {name: values.get(name, "" if name == "note" else None) for name in columns}


def note_of(row: Row) -> str:
    """Return what is said of a function whose threshold is not within the levels; "" if it is."""
    bound = "" if row["bound"] is None else f" {format_number(float(row['bound']), 1)}"
    return "" if row["outside"] is None else f"threshold {row['outside']}{bound}"


def write_note(panel: Axes, row: Row, at: tuple[float, float], align: Literal["right", "center"]) -> None:
    """Write into a panel, at shares of its width and height, why a function has no threshold."""
    panel.text(
        *at, str(row["note"] or "no threshold"), transform=panel.transAxes, ha=align, fontsize=7.5, color=INK,
        bbox={"facecolor": PAPER, "edgecolor": FAINT, "boxstyle": "round,pad=0.3", "linewidth": 0.6}, zorder=5,
    )  # fmt: skip


def panels(names: Sequence[str], columns: int, labels: tuple[str, str]) -> tuple[Figure, Mapping[str, Axes]]:
    """Return a figure with a titled panel for each name; the labels of axes stand once."""
    across = min(columns, len(names))
    down = math.ceil(len(names) / across)
    figure = Figure(figsize=(PANEL_IN[0] * across + 0.4, PANEL_IN[1] * down + 0.35), layout="constrained")
    axes = figure.subplots(down, across, squeeze=False)
    result: dict[str, Any] = {}
    for n, name in enumerate(names):
        panel = axes[n // across][n % across]
        panel.set_title(elide(name, letters_that_fit(PANEL_IN[0] - 0.5)), fontsize=9)
        panel.tick_params(labelsize=8)
        quiet_axes(panel)
        result[name] = panel
    for n in range(len(names), across * down):
        axes[n // across][n % across].set_axis_off()
    figure.supxlabel(labels[0], fontsize=9, color=SOFT)
    figure.supylabel(labels[1], fontsize=9, color=SOFT)
    return figure, result
