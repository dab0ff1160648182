"""A stylus' pressure made newtons by pairs that were measured with a force sensor under the tablet."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from palpate.devices.rig.calibrating import Found
from palpate.devices.signals import DeviceError
from palpate.devices.tablet.force import Fit, fit_force, read_pairs

DIGITS = 5


def calibrate_tablet(pairs: Path, date: str, figure: Path | None = None) -> Found:
    """The curve F = a exp(b y) of a CSV with the columns pressure, force_N; `figure` is the picture to write of it.

    Raises DeviceError naming the file.
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
    told = list(_tablet_lines(fit))
    if figure is not None:
        from palpate.devices.tablet.draw import draw_force

        told += [f"drawn: {path}" for path in draw_force(pressures, forces_N, fit.force, figure)]
    return Found({"force": curve, "calibrated": date}, tuple(told), figures)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _tablet_lines(fit: Fit) -> Iterator[str]:
    a, b = fit.force.a_N, fit.force.b
    yield f"F = {a:.4g} exp({b:.4g} y) N; standard errors {fit.a_error_N:.2g} N and {fit.b_error:.2g}"
    left = f"{fit.rms_N:.3g} N (RMS), {fit.worst_N:.3g} N at most"
    yield f"residual of {fit.pairs} pairs: {left}; r squared {fit.r_squared:.4f}"
