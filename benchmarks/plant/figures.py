"""Pictures of what the door machine renders: the stable region of a stop, and six doors pulled by a hand."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.plant.playback import play
from benchmarks.plant.rendered_stop import Wall, by_default, heavy, light, stiffest
from palpate.protocols.files import open_bytes

INK, SOFT, GREY = "#1a1a1a", "#5c5c5c", "#d9d9d9"
COLOURS = ("#0072b2", "#d55e00", "#009e73")
ARMS = ((0.01, "o"), (0.25, "s"), (20.0, "D"))


def walls_figure(out: Path, quick: bool) -> Path:
    """Draw the largest stable simulated stiffness beside Colgate's condition, over the arm's and wall's damping."""
    figure = _figure(11.0, 4.8)
    left, right = figure.subplots(1, 2)
    _over_damping(left, quick)
    _over_wall_damping(right, quick)
    figure.suptitle("A stop rendered at 1 kHz, sampled and held: where it is stable", x=0.01, ha="left", fontsize=12)
    return _save(figure, out / "plant_rendered_stop.png")


def doors_figure(out: Path, doors: Mapping[str, tuple[tuple[float, ...], float]]) -> Path:
    """Draw commanded and rendered torque of each door over the angle, and their difference, under a human-like pull."""
    figure = _figure(11.0, 7.4)
    for axes, (door, (torque, end_rad)) in zip(figure.subplots(2, 3, sharex=True).ravel(), doors.items(), strict=True):
        playback = play(torque, end_rad)
        angle = np.degrees(playback.angle_rad)
        rendered, commanded = np.array(playback.rendered_Nm), np.array(playback.commanded_Nm)
        axes.plot(angle, commanded, color=GREY, linewidth=5, label="commanded")
        axes.plot(angle, rendered, color=INK, linewidth=1.1, label="rendered")
        axes.plot(angle, 10 * (rendered - commanded), color=COLOURS[1], linewidth=0.9, label="difference x 10")
        axes.set_title(f"{door}   r {playback.r:.5f}   RMSE {playback.rmse_Nm:.3f} N m", loc="left", fontsize=9.5)
        axes.axhline(0, color=SOFT, linewidth=0.5)
    _label(figure.axes[-3:], "angle (degrees)", None)
    _label(figure.axes[::3], None, "torque at the handle (N m)")
    figure.axes[0].legend(frameon=False, fontsize=8.5, loc="lower left")
    return _save(figure, out / "plant_playback.png")


def _over_damping(axes: Any, quick: bool) -> None:
    theory = np.logspace(-1.3, 3.2, 50)
    axes.fill_between(
        theory, 1.0, 2 * theory / 1e-3, color=GREY, alpha=0.6, linewidth=0, label="passive by Colgate: K < 2 b / T"
    )
    axes.plot(theory, 2 * theory / 1e-3, color=INK, linewidth=1.2)
    places = np.logspace(-1, 3, 5 if quick else 13)
    for (inertia, marker), colour in zip(ARMS, COLOURS, strict=True):
        # Heavier arms under less damping gain or lose too little in a swing to be distinguished.
        dampings = [float(b) for b in places if b >= inertia / 5]
        stiffness = [stiffest(Wall(inertia, b), by_default) for b in dampings]
        label = f"largest stable, simulated, {inertia:g} kg m$^2$"
        axes.plot(dampings, stiffness, marker, color=colour, markersize=5.5, markerfacecolor="none", label=label)
    axes.set(xscale="log", yscale="log", ylim=(50, 2e7), xlim=(theory[0], theory[-1]))
    _label([axes], "arm's damping b (N m s/rad)", "rendered stiffness K (N m/rad)")
    axes.legend(frameon=False, fontsize=8.5, loc="upper left")


def _over_wall_damping(axes: Any, quick: bool) -> None:
    shares = np.linspace(-0.9, 0.9, 7 if quick else 19)
    both = np.array([-1.0, 0.0, 1.0])
    axes.fill_between(
        both, 0, 1 - abs(both), color=GREY, alpha=0.6, linewidth=0, label="passive by Colgate: b > K T / 2 + |B|"
    )
    axes.plot(both, 1 - abs(both), color=INK, linewidth=1.2)
    arms = {"light arm, J = b T / 100": partial(light, 1000.0), "heavy arm, J = 50 b T": partial(heavy, 1.0)}
    for (label, arm), marker, colour in zip(arms.items(), "os", COLOURS, strict=False):
        walls = [arm(float(share)) for share in shares]
        stiffness = [stiffest(wall, by_default) * 1e-3 / 2 / wall.arm_damping_Nm_s_rad for wall in walls]
        axes.plot(shares, stiffness, marker, color=colour, markersize=5.5, markerfacecolor="none", label=label)
    axes.set(xlim=(-1, 1), ylim=(0, 2.7))
    _label([axes], "wall's damping B / b", "rendered stiffness K T / (2 b)")
    axes.legend(frameon=False, fontsize=8.5, loc="upper left")


def _label(axes: Any, x: str | None, y: str | None) -> None:
    for one in axes:
        if x:
            one.set_xlabel(x, color=SOFT, fontsize=9)
        if y:
            one.set_ylabel(y, color=SOFT, fontsize=9)


def _figure(width: float, height: float) -> Any:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _save(figure: Any, path: Path) -> Path:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8.5, colors=SOFT)
    FigureCanvasAgg(figure)
    with open_bytes(path) as file:
        figure.savefig(file, format=path.suffix[1:], dpi=150)
    return path
