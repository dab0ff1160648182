"""A mechanical door: the force a hand needs at the handle, over the opening angle.

Quasi-static along a prescribed path (a short smooth start, then constant speed), so nothing is integrated and no
stiffness can make it diverge. docs/reference/doors.md describes every term and the source of its range.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from palpate.signals import GRAVITY_M_S2
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import MAX_ANGLE_DEG, POINTS, DoorDataError, grid_angle_deg

NO_PLAY_DEG = 1e-6
"""A smaller play of the hand counts as none."""


@dataclass(frozen=True)
class CheckFeature:
    """One feature of the check link's cam: a crest to climb (energy above 0) or a detent to fall into (below 0).

    Its energy over angle is a bell with a width of its own on either side, so that a long climb can precede a
    short fall; the torque is the energy's derivative.
    """

    angle_deg: float
    energy_J: float
    width_before_deg: float
    width_after_deg: float


@dataclass(frozen=True)
class Door:
    """The parameters of one door; `RANGES` gives the range of each."""

    mass_kg: float
    centre_of_mass_m: float
    gyration_radius_m: float
    handle_radius_m: float
    hinge_tilt_deg: float
    lowest_at_deg: float
    coulomb_Nm: float
    breakaway_Nm: float
    stribeck_speed_deg_s: float
    viscous_Nm_s_rad: float
    ripple_Nm: float
    ripple_period_deg: float
    seal_Nm: float
    seal_range_deg: float
    stop_at_deg: float
    stop_stiffness_Nm_rad: float
    stop_onset_deg: float
    pull_limit_N: float
    take_up_deg: float
    speed_deg_s: float
    start_deg: float
    opens_to_deg: float
    check: tuple[CheckFeature, ...] = ()


RANGES: dict[str, tuple[float, float]] = {
    "mass_kg": (5, 80),
    "centre_of_mass_m": (0.1, 1.2),
    "gyration_radius_m": (0.1, 1.5),
    "handle_radius_m": (0.3, 1.5),
    "hinge_tilt_deg": (0, 10),
    "lowest_at_deg": (-180, 180),
    "coulomb_Nm": (0, 60),
    "breakaway_Nm": (0, 90),
    "stribeck_speed_deg_s": (0.01, 100),
    "viscous_Nm_s_rad": (0, 100),
    "ripple_Nm": (0, 10),
    "ripple_period_deg": (0.5, 62),
    "seal_Nm": (0, 60),
    "seal_range_deg": (0.1, 20),
    "stop_at_deg": (10, 90),
    "stop_stiffness_Nm_rad": (1e2, 1e8),
    "stop_onset_deg": (0.01, 5),
    "pull_limit_N": (1, 500),
    "take_up_deg": (0, 5),
    "speed_deg_s": (0, 180),
    "start_deg": (0.5, 30),
    "opens_to_deg": (10, 90),
}
CHECK_RANGES: dict[str, tuple[float, float]] = {
    "angle_deg": (0, 90),
    "energy_J": (-20, 20),
    "width_before_deg": (0.2, 30),
    "width_after_deg": (0.2, 30),
}


def simulate(door: Door, where: str = "door") -> Array:
    """Return the force at the handle in newtons on the 621 grid points, zero-padded beyond `opens_to_deg`.

    There is no sensor noise, as the measured door beside the simulated ones is low-pass filtered.

    Raises:
        DoorDataError: a parameter outside its range; `where` names the door in the message.
    """
    check_ranges(door, where)
    angle_deg = np.array([grid_angle_deg(index) for index in range(POINTS)])
    force_N = hand_force(door, angle_deg)
    force_N[angle_deg > min(door.opens_to_deg, MAX_ANGLE_DEG) + 1e-9] = 0.0
    return force_N


def hand_force(door: Door, angle_deg: Array) -> Array:
    """Return the force at the handle in newtons at any angles, in degrees, within the door's travel.

    The hand takes up its play first: at 0 degrees the force is 0 unless `take_up_deg` is 0.
    """
    torque_Nm = (
        gravity_torque(door, angle_deg)
        + friction_torque(door, angle_deg)
        + inertia_torque(door, angle_deg)
        + check_torque(door.check, angle_deg)
        + seal_torque(door, angle_deg)
    )
    pulled_N = torque_Nm / door.handle_radius_m
    if door.take_up_deg > NO_PLAY_DEG:
        pulled_N *= -np.expm1(-angle_deg / door.take_up_deg)
    return pulled_N + stop_force(door, angle_deg)


def gravity_torque(door: Door, angle_deg: Array) -> Array:
    """Return the torque of the weight about an inclined hinge axis; zero where the door hangs lowest."""
    weight_Nm = door.mass_kg * GRAVITY_M_S2 * door.centre_of_mass_m
    swing = np.sin(np.radians(angle_deg - door.lowest_at_deg))
    return np.asarray(weight_Nm * math.sin(math.radians(door.hinge_tilt_deg)) * swing)


def friction_torque(door: Door, angle_deg: Array) -> Array:
    """Return the torque of Coulomb friction with its breakaway rise (Stribeck), viscous damping and hinge ripple."""
    # The square of the opening speed rises smoothly (with two derivatives) over the start, then stays.
    share = np.clip(angle_deg / door.start_deg, 0, 1)
    speed = np.asarray(door.speed_deg_s * np.sqrt(share**3 * (10 + share * (6 * share - 15))))
    rise = (door.breakaway_Nm - door.coulomb_Nm) * np.exp(-((speed / door.stribeck_speed_deg_s) ** 2))
    ripple = door.ripple_Nm * np.sin(2 * np.pi * angle_deg / door.ripple_period_deg)
    return np.asarray(door.coulomb_Nm + rise + door.viscous_Nm_s_rad * np.radians(speed) + ripple)


def inertia_torque(door: Door, angle_deg: Array) -> Array:
    """Return the torque that accelerates the door: the derivative of its kinetic energy over the angle."""
    share = np.clip(angle_deg / door.start_deg, 0, 1)
    inertia_kg_m2 = door.mass_kg * door.gyration_radius_m**2
    energy_J = 0.5 * inertia_kg_m2 * math.radians(door.speed_deg_s) ** 2
    return np.asarray(energy_J * 30 * (share * (1 - share)) ** 2 / math.radians(door.start_deg))


def check_torque(check: tuple[CheckFeature, ...], angle_deg: Array) -> Array:
    """Return the torque of the check link: minus to plus through each detent, plus to minus over each crest."""
    total = np.zeros_like(angle_deg)
    for feature in check:
        away = np.radians(angle_deg - feature.angle_deg)
        width = np.radians(np.where(away < 0, feature.width_before_deg, feature.width_after_deg))
        total -= feature.energy_J * away / width**2 * np.exp(-0.5 * (away / width) ** 2)
    return total


def seal_torque(door: Door, angle_deg: Array) -> Array:
    """Return the torque of the compressed weatherstrip, which pushes the door open over the first few degrees."""
    return np.asarray(-door.seal_Nm * np.exp(-angle_deg / door.seal_range_deg))


def stop_force(door: Door, angle_deg: Array) -> Array:
    """Return the force of the end stop: a smooth onset, then its stiffness, never more than the hand pulls.

    The limit makes any stiffness safe: a person stops pulling, and the recording ends there.
    """
    pressed = np.logaddexp(0, (angle_deg - door.stop_at_deg) / door.stop_onset_deg) * door.stop_onset_deg
    force_N = door.stop_stiffness_Nm_rad * np.radians(pressed) / door.handle_radius_m
    return np.asarray(-door.pull_limit_N * np.expm1(-force_N / door.pull_limit_N))


def check_ranges(door: Door, where: str) -> None:
    """Raise DoorDataError that names the first parameter outside its range."""
    _within(door, RANGES, where)
    for number, feature in enumerate(door.check, start=1):
        _within(feature, CHECK_RANGES, f"{where}, check feature {number}")


def _within(parameters: Door | CheckFeature, ranges: dict[str, tuple[float, float]], where: str) -> None:
    for field in fields(parameters):
        if field.name not in ranges:
            continue
        low, high = ranges[field.name]
        value = getattr(parameters, field.name)
        if not (isinstance(value, int | float) and low <= value <= high):
            raise DoorDataError(f"{where}: {field.name} is {value!r}, expected a number from {low:g} to {high:g}.")
