"""A six-axis force/torque sensor: from six gauge voltages to forces and torques, and its overload.

Units, transforms and temperature follow the maker's C library: a transform moves the origin by d in the sensor's axes
and then turns the axes about x, y and z in this order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import repeat
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palpate.devices.daq.cal_file import AXES, CalFile
from palpate.devices.daq.twin import PIECE, Ideal
from palpate.devices.daq.voltage_check import VoltageCheck
from palpate.devices.device import DeviceError, DeviceFault, Reading, Signal
from palpate.protocols.wording import count
from palpate.signals import GRAVITY_M_S2
from palpate.signals.arrays import Array

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

GAUGES = 6
UNITS = ("N", "N", "N", "N m", "N m", "N m")
WARMER_V = 0.1
"""Volts of a twin's thermistor above its reference."""
NOISY = 0.01
"""Greatest noise floor of a sensor at rest, as a share of the rated load."""
DRIFTED = 0.05
"""Greatest mean at rest, as a share of the rated load; beyond it the zero no longer holds."""
PARTS = 20
"""Number of parts of a reading that are compared to see whether it moved while the zero was taken."""
POUND_N, INCH_M = 4.4482216152605, 0.0254
FORCE_N: Mapping[str, float] = {
    "N": 1.0, "kN": 1e3, "lb": POUND_N, "lbf": POUND_N, "klb": 1e3 * POUND_N, "klbf": 1e3 * POUND_N,
    "kg": GRAVITY_M_S2, "kgf": GRAVITY_M_S2, "g": 1e-3 * GRAVITY_M_S2,
}  # fmt: skip
DISTANCE_M: Mapping[str, float] = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": INCH_M, "ft": 12 * INCH_M}
ANGLE_RAD: Mapping[str, float] = {
    **dict.fromkeys(("deg", "degree", "degrees"), float(np.pi / 180)),
    **dict.fromkeys(("rad", "radian", "radians"), 1.0),
}
AGREES = 2e-3
"""Greatest difference between the file's two ways to the matrix, as a share of a row's largest value: both are
rounded.
"""
CONDITION = 1e4
"""Greatest condition number of the matrix, with rows relative to the rated loads; beyond it, six gauges do not separate
six loads.
"""


