"""The energy that a stop returns beyond what it took, from an arm that is thrown at it, pressed and braked."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

from benchmarks.plant.explicit import FAR_RAD, Law, Stepper
from benchmarks.plant.problems import Command, Problem
from palpate.devices.door.plant.dynamics import Dynamics
from palpate.devices.door.plant.hand import push
from palpate.devices.door.plant.parameters import TICK_S, Arm, Brake, Parameters

STIFFNESS_Nm_rad = (1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8)
INERTIA_kg_m2 = (0.01, 0.1, 1.0, 5.0, 20.0)
DAMPING = (0.0, 0.2, 1.0)
GAP_RAD = 2e-3
TICKS = 300
Observe = Callable[[], tuple[float, float, float]]
"""Angle, speed and the depth of the pressed stop."""


@dataclass(frozen=True)
class Throw:
    """An arm and a stop: thrown at 1 rad/s, pressed by a torque that would accelerate it by 4 rad/s^2."""

    stiffness_Nm_rad: float
    inertia_kg_m2: float
    damping: float
    speed_rad_s: float = 1.0
    coulomb: float = 0.5
    """Dry friction as the deceleration that it causes, in rad/s^2."""

    @property
    def parameters(self) -> Parameters:
        """The arm and its brake."""
        arm = Arm(
            inertia_kg_m2=self.inertia_kg_m2, viscous_Nm_s_rad=0.0, coulomb_Nm=self.coulomb * self.inertia_kg_m2,
            stiction=1.5, stop_stiffness_Nm_rad=self.stiffness_Nm_rad, stop_damping=self.damping,
        )  # fmt: skip
        return Parameters(arm=arm, brake=Brake(drag_Nm=0.0))

    @property
    def push_Nm(self) -> float:
        """The pressing torque."""
        return 4.0 * self.inertia_kg_m2

    @property
    def start_rad(self) -> float:
        """The starting angle, just before the stop."""
        return self.parameters.arm.high_stop_rad - GAP_RAD

    def brake_A(self, tick: int) -> float:
        """Return the brake's current, which steps on and off twice."""
        return 0.05 * self.inertia_kg_m2 if tick // 60 in {1, 3} else 0.0


def grid() -> Iterator[Throw]:
    """Yield a fast throw for every stiffness, inertia and damping of the range, and slow ones for the extremes."""
    for stiffness, inertia, damping in product(STIFFNESS_Nm_rad, INERTIA_kg_m2, DAMPING):
        yield Throw(stiffness, inertia, damping)
    for stiffness, inertia in product((1e2, 1e8), (0.01, 20.0)):
        yield Throw(stiffness, inertia, 0.2, speed_rad_s=1e-3)
        yield Throw(stiffness, inertia, 0.0, coulomb=0.0)


def excess(throw: Throw, states: Iterator[tuple[float, float, float]]) -> float:
    """Return the largest rise of energy (motion, spring, place under the torque) over the throw's; inf if unbounded.

    Motor and hand only exert the torque of the potential, and everything else is friction, dampers and the stop: any
    rise is energy that the stop returned beyond what it took.
    """
    thrown = 0.5 * throw.inertia_kg_m2 * throw.speed_rad_s**2 + throw.push_Nm * GAP_RAD
    least, worst = math.inf, 0.0
    for angle, speed, depth in states:
        if not abs(angle) < FAR_RAD:
            return math.inf
        energy = 0.5 * throw.inertia_kg_m2 * speed**2 + 0.5 * throw.stiffness_Nm_rad * depth**2
        energy -= throw.push_Nm * (angle - throw.start_rad)
        worst, least = max(worst, (energy - least) / thrown), min(least, energy)
    return worst


def by_default(throw: Throw) -> Iterator[tuple[float, float, float]]:
    """Yield the states at every tick by the machine's own integrator."""
    dynamics, hand = Dynamics(throw.parameters, throw.start_rad, throw.speed_rad_s), push(throw.push_Nm)
    high = dynamics.arm.high_stop_rad
    for tick in range(TICKS):
        dynamics.advance(0.0, throw.brake_A(tick), hand)
        depth = dynamics.x if dynamics.origin == high else dynamics.angle_rad - high
        yield dynamics.angle_rad, dynamics.w, max(0.0, depth)


def by_stepper(throw: Throw, method: Stepper) -> Iterator[tuple[float, float, float]]:
    """Yield the states at every tick by a fixed-step method."""
    hand, high = push(throw.push_Nm), throw.parameters.arm.high_stop_rad
    law = Law(Problem("", throw.parameters, hand, (Command(0.0, 0.0, 0.0),), 0.0, 0.0, 0.0))
    state = throw.start_rad, throw.speed_rad_s
    for tick in range(TICKS):
        law.drives.begin(0.0, throw.brake_A(tick), hand, 0.0)
        angle, speed = method(law, 0.0, TICK_S, state)
        state = angle, law.caught(TICK_S, state[1], angle, speed) if abs(angle) < FAR_RAD else speed
        law.drives.end(TICK_S)
        yield *state, max(0.0, angle - high)
