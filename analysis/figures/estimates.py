"""The estimates of a test as a dot plot: a line for each item, with its value and its interval."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from matplotlib.figure import Figure

from palpate.analysis.figures.columns import answer_of_test, to_float
from palpate.analysis.figures.figure_kind import (
    DrawnFigure,
    FigureData,
    FigureInput,
    FigureKind,
    FigureSettings,
    Marks,
    rows_without_effect,
)
from palpate.analysis.figures.lettering import decimals_for, format_interval, format_number, shorten
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, PAPER
from palpate.analysis.plans.answers import Answer
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.study import Text
from palpate.protocols.undefined import nan_to_none
from palpate.protocols.wording import count

LINE_IN, TOP_IN = 0.27, 0.75
"""The height of a line, and of axis and margins together, in inches."""
LONGEST_NAME = 40


class EstimatesSettings(FigureSettings):
    """The settings of a dot plot of the one test that `tests` names.

    `label`, `value`, `low` and `high` are columns of the test's table: names of the lines, values, ends of intervals.
    `sort`: the greatest value first, or the order of the table.
    """

    not_columns: ClassVar[frozenset[str]] = frozenset({"value"})
    figure: Literal["estimates"]
    label: Text = "item"
    value: Text = "value"
    low: Text = "ci_low"
    high: Text = "ci_high"
    sort: Literal["by_value", "as_listed"] = "by_value"

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from rows_without_effect("in this figure, which shows the table of its test as it is")


def data(inputs: FigureInput, settings: EstimatesSettings) -> FigureData:
    """Return a row for each line of the test's table: name, value, ends of the interval.

    Raises DataRefused unless the figure names one test whose table has these columns, with a value in some row.
    """
    where = f"figure {settings.name!r}"
    if len(settings.tests) != 1:
        raise DataRefused(f"{where}: `tests` must name the one test to show, found {len(settings.tests)}")
    answer = answer_of_test(settings, inputs, settings.tests[0])
    columns = list(answer.rows[0]) if answer.rows else []
    for name in (settings.label, settings.value, settings.low, settings.high):
        if name not in columns:
            raise DataRefused(
                f"{where}: the test {settings.tests[0]!r} has no column {name!r}; {nearest(name, columns)}"
            )
    rows = [
        {"name": str(row[settings.label]), **{key: row[column] for key, column in _numbers(settings)}}
        for row in answer.rows
        if row[settings.value] is not None
    ]
    if not rows:
        raise DataRefused(f"{where}: no row of the test {settings.tests[0]!r} has a value in {settings.value!r}")
    if settings.sort == "by_value":
        rows.sort(key=lambda row: (-to_float(row["value"]), row["name"]))
    unit = answer.kinds.get(settings.value)
    words = {"axis": settings.value if unit is None else f"{settings.value} ({unit})"}
    return FigureData(tuple(rows), settings.title or "Estimates.", _caption(settings, answer, len(rows)), words)


def _numbers(settings: EstimatesSettings) -> tuple[tuple[str, str], ...]:
    return ("value", settings.value), ("low", settings.low), ("high", settings.high)


def _caption(settings: EstimatesSettings, answer: Answer, shown: int) -> str:
    without = len(answer.rows) - shown
    left_out = f" {count(without, 'row')} without a value left out." if without else ""
    order = "the greatest value first" if settings.sort == "by_value" else "in the order of the table"
    return f"Dots: {settings.value}, {order}; lines: {settings.low} to {settings.high}.{left_out} {answer.method}."


def draw(data: FigureData) -> DrawnFigure:
    """Draw a line for each row, the first at the top."""
    names = [shorten(str(row["name"]), LONGEST_NAME) for row in data.rows]
    figure = Figure(figsize=(5.2, TOP_IN + LINE_IN * len(names)), layout="constrained")
    axes = figure.subplots()
    marks = Marks()
    digits = decimals_for([to_float(row["value"]) for row in data.rows])
    for place, row in enumerate(data.rows):
        value = to_float(row["value"])
        low, high = (None if row[end] is None else nan_to_none(to_float(row[end])) for end in ("low", "high"))
        if low is not None and high is not None:
            axes.hlines([place], low, high, color=OKABE_ITO[0], linewidth=1.6, zorder=2)
        (dot,) = axes.plot([value], [place], "o", color=OKABE_ITO[0], markersize=6, markeredgecolor=PAPER, zorder=3)
        details = (
            (str(data.words["axis"]), format_number(value, digits)),
            ("interval", format_interval(low, high, digits)),
        )
        marks.add(dot, (("name", str(row["name"])), *details), str(row["name"]))
    axes.set_yticks(range(len(names)), names, color=INK)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlabel(str(data.words["axis"]))
    axes.grid(visible=True, axis="x")
    axes.hlines(range(len(names)), 0, 1, transform=axes.get_yaxis_transform(), color=FAINT, linewidth=0.5, zorder=1)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
    return DrawnFigure(figure, marks.all())


ESTIMATES = FigureKind(EstimatesSettings, data, draw, takes=None)
