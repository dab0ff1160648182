"""Calibrate a stylus' pressure in newtons by pairs measured with a force sensor under the tablet; draw the fit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from palpate.devices.device import DeviceError
from palpate.devices.picture import COLOURS, INK, SOFT, drawing, write_picture
from palpate.devices.rig.calibration import CalibrationJob, CalibrationResult
from palpate.devices.tablet.force import Force, fit_force, read_pairs

DIGITS = 5
STEPS = 200
THESIS = Force()
"""Equation 4.10."""
Row = dict[str, Any]


def calibrate_tablet(job: CalibrationJob, pairs: Path, figure: Path | None = None) -> CalibrationResult:
    """Fit F = a exp(b y) to a CSV with the columns pressure, force_N, and write its picture to `figure`.

    Raises DeviceError that names the file.
    """
    pressures, forces_N = read_pairs(pairs)
    try:
        fit = fit_force(pressures, forces_N)
    except DeviceError as error:
        raise DeviceError(f"{pairs}: {error}") from None
    curve = {"a_N": _rounded(fit.force.a_N), "b": _rounded(fit.force.b)}
    figures = {
        "pairs": fit.pairs, "a_error_N": fit.a_error_N, "b_error": fit.b_error, "rms_N": fit.rms_N,
        "worst_N": fit.worst_N, "r_squared": fit.r_squared,
    }  # fmt: skip
    left = f"{fit.rms_N:.3g} N (RMS), {fit.worst_N:.3g} N at most"
    errors = f"standard errors {fit.a_error_N:.2g} N and {fit.b_error:.2g}"
    lines = [
        f"F = {fit.force.a_N:.4g} exp({fit.force.b:.4g} y) N; {errors}",
        f"residual of {fit.pairs} pairs: {left}; r squared {fit.r_squared:.4f}",
    ]
    if figure is not None:
        lines += [f"drawn: {path}" for path in draw_force(pressures, forces_N, fit.force, figure)]
    return CalibrationResult({"force": curve, "calibrated": job.date}, tuple(lines), figures)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def draw_force(pressures: Sequence[float], forces_N: Sequence[float], fitted: Force, out: Path) -> list[Path]:
    """Draw the pairs, the fitted curve and the thesis' curve, with the numbers beside; return the files."""
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
    """Return the rows of Figure 4.4: `pair` with the residuals of the fit, `fit` and `thesis` curves from 0 to 1."""
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
