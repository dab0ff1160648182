"""Psychometric functions with their bands and thresholds; shares of hits are bubbles of the size of their number."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

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

if TYPE_CHECKING:
    from collections.abc import Sequence

    from palpate.analysis.plans.answers import Row

COLUMNS = ("panel", "shows", "level", "share", "low", "high", "n", "note")
MOST_CIRCLES = 12
"""Circles of a panel, at most."""
LARGEST = 150.0
"""The area of the largest bubble in square points."""


class PsychometricSettings(FunctionSettings):
    """The settings of a figure of psychometric functions."""

    figure: Literal["psychometric"]


def data(inputs: FigureInput, settings: PsychometricSettings) -> FigureData:
    """Return rows of three kinds (`shows`): the shares at each "level", points of the "curve", each "threshold"."""
    answer, by = functions_of(inputs, settings)
    rows: list[Row] = []
    by_panel: dict[str, list[Row]] = {}
    for row in answer.more["levels"]:
        by_panel.setdefault(name_of(row, by), []).append(row)
    for panel, levels in by_panel.items():
        rows += [row_of(COLUMNS, panel=panel, shows="level", **own) for own in pooled(levels)]
    for row in answer.more["curve"]:
        own = {key: row[key] for key in ("level", "share", "low", "high")}
        rows.append(row_of(COLUMNS, panel=name_of(row, by), shows="curve", **own))
    for row in answer.rows:
        own = {
            "level": row["threshold"],
            "low": row["threshold_low"],
            "high": row["threshold_high"],
            "n": row["trials"],
        }
        rows.append(
            row_of(COLUMNS, panel=name_of(row, by), shows="threshold", share=row["guess"], note=note_of(row), **own)
        )
    caption = (
        "Circles are shares of hits, their area the number of trials; of adaptive tracks neighbouring levels are taken "
        "together until a circle has a twelfth of the trials. The line is the function expected by the "
        "posterior, its band the pointwise 95 % interval; the diamond is the threshold with its interval. "
        f"{answer.method}."
    )
    return FigureData(tuple(rows), settings.title or "Psychometric functions.", caption, words_of(inputs, settings))


def pooled(levels: Sequence[Row]) -> list[dict[str, float]]:
    """Return {level, share, n} of levels, neighbours being taken together until they have a twelfth of the trials.

    An adaptive track has many levels of one or two trials, whose shares are 0, one half or 1.
    """
    ordered = sorted(levels, key=lambda row: float(row["level"] or 0))
    enough = sum(float(row["n"] or 0) for row in ordered) / MOST_CIRCLES
    groups: list[list[Row]] = [[]]
    for row in ordered:
        groups[-1].append(row)
        if sum(float(one["n"] or 0) for one in groups[-1]) >= enough:
            groups.append([])
    if len(groups) > 1:
        last = groups.pop()
        groups[-1] += last  # what is left at the upper end is no group of its own
    made = []
    for group in groups:
        n = sum(float(row["n"] or 0) for row in group)
        hits = sum(float(row["share"] or 0) * float(row["n"] or 0) for row in group)
        level = sum(float(row["level"] or 0) * float(row["n"] or 0) for row in group) / n
        made.append({"level": level, "share": hits / n, "n": n})
    return made


def draw(data: FigureData) -> DrawnFigure:
    """Draw a panel for each function, all with the same axes."""
    names = list(dict.fromkeys(str(row["panel"]) for row in data.rows))
    figure, axes = panels(names, int(data.words["columns"]), (data.words["level"], "share of hits"))
    marks = Marks()
    curves = [row for row in data.rows if row["shows"] == "curve"]
    drawn_at = [float(row["level"] or 0) for row in curves or data.rows if row["level"] is not None]
    most = max(float(row["n"] or 1) for row in data.rows if row["shows"] == "level")
    lowest = min(float(row["share"] or 0) for row in data.rows if row["shows"] == "level")
    lowest = min([lowest, *(float(row["low"] or 0) for row in curves)])
    floor = 0.42 if lowest > 0.42 else min(0.0, lowest) - 0.03
    for name, panel in axes.items():
        own = [row for row in data.rows if row["panel"] == name]
        line = [row for row in own if row["shows"] == "curve"]
        x = [float(row["level"] or 0) for row in line]
        lower, upper = ([float(row[end] or 0) for row in line] for end in ("low", "high"))
        panel.fill_between(x, lower, upper, color=tint(OKABE_ITO[0], 0.22), linewidth=0, zorder=1)
        panel.plot(x, [float(row["share"] or 0) for row in line], color=OKABE_ITO[0], linewidth=1.6, zorder=2)
        for row in own:
            if row["shows"] == "level":
                level, share, n = float(row["level"] or 0), float(row["share"] or 0), float(row["n"] or 0)
                bubble = panel.scatter(
                    [level], [share], s=max(LARGEST * n / most, 6.0), facecolor=tint(OKABE_ITO[1], 0.75),
                    edgecolor=PAPER, linewidth=0.7, zorder=3, clip_on=False,
                )  # fmt: skip
                details = (("function", name), ("level", format_number(level)), ("share", format_number(share)))
                marks.add(bubble, (*details, ("trials", f"{n:.0f}")), name)
            elif row["shows"] == "threshold":
                _draw_threshold(panel, row, floor, marks)
        panel.set_ylim(floor, 1.02)
        room = 0.02 * (max(drawn_at) - min(drawn_at))
        panel.set_xlim(min(drawn_at) - room, max(drawn_at) + room)
        if floor > 0.4:
            panel.axhline(0.5, color=SOFT, linewidth=0.7, linestyle=(0, (1, 2.5)), zorder=1)
    return DrawnFigure(figure, marks.all())


def _draw_threshold(panel: Any, row: Row, floor: float, marks: Marks) -> None:
    """Draw the threshold and its interval just above the floor; an inequality in words."""
    height = floor + 0.035 * (1.02 - floor)
    if row["level"] is None:
        write_note(panel, row, (0.97, 0.06), "right")
        return
    level = float(row["level"])
    if row["low"] is not None and row["high"] is not None:
        panel.hlines([height], float(row["low"]), float(row["high"]), color=INK, linewidth=1.2, zorder=4)
    (point,) = panel.plot([level], [height], "D", color=INK, markersize=4.5, markeredgecolor=PAPER, zorder=5)
    ends = " to ".join(format_number(None if row[end] is None else float(row[end])) for end in ("low", "high"))  # type: ignore[arg-type]
    marks.add(
        point,
        (("function", str(row["panel"])), ("threshold", format_number(level)), ("interval", ends)),
        str(row["panel"]),
    )


PSYCHOMETRIC = FigureKind(PsychometricSettings, data, draw, takes="choices")
