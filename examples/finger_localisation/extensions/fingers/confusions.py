"""The figure: the confusion matrix of all people together, as percent of each finger's touches."""

from __future__ import annotations

from typing import Literal

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind, FigureSettings, Marks
from palpate.analysis.figures.style import PAPER, readable_ink, shade_scale
from palpate.analysis.statistics.refusals import TooFew

from .transmitted import TABLE, confusion_matrices


class Settings(FigureSettings):
    """The settings of the figure: only those of every figure."""

    figure: Literal["fingers.confusions"]


def data(inputs: FigureInput, settings: Settings) -> FigureData:
    """Return a row for each pair of a touched and a named finger: how often, and in percent of the touches.

    Raises TooFew without any answer.
    """
    people, fingers, counts = confusion_matrices(inputs.selected)
    if not people:
        raise TooFew("a matrix of answers needs somebody who answered, and there is nobody")
    totals = counts.sum(axis=0)
    touches = totals.sum(axis=1)
    rows = tuple(
        {
            "touched": touched,
            "named": named,
            "answers": int(totals[i, j]),
            "percent": float(100 * totals[i, j] / touches[i]) if touches[i] else None,
        }
        for i, touched in enumerate(fingers)
        for j, named in enumerate(fingers)
    )
    caption = f"Percent of each finger's touches, {int(touches.sum())} answers of {len(people)} people."
    return FigureData(rows, settings.title or "Touched and named fingers", caption, {"fingers": fingers})


def draw(data: FigureData) -> DrawnFigure:
    """Draw a square for each pair: touched fingers down, named ones across."""
    fingers, marks, shade = data.words["fingers"], Marks(), shade_scale()
    figure = Figure(figsize=(1.6 + 0.75 * len(fingers), 1.1 + 0.6 * len(fingers)), layout="constrained")
    axes = figure.subplots()
    for place, row in enumerate(data.rows):
        i, j = divmod(place, len(fingers))
        percent = row["percent"]
        colour = PAPER if percent is None else shade(Normalize(0, 100)(percent))
        square = Rectangle((j - 0.5, i - 0.5), 1, 1, facecolor=colour, edgecolor=PAPER)
        axes.add_patch(square)
        marks.add(square, tuple((name, str(row[name])) for name in ("touched", "named", "answers")), fingers[i])
        if percent:
            axes.text(j, i, f"{percent:.0f}", ha="center", va="center", color=readable_ink(colour))
    axes.set(xlim=(-0.5, len(fingers) - 0.5), ylim=(len(fingers) - 0.5, -0.5), xlabel="named", ylabel="touched")
    axes.set_xticks(np.arange(len(fingers)), fingers)
    axes.set_yticks(np.arange(len(fingers)), fingers)
    return DrawnFigure(figure, marks.all())


CONFUSIONS = FigureKind(Settings, data, draw, takes=TABLE)
