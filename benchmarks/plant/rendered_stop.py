"""A stop rendered by a computer: sampled and held, it creates energy that the arm's damping must absorb.

Colgate and Schenkel (1997): a wall of stiffness K and damping B, sampled with period T and held, is passive if and only
if the arm's physical damping b exceeds K T / 2 + |B|. Here the largest stable stiffness is measured in simulation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from palpate.devices.door.plant.dynamics import Dynamics
from palpate.devices.door.plant.hand import push
from palpate.devices.door.plant.parameters import TICK_S, Arm, Brake, Parameters

DEPTH_RAD = 1e-3
"""The depth to which a constant torque presses the arm into the rendered stop, so that it stays in contact."""
NUDGE = 1e-2
"""The disturbance, as a share of the resting depth."""
GONE = 1e-2
"""The share of the nudge below which a swing has ended."""
GROWN = 20.0
"""The multiple of the nudge above which a swing will not decay; the arm is still in the wall, so all is linear."""
WALL_RAD = 1.0
"""The angle of the rendered stop, far from the mechanical ones."""
Move = Callable[[float], float]
"""A function that holds a torque for one period and returns the arm's angle after it."""


@dataclass(frozen=True)
class Wall:
    """A rendered stop on an arm: the arm's inertia and damping, the wall's damping, and the sampling period."""

    inertia_kg_m2: float
    arm_damping_Nm_s_rad: float
    wall_damping_Nm_s_rad: float = 0.0
    period_s: float = TICK_S

    def periods(self, stiffness_Nm_rad: float) -> int:
        """Return the duration in periods: eight swings, and enough to see whether a light arm settles."""
        swing_s = 2 * math.pi * math.sqrt(self.inertia_kg_m2 / stiffness_Nm_rad)
        least = 80 if self.inertia_kg_m2 < 0.1 * self.arm_damping_Nm_s_rad * self.period_s else 300
        return max(least, math.ceil(8 * swing_s / self.period_s))

    @property
    def theory_Nm_rad(self) -> float:
        """The largest stiffness by Colgate's condition."""
        return 2 * (self.arm_damping_Nm_s_rad - abs(self.wall_damping_Nm_s_rad)) / self.period_s


def light(damping_Nm_s_rad: float, share: float = 0.0) -> Wall:
    """Return an arm whose own motion ends within a hundredth of a period, so that only its damping opposes the wall."""
    return Wall(damping_Nm_s_rad * TICK_S / 100, damping_Nm_s_rad, share * damping_Nm_s_rad)


def heavy(damping_Nm_s_rad: float, share: float = 0.0) -> Wall:
    """Return an arm that swings in the wall for some thirty periods at the limit of stability."""
    return Wall(50 * damping_Nm_s_rad * TICK_S, damping_Nm_s_rad, share * damping_Nm_s_rad)


def stiffest(wall: Wall, start: Callable[[Wall, float], Move], halvings: int = 12) -> float:
    """Return the largest stiffness, in N m/rad, at which a nudge decays; 12 halvings leave 0.2 %."""
    low, high = 0.25 * wall.theory_Nm_rad, 8 * wall.arm_damping_Nm_s_rad / wall.period_s
    for _ in range(halvings):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if dies_away(wall, middle, start) else (low, middle)
    return math.sqrt(low * high)


def dies_away(wall: Wall, stiffness_Nm_rad: float, start: Callable[[Wall, float], Move]) -> bool:
    """Return whether the arm comes to rest in the wall after a nudge: its late swing is smaller than the early one."""
    before = angle = WALL_RAD + DEPTH_RAD * (1 + NUDGE)
    move = start(wall, angle)
    swings = []
    for _ in range(wall.periods(stiffness_Nm_rad)):
        speed = (angle - before) / wall.period_s
        pushed = max(0.0, stiffness_Nm_rad * (angle - WALL_RAD) + wall.wall_damping_Nm_s_rad * speed)
        before, angle = angle, move(stiffness_Nm_rad * DEPTH_RAD - (pushed if angle > WALL_RAD else 0.0))
        swings.append(abs(angle - WALL_RAD - DEPTH_RAD))
        if not swings[-1] < GROWN * NUDGE * DEPTH_RAD:
            return False
    fifth = len(swings) // 5
    late = max(swings[-fifth:])
    return late < GONE * NUDGE * DEPTH_RAD or late < max(swings[fifth : 2 * fifth])


def by_default(wall: Wall, angle_rad: float) -> Move:
    """Return the arm moved by the machine's own integrator."""
    arm = Arm(
        inertia_kg_m2=wall.inertia_kg_m2, viscous_Nm_s_rad=wall.arm_damping_Nm_s_rad, coulomb_Nm=0.0, high_stop_rad=3.0
    )
    dynamics = Dynamics(Parameters(arm=arm, brake=Brake(drag_Nm=0.0)), angle_rad)

    def move(torque_Nm: float) -> float:
        dynamics.advance(0.0, 0.0, push(torque_Nm), 0.0, wall.period_s)
        return dynamics.angle_rad

    return move


def by_semi_implicit_euler(parts: int) -> Callable[[Wall, float], Move]:
    """Return the arm moved by semi-implicit Euler, in `parts` steps to a period."""

    def start(wall: Wall, angle_rad: float) -> Move:
        state, h = [angle_rad, 0.0], wall.period_s / parts

        def move(torque_Nm: float) -> float:
            angle, speed = state
            for _ in range(parts):
                speed += h * (torque_Nm - wall.arm_damping_Nm_s_rad * speed) / wall.inertia_kg_m2
                angle += h * speed
            state[:] = angle, speed
            return angle

        return move

    return start
