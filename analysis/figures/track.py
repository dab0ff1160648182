"""Tracks of adaptive procedures: the level of each trial, hits and misses, reversals, and the threshold estimated."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Literal

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
from palpate.analysis.figures.lettering import format_number
from palpate.analysis.figures.style import INK, OKABE_ITO, PAPER, SOFT, tint
from palpate.analysis.ratings.dataset import DataRefused

if TYPE_CHECKING:
    from collections.abc import Sequence

    from palpate.analysis.plans.answers import Row

COLUMNS = ("panel", "shows", "n", "level", "hit", "reversal", "low", "high", "note")


class TrackSettings(FunctionSettings):
    """The settings of a figure of tracks."""

    figure: Literal["track"]


def data(inputs: FigureInput, settings: TrackSettings) -> FigureData:
    """Return a row for each "trial" of an adaptive track and one for each "threshold"; one without a level has a note.

    Raises DataRefused where no function of the test is of a staircase, QUEST+ or the method of limits.
    """
    answer, by = functions_of(inputs, settings)
    adaptive = {name_of(row, by): row for row in answer.rows if row["procedure"] not in (None, "constant")}
    if not adaptive:
        raise DataRefused(f"figure {settings.name!r}: no function of the test is of a track whose levels change")
    rows: list[Row] = []
    for name, row in adaptive.items():
        trials = [trial for trial in answer.more["trials"] if name_of(trial, by) == name]
        moving = [float(trial["level"] or 0) for trial in trials]
        turns = _reversals(moving) if row["procedure"] == "staircase" else {}
        rows += [
            row_of(
                COLUMNS,
                panel=name,
                shows="trial",
                n=n,
                level=trial["level"],
                hit=trial["correct"],
                reversal=turns.get(n - 1),
            )
            for n, trial in enumerate(trials, start=1)
        ]
        ends = {"low": row["threshold_low"], "high": row["threshold_high"]}
        rows.append(row_of(COLUMNS, panel=name, shows="threshold", level=row["threshold"], note=note_of(row), **ends))
    caption = (
        "The level of each trial, catch trials left out: filled circles are hits, hollow ones misses, triangles mark "
        "reversals of staircases. The dashed line is the threshold, the band its interval; words stand for a threshold "
        f"that is not within the levels. {answer.method}."
    )
    return FigureData(tuple(rows), settings.title or "Tracks of the levels.", caption, words_of(inputs, settings))


def _reversals(levels: Sequence[float]) -> dict[int, str]:
    """Return the places of the last trials at a level where the moves turn, as peak or valley (Levitt 1971)."""
    moves = [(i, b - a) for i, (a, b) in enumerate(pairwise(levels)) if a != b]
    return {
        i: "peak" if before > 0 else "valley"
        for (_, before), (i, after) in pairwise(moves)
        if (before > 0) != (after > 0)
    }


def draw(data: FigureData) -> DrawnFigure:
    """Draw a panel for each track, all with the same levels."""
    names = list(dict.fromkeys(str(row["panel"]) for row in data.rows))
    figure, axes = panels(names, int(data.words["columns"]), ("trial", data.words["level"]))
    marks = Marks()
    levels = [float(row["level"] or 0) for row in data.rows if row["shows"] == "trial"]
    room = 0.06 * ((max(levels) - min(levels)) or 1.0)
    for name, panel in axes.items():
        trials = [row for row in data.rows if row["panel"] == name and row["shows"] == "trial"]
        x, y = [int(row["n"] or 0) for row in trials], [float(row["level"] or 0) for row in trials]
        panel.plot(x, y, color=tint(SOFT, 0.6), linewidth=0.8, zorder=2)
        for row, at, level in zip(trials, x, y, strict=True):
            hit = bool(row["hit"])
            (point,) = panel.plot(
                [at], [level], "o", markersize=3.6, markerfacecolor=OKABE_ITO[0] if hit else PAPER,
                markeredgecolor=OKABE_ITO[0], markeredgewidth=0.9, zorder=3,
            )  # fmt: skip
            answer = ("answer", "hit" if hit else "miss")
            marks.add(point, (("track", name), ("trial", str(at)), ("level", format_number(level)), answer), name)
        for kind, marker, side in (("peak", "v", 0.7), ("valley", "^", -0.7)):
            turned = [(at, level) for row, at, level in zip(trials, x, y, strict=True) if row["reversal"] == kind]
            panel.plot(
                [at for at, _ in turned], [level + side * room for _, level in turned], marker, color=OKABE_ITO[1],
                markersize=3.6, linestyle="none", zorder=4,
            )  # fmt: skip
        for row in data.rows:
            if row["panel"] == name and row["shows"] == "threshold" and row["level"] is None:
                write_note(panel, row, (0.97, 0.06), "right")
            elif row["panel"] == name and row["shows"] == "threshold":
                panel.axhline(float(row["level"] or 0), color=INK, linewidth=1.0, linestyle=(0, (4, 2)), zorder=2.5)
                if row["low"] is not None and row["high"] is not None:
                    panel.axhspan(float(row["low"]), float(row["high"]), color=tint(OKABE_ITO[4], 0.3), lw=0, zorder=1)
        panel.set_ylim(min(levels) - 1.5 * room, max(levels) + 1.5 * room)
        panel.set_xlim(0, max(x) + 1)
    return DrawnFigure(figure, marks.all())


TRACK = FigureKind(TrackSettings, data, draw, takes="choices")
