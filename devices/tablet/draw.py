"""A tablet's measured forces over the stylus' pressure with the fitted curve, as Figure 4.4 of the thesis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from palpate.devices.picture import COLOURS, INK, SOFT, drawing, write_picture
from palpate.devices.tablet.force import Force

STEPS = 200
THESIS = Force()
"""Equation 4.10."""
Row = dict[str, Any]


def draw_force(pressures: Sequence[float], forces_N: Sequence[float], fitted: Force, out: Path) -> list[Path]:
    """Draw the pairs, the fitted curve and the thesis' one, and write the numbers beside; return the files."""
    from matplotlib.figure import Figure

    rows = force_rows(pressures, forces_N, fitted)
    with drawing("force"):
        figure = Figure(figsize=(5.6, 3.8), layout="constrained")
        axes = figure.subplots()
        for shows, style, colour, label in (
            ("thesis", "--", SOFT, f"thesis: {_formula(THESIS)}"),
            ("fit", "-", COLOURS[0], f"fit: {_formula(fitted)}"),
            ("pair", "o", INK, "measured"),
        ):
            own = [row for row in rows if row["shows"] == shows]
            x, y = [row["pressure"] for row in own], [row["force_N"] for row in own]
            axes.plot(x, y, style, color=colour, label=label, markersize=4.5, linewidth=1.4)
        axes.set(xlim=(0, 1.02), xlabel="pressure, share of the largest", ylabel="force in N")
        axes.set_ylim(bottom=0)
        axes.legend(loc="upper left")
        return write_picture(figure, out, rows)


def force_rows(pressures: Sequence[float], forces_N: Sequence[float], fitted: Force) -> list[Row]:
    """Return the rows of Figure 4.4: `pair` with what the fit leaves over, `fit` and `thesis` curves from 0 to 1."""
    rows: list[Row] = [
        {"shows": "pair", "pressure": y, "force_N": force_N, "residual_N": force_N - fitted.newtons(y)}
        for y, force_N in sorted(zip(pressures, forces_N, strict=True))
    ]
    for shows, force in (("fit", fitted), ("thesis", THESIS)):
        rows += [
            {"shows": shows, "pressure": n / STEPS, "force_N": force.newtons(n / STEPS), "residual_N": None}
            for n in range(1, STEPS + 1)
        ]
    return rows


def _formula(force: Force) -> str:
    return f"{force.a_N:.3g} exp({force.b:.3g} y) N"