@dataclass
class Gauges:
    """A transducer from volts of six gauges, and of an optional thermistor after them, to a wrench in the tool's frame.

    `still` is how much a reading may drift while its zero is taken, `overload` how far it may exceed the rated loads
    before it is a fault; both as shares of the rated loads.
    """

    device: str
    signal: Signal
    calibration: Calibration
    matrix: Array
    watch: VoltageCheck
    slopes: Slopes | None
    description: Mapping[str, Any]
    calibrated: str | None
    still: float
    overload: float
    bias_V: Array = field(default_factory=lambda: np.zeros(GAUGES))
    beyond: int = 0
    most: Array = field(default_factory=lambda: np.zeros(GAUGES))
    alive: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(GAUGES, np.bool_))
    back: Array = field(init=False)

    def __post_init__(self) -> None:
        """Compute the transform from the tool's frame back to the sensor's, in which the rated loads apply."""
        self.back = self.calibration.matrix @ np.linalg.inv(self.matrix)

    def begin(self) -> None:
        """Reset the counts, because the samples begin anew."""
        self.watch.begin()
        self.beyond, self.most, self.alive = 0, np.zeros(GAUGES), np.zeros(GAUGES, np.bool_)

    def rows(self, volts: Array) -> Array:
        """Return the wrench, of shape (n, 6); samples beyond the rated loads are counted.

        Raises DeviceFault: not_a_number, stuck, overload (a gauge at its end, or beyond `overload`).
        """
        self._demand_unsaturated(volts, self.watch.see(volts))
        rows = wrench(self._gauges(volts), self.matrix, self.bias_V)
        shares = np.abs(rows @ self.back.T) / self.calibration.rated
        self.most = np.maximum(self.most, shares.max(axis=0))
        self.beyond += int((shares > 1).any(axis=1).sum())
        row, axis = np.unravel_index(int(shares.argmax()), shares.shape)
        if shares[row, axis] > self.overload:
            raise DeviceFault(
                self.device,
                "overload",
                f"{self.device}: {AXES[axis]} is {100 * shares[row, axis]:.0f} % of its rated load"
                f" ({100 * self.overload:g} % is let pass); unload the sensor and take its zero again",
            )
        return rows

    def zero(self, volts: Array) -> None:
        """Use the mean of these samples as zero. Raises DeviceError if they moved, DeviceFault as `rows`."""
        self.begin()
        self._demand_unsaturated(volts, self.watch.see(volts))
        gauges = self._gauges(volts)
        parts = np.array([part.mean(axis=0) for part in np.array_split(gauges, min(PARTS, len(gauges)))])
        wander = np.ptp(wrench(parts, self.calibration.matrix, parts[0]), axis=0) / self.calibration.rated
        axis = int(wander.argmax())
        if wander[axis] > self.still:
            raise DeviceError(
                f"{self.device}: it moved while its zero was taken: {AXES[axis]} wandered by {100 * wander[axis]:.2g} %"
                f" of its rated load ({100 * self.still:g} % is let pass); let the tool rest and open it again"
            )
        self.bias_V = gauges.mean(axis=0)

    def complaint(self, reading: Reading) -> str | None:
        """Return what is wrong with a reading at rest, noise or drift relative to the rated loads; None if nothing
        is.
        """
        for axis, mean, noise, rated in zip(AXES, reading.mean, reading.noise, self.calibration.rated, strict=True):
            if noise > NOISY * rated:
                return f"{axis} is noisy: {noise:.3g} (SD), at most {NOISY * rated:.3g} at rest"
            if abs(mean) > DRIFTED * rated:
                return f"{axis} reads {mean:.3g} at rest; take its zero again"
        return f"{count(self.beyond, 'sample')} beyond the rated loads" if self.beyond else None

    def describe(self) -> Mapping[str, Any]:
        """Return the calibration file, the matrix in use, the zero and the limits."""
        return {
            **self.description,
            "matrix": self.matrix.tolist(),
            "bias_V": self.bias_V.tolist(),
            "rated": self.calibration.rated.tolist(),
            "overload": self.overload,
            "temperature": self.slopes is not None,
        }

    @property
    def facts(self) -> Mapping[str, str]:
        """Return the largest load since the start, and how often it exceeded the rated load."""
        shares = ", ".join(f"{axis} {100 * share:.2g} %" for axis, share in zip(AXES, self.most, strict=True))
        return {"largest load": f"{shares} of the rated one", "samples beyond": str(self.beyond)}

    def _gauges(self, volts: Array) -> Array:
        gauges = volts[:, :GAUGES]
        return gauges if self.slopes is None else compensated(gauges, volts[:, GAUGES], self.slopes)

    def _demand_unsaturated(self, volts: Array, at_end: NDArray[np.bool_]) -> None:
        """Raise DeviceFault if a gauge is at the end of its range: overload, or stuck if it always was there."""
        ended = at_end[:, :GAUGES]
        self.alive |= ~ended.all(axis=0)
        if not ended.any():
            return
        row, gauge = np.argwhere(ended)[0]
        where = f"{self.device}: {self.watch.wires[gauge]} stands at the end of its range ({volts[row, gauge]:.4g} V)"
        if self.alive[gauge]:
            why = "the load is beyond what the sensor can measure; unload it"
            raise DeviceFault(self.device, "overload", f"{where}: {why}")
        why = "since the start: a broken gauge or cable, no power, or a load that was there already"
        raise DeviceFault(self.device, "stuck", f"{where} {why}")


def gauge_volts(matrix: Array, slopes: Slopes | None) -> Ideal:
    """Return ideal gauge volts: a scene's wrench through the inverse matrix, plus offsets of up to half a volt.

    The thermistor reads a constant slightly above its reference, and the gauges are off by the matching amount.
    """
    inverse, offset_V = np.linalg.inv(matrix), np.linspace(-0.5, 0.5, GAUGES)

    def volts(scene: Scene | None, rate_hz: float) -> Iterator[Array]:
        pieces = repeat(np.zeros((PIECE, GAUGES))) if scene is None else scene.wrench(rate_hz)
        for piece in pieces:
            yield _warmed(piece @ inverse.T + offset_V, slopes)

    return volts


def _warmed(gauges: Array, slopes: Slopes | None) -> Array:
    """Return the gauge volts at the twin's temperature, with the thermistor's volts beside them."""
    if slopes is None:
        return gauges
    warm = gauges * (1 - slopes.gain * WARMER_V) - slopes.bias * WARMER_V
    return np.column_stack([warm, np.full(len(gauges), slopes.reference_V + WARMER_V)])


@dataclass(frozen=True)
class Calibration:
    """A sensor's calibration in N, N m and V: `matrix` of shape (6, 6), `rated` of shape (6,)."""

    matrix: Array
    rated: Array


@dataclass(frozen=True)
class Slopes:
    """Temperature compensation by the thermistor's voltage: per gauge bias and gain slopes, and the reference."""

    bias: Array
    gain: Array
    reference_V: float


