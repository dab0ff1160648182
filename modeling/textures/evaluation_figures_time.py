"""Error against time: how far off the felt levels are, by the time of a step in every runtime and of the training."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.analysis.figures.style import INK, OKABE_ITO, drawing
from palpate.analysis.reports.figures import DrawnFigure, drawn_figure
from palpate.modeling.textures import evaluation_words as words
from palpate.modeling.textures.evaluation import TextureEvaluation
from palpate.modeling.textures.evaluation_panels import named
from palpate.modeling.textures.evaluation_tables import Row, method_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (*OKABE_ITO, INK)
SHAPES = ("o", "s")
"""Of the first methods, and of those for which the colours come round again."""
Look = tuple[str, str]


def time_figures(evaluation: TextureEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """The figure, where methods ran free and a step or a training was timed."""
    rows = [row for row in method_rows(evaluation) if row["felt_dB"] is not None]
    if any(row["step_us"] or row["train_s"] for row in rows):
        with drawing("work_precision"):
            figure = _figure(evaluation, rows)
            yield drawn_figure("work_precision", "Error against time", words.WORK_PRECISION, figure, folder)


def _figure(evaluation: TextureEvaluation, rows: list[Row]) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    looks = {row["method"]: (COLOURS[i % 8], SHAPES[i // 8 % 2]) for i, row in enumerate(rows)}
    figure = Figure(figsize=(9.2, 3.6), layout="constrained")
    step, training = figure.subplots(1, 2, sharey=True)
    for row in rows:
        medians = [median for median, _, _ in evaluation.steps.get(row["method"], {}).values()]
        _points(step, medians, row["felt_dB"], looks[row["method"]])
        _points(training, [row["train_s"]] if row["train_s"] else [], row["felt_dB"], looks[row["method"]])
    _named(step, "a step, µs (median)", "felt levels off, dB")
    _named(training, "training of a texture, s", "")
    step.set_ylim(bottom=0)
    handles = [Line2D([], [], color=colour, marker=shape, linestyle="") for colour, shape in looks.values()]
    figure.legend(handles, [row["title"] for row in rows], loc="outside upper left", frameon=False, ncols=3)
    return figure


def _points(axes: Axes, times: list[float], error: float, look: Look) -> None:
    """The fastest filled, the others open, and a line between them."""
    colour, shape = look
    for i, time in enumerate(sorted(times)):
        face = colour if i == 0 else "white"
        axes.plot([time], [error], shape, color=colour, markerfacecolor=face, markersize=6, zorder=3)
    axes.plot(sorted(times), [error] * len(times), color=colour, linewidth=0.8)


def _named(axes: Axes, along: str, up: str) -> None:
    from matplotlib.ticker import FuncFormatter, NullFormatter

    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(x=0.08)
    axes.grid(visible=True)
    named(axes, along, up)
