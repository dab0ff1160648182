"""From six gauge voltages to forces and torques: units, transforms, temperature, and the multiplication itself.

Conventions are those of the maker's C library: a transform moves the origin by d in the sensor's axes and then turns
the axes about x, y and z in this order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.devices.daq.cal_file import AXES, CalFile
from palpate.devices.signals import DeviceError
from palpate.signals import GRAVITY_M_S2
from palpate.signals.arrays import Array

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
"""How far the file's two ways to one matrix may differ, as a share of a row's largest value: both are rounded."""
CONDITION = 1e4
"""Of the matrix, its rows taken relative to the rated loads: beyond it, six gauges do not tell six loads apart."""


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
    """Forces and torques of shape (n, 6): matrix x (volts - bias). Gauges of shape (n, 6)."""
    return np.asarray((gauges_V - bias_V) @ matrix.T, np.float64)


def compensated(gauges_V: Array, thermistor_V: Array, slopes: Slopes) -> Array:
    """Gauge volts as they were at the reference temperature, of shape (n, 6); the thermistor of shape (n,).

    (volts + bias slope x dT) / (1 - gain slope x dT), with dT the thermistor's volts above the reference.
    """
    warmer = (thermistor_V - slopes.reference_V)[:, np.newaxis]
    return np.asarray((gauges_V + slopes.bias * warmer) / (1.0 - slopes.gain * warmer), np.float64)


def moved(distance_m: Sequence[float], angle_rad: Sequence[float]) -> Array:
    """The matrix of shape (6, 6) that tells a wrench at another origin and in other axes."""
    (sx, sy, sz), (cx, cy, cz) = np.sin(angle_rad), np.cos(angle_rad)
    about_x = np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
    about_y = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
    about_z = np.array([[cz, sz, 0], [-sz, cz, 0], [0, 0, 1]])
    turned = about_z @ about_y @ about_x
    dx, dy, dz = distance_m
    crossed = np.array([[0, -dz, dy], [dz, 0, -dx], [-dy, dx, 0]])
    return np.block([[turned, np.zeros((3, 3))], [-turned @ crossed, turned]])


def calibration(file: CalFile, where: str) -> Calibration:
    """The file's matrix and rated loads in N and N m.

    Raises:
        DeviceError: an unknown unit, two matrices in the file that disagree, or one that cannot be undone.
    """
    units = np.array([_unit(file.force_unit, FORCE_N, where, "ForceUnits")] * 3 + [torque_Nm(file, where)] * 3)
    rated = np.array([file.rated[axis] for axis in AXES]) * units
    ways = [way for way in (_user(file, units), _basic(file, units, where)) if way is not None]
    _demand_agreement(ways, where)
    if np.linalg.cond(ways[0] / rated[:, np.newaxis]) > CONDITION:
        raise DeviceError(f"{where}: its rows do not tell six loads apart; ask the maker for the sensor's .cal file")
    return Calibration(ways[0], rated)


def torque_Nm(file: CalFile, where: str) -> float:
    """The file's unit of torque in N m: a force and a distance, in either order (N-mm, in-lbf, kg-cm)."""
    parts = file.torque_unit.replace("Nm", "N-m").replace("kgcm", "kg-cm").split("-")
    for force, distance in (parts, parts[::-1]) if len(parts) == 2 else ():
        if force in FORCE_N and distance in DISTANCE_M:
            return FORCE_N[force] * DISTANCE_M[distance]
    raise DeviceError(f"{where}: TorqueUnits {file.torque_unit!r} are not known; known are N-m, N-mm, in-lbf, kg-cm")


def _unit(name: str, known: Mapping[str, float], where: str, what: str) -> float:
    if name not in known:
        raise DeviceError(f"{where}: {what} {name!r} are not known; known are {', '.join(known)}")
    return known[name]


def _user(file: CalFile, units: Array) -> Array | None:
    if not file.user:
        return None
    return np.array([file.user[axis] for axis in AXES]) * units[:, np.newaxis]


def _basic(file: CalFile, units: Array, where: str) -> Array | None:
    if not file.basic:
        return None
    metre = _unit(file.distance_unit, DISTANCE_M, where, "DistUnits")
    radian = _unit(file.angle_unit, ANGLE_RAD, where, "AngleUnits")
    placed = moved([each * metre for each in file.shift[:3]], [each * radian for each in file.shift[3:]])
    return np.asarray(placed @ (np.array([file.basic[axis] for axis in AXES]) * units[:, np.newaxis]), np.float64)


def _demand_agreement(ways: Sequence[Array], where: str) -> None:
    """A file with both kinds of rows has a check in it: a wrong digit in either shows."""
    if len(ways) < 2:
        return
    apart = np.abs(ways[0] - ways[1]) / np.abs(ways[0]).max(axis=1, keepdims=True)
    row = int(apart.max(axis=1).argmax())
    if apart[row].max() > AGREES:
        raise DeviceError(
            f"{where}: <UserAxis Name={AXES[row]}> and <Axis Name={AXES[row]}> with <BasicTransform> disagree by"
            f" {100 * apart[row].max():.2g} %: the file was altered; ask the maker for the sensor's .cal file"
        )