def wrench(gauges_V: Array, matrix: Array, bias_V: Array) -> Array:
    """Return forces and torques of shape (n, 6): matrix x (volts - bias), for gauges of shape (n, 6)."""
    return np.asarray((gauges_V - bias_V) @ matrix.T, np.float64)


def compensated(gauges_V: Array, thermistor_V: Array, slopes: Slopes) -> Array:
    """Return the gauge volts at the reference temperature, of shape (n, 6), for thermistor volts of shape (n,).

    (volts + bias slope x dT) / (1 - gain slope x dT), with dT the thermistor's volts above the reference.
    """
    warmer = (thermistor_V - slopes.reference_V)[:, np.newaxis]
    return np.asarray((gauges_V + slopes.bias * warmer) / (1.0 - slopes.gain * warmer), np.float64)


def moved(distance_m: Sequence[float], angle_rad: Sequence[float]) -> Array:
    """Return the matrix of shape (6, 6) that transforms a wrench to another origin and other axes."""
    (sx, sy, sz), (cx, cy, cz) = np.sin(angle_rad), np.cos(angle_rad)
    about_x = np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
    about_y = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
    about_z = np.array([[cz, sz, 0], [-sz, cz, 0], [0, 0, 1]])
    turned = about_z @ about_y @ about_x
    dx, dy, dz = distance_m
    crossed = np.array([[0, -dz, dy], [dz, 0, -dx], [-dy, dx, 0]])
    return np.block([[turned, np.zeros((3, 3))], [-turned @ crossed, turned]])


def calibration(file: CalFile, where: str) -> Calibration:
    """Return the file's matrix and rated loads in N and N m.

    Raises:
        DeviceError: an unknown unit, two matrices in the file that disagree, or a matrix that cannot be inverted.
    """
    units = np.array([_unit(file.force_unit, FORCE_N, where, "ForceUnits")] * 3 + [torque_Nm(file, where)] * 3)
    rated = np.array([file.rated[axis] for axis in AXES]) * units
    user = np.array([file.user[axis] for axis in AXES]) * units[:, np.newaxis] if file.user else None
    ways = [way for way in (user, _basic(file, units, where)) if way is not None]
    _demand_agreement(ways, where)
    if np.linalg.cond(ways[0] / rated[:, np.newaxis]) > CONDITION:
        raise DeviceError(f"{where}: its rows do not separate six loads; ask the maker for the sensor's .cal file")
    return Calibration(ways[0], rated)


def torque_Nm(file: CalFile, where: str) -> float:
    """Return the file's unit of torque in N m: a force and a distance, in either order (N-mm, in-lbf, kg-cm)."""
    parts = file.torque_unit.replace("Nm", "N-m").replace("kgcm", "kg-cm").split("-")
    for force, distance in (parts, parts[::-1]) if len(parts) == 2 else ():
        if force in FORCE_N and distance in DISTANCE_M:
            return FORCE_N[force] * DISTANCE_M[distance]
    raise DeviceError(f"{where}: TorqueUnits {file.torque_unit!r} are not known; known are N-m, N-mm, in-lbf, kg-cm")


def _unit(name: str, known: Mapping[str, float], where: str, what: str) -> float:
    if name not in known:
        raise DeviceError(f"{where}: {what} {name!r} are not known; known are {', '.join(known)}")
    return known[name]


def _basic(file: CalFile, units: Array, where: str) -> Array | None:
    if not file.basic:
        return None
    metre = _unit(file.distance_unit, DISTANCE_M, where, "DistUnits")
    radian = _unit(file.angle_unit, ANGLE_RAD, where, "AngleUnits")
    placed = moved([part * metre for part in file.shift[:3]], [part * radian for part in file.shift[3:]])
    return np.asarray(placed @ (np.array([file.basic[axis] for axis in AXES]) * units[:, np.newaxis]), np.float64)


def _demand_agreement(ways: Sequence[Array], where: str) -> None:
    """Raise DeviceError if the two kinds of rows of a file differ, which shows a wrong digit in either."""
    if len(ways) < 2:
        return
    apart = np.abs(ways[0] - ways[1]) / np.abs(ways[0]).max(axis=1, keepdims=True)
    row = int(apart.max(axis=1).argmax())
    if apart[row].max() > AGREES:
        raise DeviceError(
            f"{where}: <UserAxis Name={AXES[row]}> and <Axis Name={AXES[row]}> with <BasicTransform> disagree by"
            f" {100 * apart[row].max():.2g} %: the file was altered; ask the maker for the sensor's .cal file"
        )
