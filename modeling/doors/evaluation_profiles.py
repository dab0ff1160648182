"""Made profiles beside the held-out ones, and the measured door beside what its own predicted ratings lead back to."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, SOFT, drawing, quiet_axes
from palpate.analysis.reports.figures import DrawnFigure, drawn_figure
from palpate.modeling.doors.evaluation import DoorEvaluation
from palpate.modeling.doors.evaluation_tables import waveform_errors
from palpate.modeling.doors.evaluation_words import PROFILES
from palpate.modeling.doors.registry import THESIS
from palpate.modeling.doors.results import MethodResults
from palpate.modeling.doors.scores import by_level
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ANGLE = np.arange(POINTS) / POINTS_PER_DEG
HELD, OURS, THEIRS = "#9aa4ae", OKABE_ITO[0], OKABE_ITO[1]
ACROSS = 3
Line = tuple[str, str, Array, float]
"""Name, colour, 621 newtons, width."""


def made_profiles(evaluation: DoorEvaluation, ours: MethodResults, folder: Path) -> DrawnFigure:
    """For each door the stimulus that was made with the median error: held out, and as two methods made it."""
    network = next((m for m in evaluation.results.methods("inverse") if m.method == THESIS != ours.method), None)
    shown = [method for method in (ours, network) if method is not None]
    panels = [_panel(evaluation, shown, rows) for rows in by_level(ours.data.doors).values()]
    judge = "fresh simulated people" if ours.array("loop_fresh") is not None else "the forward model's ratings"
    beside = "" if network is None else ", orange what the thesis' network makes"
    caption = PROFILES.format(ours=ours.method, network=beside, judge=judge)
    with drawing("made_profiles"):
        return drawn_figure("made_profiles", "Made profiles of held-out stimuli", caption, _figure(panels), folder)


def _panel(evaluation: DoorEvaluation, shown: Sequence[MethodResults], rows: Sequence[int]) -> tuple[str, list[Line]]:
    """Return one door's middle stimulus: its title, and the lines to draw."""
    ours = shown[0]
    errors = waveform_errors(ours)[0]
    row = sorted(rows, key=lambda i: errors[i])[len(rows) // 2]
    lines: list[Line] = [("held out", HELD, ours.data.force_N[row], 2.6)]
    for method, colour in zip(shown, (OURS, THEIRS), strict=False):
        made_N = evaluation.results.domain.scaling.force_down(method.predicted[row])
        lines.append((f"{method.method} ({_legend(method, row)})", colour, made_N, 1.2))
    return ours.data.ids[row], lines


def _legend(method: MethodResults, row: int) -> str:
    """Return the waveform's MAE, and how far the ratings of the made profile lie from the wish."""
    felt, wish = method.array("loop_fresh"), method.array("wish")
    felt = method.array("loop_judge") if felt is None else felt
    off = "" if felt is None or wish is None else f", {float(np.abs(felt[row] - wish[row]).mean()):.1f} off"
    return f"{waveform_errors(method)[0][row]:.1f} %{off}"


def measured_door(evaluation: DoorEvaluation, folder: Path) -> DrawnFigure:
    """Return the measured door and its edits, each beside the profile that its predicted ratings come back to."""
    from palpate.modeling.doors.evaluation_report import profile_name

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
        _draw(axes, title, shown)
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


def _draw(axes: Axes, title: str, shown: Sequence[Line]) -> None:
    axes.axhline(0, color=FAINT, linewidth=0.8, zorder=0.5)
    for name, colour, force_N, width in shown:
        axes.plot(ANGLE, force_N, color=colour, linewidth=width, label=name, solid_capstyle="round")
    axes.set_title(title, color=INK)
    axes.set_xlim(0, ANGLE[-1])
    axes.legend(fontsize=7, frameon=False, loc="upper left", handlelength=1.2, labelspacing=0.2,
                borderaxespad=0.1)  # fmt: skip
    quiet_axes(axes)
