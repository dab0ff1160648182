"""Error against time: the MAE of each method by the time of a fold's training and of one answer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.analysis.figures.style import INK, OKABE_ITO, drawing
from palpate.analysis.reports.figures import DrawnFigure, drawn_figure
from palpate.modeling.attributes import evaluation_words as words
from palpate.modeling.attributes.evaluation_tables import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS, SHAPES = (INK, *OKABE_ITO), ("o", "s", "D")
"""A shape for each round of the colours."""
PANELS = (("train_s", "training of a fold, s"), ("answer_s", "answer for a texture, s"))


def time_figures(rows: Sequence[Row], folder: Path) -> Iterator[DrawnFigure]:
    """The figure, where methods were judged."""
    judged = [row for row in rows if row["mae"] is not None]
    if judged:
        with drawing("work_precision"):
            title = "Error against time"
            yield drawn_figure("work_precision", title, words.WORK_PRECISION, _figure(judged), folder)


def _figure(rows: Sequence[Row]) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    looks = [(COLOURS[i % len(COLOURS)], SHAPES[i // len(COLOURS) % len(SHAPES)]) for i in range(len(rows))]
    figure = Figure(figsize=(9.2, 4.0), layout="constrained")
    grid = figure.subplots(1, len(PANELS), sharey=True)
    for axes, (column, label) in zip(grid, PANELS, strict=True):
        for row, (colour, shape) in zip(rows, looks, strict=True):
            if row[column]:
                axes.plot([row[column]], [row["mae"]], shape, color=colour, markersize=6)
        _named(axes, label)
    grid[0].set_ylabel("MAE, 0 to 100")
    grid[0].set_ylim(bottom=0)
    handles = [Line2D([], [], color=colour, marker=shape, linestyle="") for colour, shape in looks]
    figure.legend(handles, [row["title"] for row in rows], loc="outside upper left", frameon=False, ncols=3)
    return figure


def _named(axes: Axes, label: str) -> None:
    from matplotlib.ticker import FuncFormatter, NullFormatter

    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(label)
    axes.margins(x=0.1)
    axes.grid(visible=True)
