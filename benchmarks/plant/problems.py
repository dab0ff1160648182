"""Stiff and dry problems on which integrators are compared: one arm, one hand, commands held between steps."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace

from palpate.devices.door.plant.dynamics import Dynamics
from palpate.devices.door.plant.hand import Hand, constant_velocity, human, impedance
from palpate.devices.door.plant.parameters import Arm, Brake, Motor, Parameters

SAMPLE_S = 0.02
"""The interval at which solutions are compared; every step size divides it."""


@dataclass(frozen=True)
class Command:
    """A command from a time on until the next one."""

    at_s: float
    motor_Nm: float
    brake_A: float


@dataclass(frozen=True)
class Problem:
    """An initial value problem whose commands change at whole samples."""

    name: str
    parameters: Parameters
    hand: Hand
    commands: tuple[Command, ...]
    angle_rad: float
    velocity_rad_s: float
    duration_s: float

    @property
    def samples(self) -> int:
        """The number of angles of a solution, including the start."""
        return round(self.duration_s / SAMPLE_S) + 1

    def command(self, t_s: float) -> Command:
        """Return the command from t on."""
        return self.commands[bisect_right([command.at_s for command in self.commands], t_s + 1e-9) - 1]


def problems() -> tuple[Problem, ...]:
    """Return problems from a rubber buffer to steel on steel, and an arm that sticks and slips."""
    pull, gentle = (Command(0.0, 3.0, 0.0),), (Command(0.0, 0.2, 0.0),)
    person = human(opening_s=1.2, start_s=0.0)
    return (
        Problem("rubber stop 1e3", _arm(0.5, 1e3), person, pull, 0.3, 0.5, 1.6),
        Problem("hard stop 1e6", _arm(0.25, 1e6), impedance(1.3, 20, 0.2), pull, 0.7, 1.0, 1.2),
        Problem("steel 1e8, light arm", _arm(0.01, 1e8), impedance(1.3, 0.5, 0.01), gentle, 1.0, 0.5, 0.8),
        sticking(),
        Problem("steel 1e8, heavy arm", _arm(20.0, 1e8), impedance(1.3, 80, 4), pull, 0.9, 1.0, 1.2),
    )


def sticking() -> Problem:
    """Return a soft hand that drags the arm at a constant speed while the brake steps: it sticks and slips."""
    arm = replace(_arm(1.0, 1e4).arm, coulomb_Nm=1.0, stiction=1.5)
    pull = constant_velocity(0.4, 1.0, 0.0, 0.2, stiffness_Nm_rad=60.0, damping_Nm_s_rad=0.5)
    steps = tuple(
        Command(at, 0.0, amperes) for at, amperes in ((0.0, 0.0), (0.6, 0.15), (1.2, 0.05), (1.8, 0.3), (2.4, 0.0))
    )
    return Problem("stick-slip", Parameters(arm=arm), pull, steps, 0.0, 0.0, 3.0)


def solve(problem: Problem, step_s: float) -> list[float]:
    """Return the angles at the samples by the machine's own integrator."""
    dynamics = Dynamics(problem.parameters, problem.angle_rad, problem.velocity_rad_s)
    steps = round(SAMPLE_S / step_s)
    angles = [problem.angle_rad]
    for sample in range(problem.samples - 1):
        command = problem.command(sample * SAMPLE_S)
        for step in range(steps):
            start_s = (sample * steps + step) * step_s
            dynamics.advance(command.motor_Nm, command.brake_A, problem.hand, start_s, step_s)
        angles.append(dynamics.angle_rad)
    return angles


def largest_difference_rad(angles_rad: Sequence[float], reference: Sequence[float]) -> float:
    """Return the largest difference of two solutions; infinite where one is not finite."""
    if len(angles_rad) != len(reference) or not all(map(math.isfinite, angles_rad)):
        return math.inf
    return max(abs(one - other) for one, other in zip(angles_rad, reference, strict=True))


def _arm(inertia_kg_m2: float, stiffness_Nm_rad: float) -> Parameters:
    arm = Arm(
        inertia_kg_m2=inertia_kg_m2,
        stop_stiffness_Nm_rad=stiffness_Nm_rad,
        coulomb_Nm=min(0.4, 2 * inertia_kg_m2),
        viscous_Nm_s_rad=0.02,
    )
    return Parameters(arm=arm, motor=Motor(lag_s=1e-3), brake=Brake(drag_Nm=0.0))
