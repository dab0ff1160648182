"""Magnitude estimates over intensity, both logarithmic: geometric means with intervals, and the power law."""

from __future__ import annotations

from collections.abc import Iterator
from statistics import geometric_mean
from typing import Any, Literal

from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter, LogLocator, NullFormatter

from palpate.analysis.figures.columns import answer_of_test, fill_columns, to_float
from palpate.analysis.figures.figure_kind import (
    DrawnFigure,
    FigureData,
    FigureInput,
    FigureKind,
    FigureSettings,
    Marks,
    rows_without_effect,
)
from palpate.analysis.figures.lettering import format_interval, format_number
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, PAPER, tint
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.wording import count


class PowerLawFigureSettings(FigureSettings):
    """The settings of a figure of the test `power_law` that `tests` names; `people` draws a line for each."""

    figure: Literal["power_law"]
    people: bool = True

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from rows_without_effect("in this figure, which shows the numbers of its test as they are")


def data(inputs: FigureInput, settings: PowerLawFigureSettings) -> FigureData:
    """Return a row for each "stimulus", the "law", and each "person": the ends of a line, normalised like magnitudes.

    Raises DataRefused unless `tests` names one test of kind power_law, with stimuli that all people felt.
    """
    where = f"figure {settings.name!r}"
    answer = answer_of_test(settings, inputs, settings.tests[0] if settings.tests else "")
    stimuli, people = (answer.more.get(name, ()) for name in ("stimuli", "people"))
    if not answer.rows or "exponent" not in answer.rows[0] or not stimuli:
        raise DataRefused(f"{where}: `tests` must name a test of kind power_law, with stimuli that all people felt")
    exponent = to_float(answer.rows[0]["exponent"])
    at = [to_float(row["intensity"]) for row in stimuli]
    centre, height = geometric_mean(at), geometric_mean([to_float(row["magnitude"]) for row in stimuli])
    rows: list[dict[str, Any]] = [
        {"shows": "stimulus", "name": row["stimulus"],
         **{key: row[key] for key in ("intensity", "magnitude", "ci_low", "ci_high")}}
        for row in stimuli
    ]  # fmt: skip
    slopes = [("law", "all", exponent)]
    slopes += [("person", str(row["participant"]), to_float(row["exponent"])) for row in people if settings.people]
    for shows, name, slope in slopes:
        rows += [
            {"shows": shows, "name": name, "exponent": slope, "intensity": end,
             "magnitude": height * (end / centre) ** slope}
            for end in (min(at), max(at))
        ]  # fmt: skip
    caption = (
        f"Geometric means of {count(len(people), 'participant')} after log normalisation with their intervals, the "
        f"power law with the mean exponent {format_number(exponent, 2)}"
        + (", and each participant's own (thin)" if settings.people else "")
        + f". {answer.method}."
    )
    words = {"axis": answer.kinds["exponent"].removeprefix("exponent of ")}
    return FigureData(fill_columns(rows), settings.title or "Magnitude estimates.", caption, words)


def draw(data: FigureData) -> DrawnFigure:
    """Draw magnitudes over intensity on logarithmic axes."""
    figure = Figure(figsize=(4.8, 3.9), layout="constrained")
    axes, marks = figure.subplots(), Marks()
    axes.set_xscale("log")
    axes.set_yscale("log")
    lines: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for row in data.rows:
        if row["shows"] != "stimulus":
            point = (to_float(row["intensity"]), to_float(row["magnitude"]))
            lines.setdefault((str(row["shows"]), str(row["name"])), []).append(point)
    exponents = {(str(row["shows"]), str(row["name"])): row["exponent"] for row in data.rows}
    for (shows, name), points in sorted(lines.items(), reverse=True):
        xs, ys = zip(*points, strict=True)
        law = shows == "law"
        colour = OKABE_ITO[0] if law else tint(OKABE_ITO[0], 0.35)
        (line,) = axes.plot(xs, ys, color=colour, linewidth=1.8 if law else 0.9, zorder=3 if law else 2)
        detail = format_number(to_float(exponents[shows, name]), 2)
        marks.add(line, (("power law" if law else "participant", name), ("exponent", detail)), "" if law else name)
    for row in (row for row in data.rows if row["shows"] == "stimulus"):
        x, y = to_float(row["intensity"]), to_float(row["magnitude"])
        low, high = (None if row[end] is None else to_float(row[end]) for end in ("ci_low", "ci_high"))
        if low is not None and high is not None:
            axes.vlines([x], low, high, color=INK, linewidth=1.2, zorder=4)
        (dot,) = axes.plot([x], [y], "o", color=INK, markersize=5.5, markeredgecolor=PAPER, zorder=5)
        details = (("stimulus", str(row["name"])), ("intensity", format_number(x)), ("magnitude", format_number(y)))
        marks.add(dot, (*details, ("interval", format_interval(low, high))), str(row["name"]))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(LogFormatter(labelOnlyBase=False, minor_thresholds=(10, 10)))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(visible=True, color=FAINT)
    axes.set_xlabel(str(data.words["axis"]))
    axes.set_ylabel("magnitude")
    return DrawnFigure(figure, marks.all())


POWER_LAW = FigureKind(PowerLawFigureSettings, data, draw, takes=None)
