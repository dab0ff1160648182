"""Force from a stylus' pressure: F = a exp(b y) (thesis 4.5.2, equation 4.10), and the fit of a, b to measurements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from palpate.devices.device import DeviceError
from palpate.protocols.tables import Mistake, TableFormat, read_table

FEWEST = 4
STEEPEST = 50.0
ROUNDS = 100
MEASURED = ("pressure", "force_N")


def _no_numbers(wrong: Mistake) -> str:
    return f"{wrong.path}, line {wrong.line or 2}: two numbers are expected ({wrong.problem})."


PAIRS = TableFormat(
    error=DeviceError,
    unreadable=_no_numbers,
    encoding=_no_numbers,
    quoting=None,
    missing=lambda wrong: f"{wrong.path}: the column {wrong.column!r} is missing; pressure,force_N are expected.",
    number=_no_numbers,
)


@dataclass(frozen=True)
class Force:
    """A force curve: `a_N` is the force at the faintest touch, `b` its exponent over the pressure from 0 to 1."""

    a_N: float = 0.13
    b: float = 3.32

    def newtons(self, pressure: float) -> float:
        """Return the force in newtons; 0 without pressure, when nothing touches."""
        return self.a_N * math.exp(self.b * pressure) if pressure > 0 else 0.0

    def pressure(self, force_N: float) -> float:
        """Return the pressure from 0 to 1 for this force; 0 for too faint a force, 1 above the largest."""
        return min(1.0, math.log(force_N / self.a_N) / self.b) if force_N > self.a_N else 0.0


@dataclass(frozen=True)
class Fit:
    """A fitted force and its residuals: RMS and largest in N, explained share of variance, standard errors."""

    force: Force
    rms_N: float
    worst_N: float
    r_squared: float
    a_error_N: float
    b_error: float
    pairs: int


def fit_force(pressures: Sequence[float], forces_N: Sequence[float]) -> Fit:
    """Fit F = a exp(b y) in newtons by least squares to measured pressures (0 to 1) and forces.

    Raises:
        DeviceError: fewer than 4 pairs, impossible pressures or forces, or forces that do not rise with pressure.
    """
    if len(pressures) != len(forces_N) or len(pressures) < FEWEST:
        counts = f"{len(pressures)} pressures and {len(forces_N)} forces"
        raise DeviceError(f"{counts}: as many of each, and {FEWEST} at least, are expected.")
    for number, (pressure, force_N) in enumerate(zip(pressures, forces_N, strict=True), 1):
        if not (0 <= pressure <= 1 and 0 < force_N < math.inf):
            raise DeviceError(
                f"pair {number}: pressure {pressure}, force {force_N} N; a pressure from 0 to 1 and a force above 0 N "
                "are expected (leave out pairs without contact)."
            )
    if len(set(pressures)) < 3:
        raise DeviceError(
            "fewer than 3 different pressures: measure over the whole range, for example in steps of 0.1."
        )
    b = _start(pressures, forces_N)
    for _ in range(ROUNDS):
        b, before = _better(pressures, forces_N, b), b
        if abs(b - before) <= 1e-14 * max(1.0, abs(b)):
            break
    a = _scale(pressures, forces_N, b)
    if not (0 < b <= STEEPEST and a > 0):
        raise DeviceError(f"the force does not rise with the pressure as a exp(b y) does: b came out as {b:.3g}.")
    force = Force(a, b)
    shapes = [math.exp(force.b * y) for y in pressures]
    left = [f - force.a_N * s for f, s in zip(forces_N, shapes, strict=True)]
    squares, count = math.fsum(r * r for r in left), len(left)
    mean = math.fsum(forces_N) / count
    spread = math.fsum((f - mean) ** 2 for f in forces_N)
    # The inverse of the 2 x 2 normal matrix of (a, b); with the spread of the residuals it gives the standard errors.
    aa = math.fsum(s * s for s in shapes)
    ab = math.fsum(force.a_N * y * s * s for y, s in zip(pressures, shapes, strict=True))
    bb = math.fsum((force.a_N * y * s) ** 2 for y, s in zip(pressures, shapes, strict=True))
    scale = squares / (count - 2) / (aa * bb - ab * ab)
    return Fit(
        force, math.sqrt(squares / count), max(map(abs, left)), 1 - squares / spread if spread > 0 else 0.0,
        math.sqrt(scale * bb), math.sqrt(scale * aa), count,
    )  # fmt: skip


def read_pairs(path: Path) -> tuple[list[float], list[float]]:
    """Return pressures and forces of a CSV with the columns pressure, force_N. Raises DeviceError that names the
    line.
    """
    pressures, forces_N = read_table(path, MEASURED, PAIRS).numbers(MEASURED, finite=False).values()
    return pressures.tolist(), forces_N.tolist()


def _start(pressures: Sequence[float], forces_N: Sequence[float]) -> float:
    """Return the slope of log F, weighted by F^2, which is near the least-squares solution in newtons."""
    weights = [force_N * force_N for force_N in forces_N]
    whole = math.fsum(weights)
    middle = math.fsum(w * y for w, y in zip(weights, pressures, strict=True)) / whole
    off = [y - middle for y in pressures]
    above = math.fsum(w * d * math.log(f) for w, d, f in zip(weights, off, forces_N, strict=True))
    return above / math.fsum(w * d * d for w, d in zip(weights, off, strict=True))


def _scale(pressures: Sequence[float], forces_N: Sequence[float], b: float) -> float:
    """Return the best a for a given b, a linear problem."""
    shapes = [math.exp(b * y) for y in pressures]
    return math.fsum(f * s for f, s in zip(forces_N, shapes, strict=True)) / math.fsum(s * s for s in shapes)


def _squares(pressures: Sequence[float], forces_N: Sequence[float], b: float) -> float:
    a = _scale(pressures, forces_N, b)
    return math.fsum((f - a * math.exp(b * y)) ** 2 for y, f in zip(pressures, forces_N, strict=True))


def _better(pressures: Sequence[float], forces_N: Sequence[float], b: float) -> float:
    """Return b after one Gauss-Newton step with the best a, halved until the fit does not get worse."""
    a = _scale(pressures, forces_N, b)
    shapes = [math.exp(b * y) for y in pressures]
    whole = math.fsum(s * s for s in shapes)
    mean = math.fsum(y * s * s for y, s in zip(pressures, shapes, strict=True)) / whole
    slopes = [a * (y - mean) * s for y, s in zip(pressures, shapes, strict=True)]
    left = [f - a * s for f, s in zip(forces_N, shapes, strict=True)]
    step = math.fsum(d * r for d, r in zip(slopes, left, strict=True)) / math.fsum(d * d for d in slopes)
    step, now = max(-5.0, min(5.0, step)), _squares(pressures, forces_N, b)
    while abs(b + step) > 2 * STEEPEST or (_squares(pressures, forces_N, b + step) > now and abs(step) > 1e-15):
        step /= 2
    return b + step
