"""Figures 5.12 to 5.14 of the thesis, work-precision plots, learning curves, made and measured profiles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.analysis.figures.figure_kind import FigureInput, FigureKind
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, SOFT, drawing, quiet_axes, save
from palpate.analysis.reports.figures import DrawnFigure, drawn_figure
from palpate.modeling.doors.data import rows_by_label
from palpate.modeling.doors.evaluation.evaluate import DoorEvaluation
from palpate.modeling.doors.evaluation.method_rows import widths
from palpate.modeling.doors.evaluation.result_tables import curve_rows
from palpate.modeling.doors.evaluation.tables import prediction_rows, waveform_error_rows, waveform_errors
from palpate.modeling.doors.evaluation.words import CURVES, PROFILES, WORK_PRECISION
from palpate.modeling.doors.registry import THESIS
from palpate.modeling.doors.results import MethodResults
from palpate.protocols.undefined import nan_to_none
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure


ANGLE = np.arange(POINTS) / POINTS_PER_DEG
HELD, OURS, THEIRS = "#9aa4ae", OKABE_ITO[0], OKABE_ITO[1]
ACROSS = 3
Line = tuple[str, str, Array, float]
"""A line of a plot: name, colour, 621 newtons, width."""
UNIT = "0 to 100"


def made_profiles(evaluation: DoorEvaluation, ours: MethodResults, folder: Path) -> DrawnFigure:
    """Draw for each door the stimulus of median waveform error: the held-out profile, and those of two methods."""
    network = next((m for m in evaluation.results.methods("inverse") if m.method == THESIS != ours.method), None)
    shown = [method for method in (ours, network) if method is not None]
    panels = [_panel(evaluation, shown, rows) for rows in rows_by_label(ours.data.doors).values()]
    judge = "fresh simulated people" if ours.array("loop_fresh") is not None else "the forward model's ratings"
    beside = "" if network is None else ", orange what the thesis' network makes"
    caption = PROFILES.format(ours=ours.method, network=beside, judge=judge)
    with drawing("made_profiles"):
        return drawn_figure("made_profiles", "Made profiles of held-out stimuli", caption, _figure(panels), folder)


def _panel(evaluation: DoorEvaluation, shown: Sequence[MethodResults], rows: Sequence[int]) -> tuple[str, list[Line]]:
    """Return the title and the lines of one door's stimulus of median error."""
    ours = shown[0]
    errors = waveform_errors(ours)[0]
    row = sorted(rows, key=lambda i: errors[i])[len(rows) // 2]
    lines: list[Line] = [("held out", HELD, ours.data.force_N[row], 2.6)]
    for method, colour in zip(shown, (OURS, THEIRS), strict=False):
        made_N = evaluation.results.domain.scaling.force_down(method.predicted[row])
        # the legend: the waveform's MAE, and how far the ratings of the made profile lie from the wish
        felt, wish = method.array("loop_fresh"), method.array("wish")
        felt = method.array("loop_judge") if felt is None else felt
        off = "" if felt is None or wish is None else f", {float(np.abs(felt[row] - wish[row]).mean()):.1f} off"
        label = f"{method.method} ({waveform_errors(method)[0][row]:.1f} %{off})"
        lines.append((label, colour, made_N, 1.2))
    return ours.data.ids[row], lines


def measured_door(evaluation: DoorEvaluation, folder: Path) -> DrawnFigure:
    """Draw the measured door and its edits, each with the profile that the inverse makes of its predicted ratings."""
    from palpate.modeling.doors.evaluation.report import profile_name

    panels: list[tuple[str, list[Line]]] = [
        (
            profile_name(profile.name),
            [("as measured or edited", HELD, profile.force_N, 2.6), ("made again", OURS, profile.made_N, 1.2)],
        )
        for profile in evaluation.measured
    ]
    caption = (
        "Grey the profile itself, blue the one that is made of its predicted ratings: many shapes can have one feeling."
    )
    with drawing("measured_door"):
        return drawn_figure("measured_door", "The measured door and its edits", caption, _figure(panels), folder)


def _figure(panels: Sequence[tuple[str, list[Line]]]) -> Figure:
    from matplotlib.figure import Figure

    lines = -(-len(panels) // ACROSS)
    figure = Figure(figsize=(10.2, 2.75 * lines), layout="constrained")
    grid = figure.subplots(lines, ACROSS, squeeze=False, sharex=True, sharey=True).ravel()
    for axes, (title, shown) in zip(grid, panels, strict=False):
        axes.axhline(0, color=FAINT, linewidth=0.8, zorder=0.5)
        for name, colour, force_N, width in shown:
            axes.plot(ANGLE, force_N, color=colour, linewidth=width, label=name, solid_capstyle="round")
        axes.set_title(title, color=INK)
        axes.set_xlim(0, ANGLE[-1])
        axes.legend(fontsize=7, frameon=False, loc="upper left", handlelength=1.2, labelspacing=0.2,
                    borderaxespad=0.1)  # fmt: skip
        quiet_axes(axes)
    for axes in grid[len(panels) :]:
        axes.set_axis_off()
    for axes in grid[::ACROSS]:
        axes.set_ylabel("force (N)", color=SOFT)
    for axes in grid[max(0, len(panels) - ACROSS) : len(panels)]:
        axes.set_xlabel("angle (deg)", color=SOFT)
        axes.tick_params(labelbottom=True)
    low, high = grid[0].get_ylim()
    grid[0].set_ylim(low, high + 0.24 * (high - low))
    return figure


def figures(evaluation: DoorEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Draw every figure that the evaluation has data for, and write NAME.svg and NAME.png into the folder."""
    forward = _of(
        evaluation.results.methods("forward"),
        evaluation.choices["forward"].method if "forward" in evaluation.choices else "",
    )
    inverse = _of(
        evaluation.results.methods("inverse"),
        evaluation.choices["inverse"].method if "inverse" in evaluation.choices else "",
    )
    if forward is not None:
        # figures 5.12 and 5.13: by door and by attribute
        from palpate.analysis.figures.predicted import PREDICTED

        rows = prediction_rows(forward, widths(forward))
        for name, panels, colour in (("figure_5_12", "door", "attribute"), ("figure_5_13", "attribute", "door")):
            settings: dict[str, Any] = {"panels": panels, "colour": colour, "unit": UNIT, "band": "global"}
            settings |= {} if any(row["sd"] is not None for row in rows) else {"sd": 10.0}
            shown_rows = [{key: value for key, value in row.items() if key not in ("low", "high")} for row in rows]
            yield _planned_figure(
                PREDICTED, {"name": name, "figure": "predicted", **settings}, shown_rows, forward, folder
            )
    if inverse is not None:
        yield _violins(inverse, folder)
        yield made_profiles(evaluation, inverse, folder)
    if evaluation.measured:
        yield measured_door(evaluation, folder)
    yield from _work_precision(evaluation, folder)
    yield from _curves(evaluation, folder)


def _of(methods: Sequence[MethodResults], name: str) -> MethodResults | None:
    return next((method for method in methods if method.method == name), None)


def _violins(results: MethodResults, folder: Path) -> DrawnFigure:
    """Draw figure 5.14: the waveform's MAE by door."""
    from palpate.analysis.figures.violins import VIOLINS

    title = "Waveform error of made profiles by door"
    settings = {
        "name": "figure_5_14",
        "figure": "violins",
        "by": "door",
        "value": "mae",
        "unit": "% of the range of forces",
    }
    return _planned_figure(VIOLINS, {**settings, "title": title}, waveform_error_rows(results), results, folder)


def _planned_figure(
    kind: FigureKind, plain: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], results: MethodResults, folder: Path
) -> DrawnFigure:
    settings = kind.settings.model_validate(plain)
    # the rows as a figure of a plan gets them, with the levels in the data's order
    import pandas as pd

    from palpate.analysis.plans.answers import Selected

    table = pd.DataFrame([dict(row) for row in rows])
    data = results.data
    levels = {name: tuple(dict.fromkeys(values)) for name, values in
              (("attribute", data.attributes), ("door", data.doors), ("variant", data.variants))}  # fmt: skip
    antonyms = dict(zip(data.attributes, data.antonyms, strict=True))
    shown = kind.data(
        FigureInput(Selected(table, table.iloc[:0], data.attributes, levels, antonyms=antonyms)), settings
    )
    with drawing(settings.name):
        drawn = kind.draw(shown)
        svg, _ = save(drawn.figure, folder, settings.name)
    return DrawnFigure(settings.name, shown.title, shown.caption, svg.read_text(encoding="utf-8"), drawn.marks)


def _work_precision(evaluation: DoorEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Yield error against the time of training and of an answer, a figure for each direction."""
    from palpate.analysis.measuring.work_precision_plot import work_precision_figure

    panels = {
        "forward": (evaluation.forward, "mae", "From force to feeling", "MAE, 0 to 100"),
        "inverse": (evaluation.inverse, "waveform_mae", "From feeling to force", "waveform MAE, % of the range"),
    }
    for way, (of, error, title, kind) in panels.items():
        rows = [*_timed_rows(of, error, "train_s", 1.0, ("training", kind)),
                *_timed_rows(of, error, "file_ms", 1e-3, ("an answer", kind))]  # fmt: skip
        if rows:
            name = f"work_precision_{way}"
            with drawing(name):
                yield drawn_figure(
                    name, f"{title}: error against time", WORK_PRECISION, work_precision_figure(rows), folder
                )


def _timed_rows(
    of: Sequence[Mapping[str, Any]], error: str, seconds: str, unit: float, named: tuple[str, str]
) -> list[Any]:
    from palpate.analysis.measuring.rows import MEASURED, Measurement

    case, kind = named
    return [
        Measurement(
            "doors", case, row["method"], "all folds", 0, kind, row[error], MEASURED, row[seconds] * unit, 1, None
        )
        for row in of
        if row[seconds]
    ]


def _curves(evaluation: DoorEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Yield the learning curves of every method that is trained in epochs, a line for each fold."""
    from palpate.modeling.training.history import Epoch
    from palpate.modeling.training.trained_files import learning_curve

    for method in (*evaluation.results.methods("forward"), *evaluation.results.methods("inverse")):
        histories: dict[str, list[Epoch]] = {}
        for row in curve_rows(method):
            held = nan_to_none(row["held_loss"])
            epoch = Epoch(int(row["epoch"]), row["seconds"], row["learning_rate"], row["train_loss"], held)
            histories.setdefault(f"fold {row['fold']}", []).append(epoch)
        if histories:
            name = f"learning_{method.direction}_{method.method}"
            title = f"Learning curves: {evaluation.results.domain.methods[method.direction][method.method].title}"
            with drawing(name):
                last = method.method == "network_thesis"
                yield drawn_figure(name, title, CURVES, learning_curve(histories, last), folder)
