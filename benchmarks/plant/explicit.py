"""Textbook methods with a fixed step on the same problems, with Karnopp's treatment of dry friction (1985)."""

from __future__ import annotations

import math
from collections.abc import Callable

from benchmarks.plant.problems import SAMPLE_S, Problem
from palpate.devices.door.plant.drives import Drives, torque_and_slope
from palpate.devices.door.plant.moreau import Setting, implicit_euler

FAR_RAD = 1e6
"""The angle beyond which a solution has diverged."""
STILL_RAD_S = 1e-9
State = tuple[float, float]
Stepper = Callable[["Law", float, float, State], State]


class Law:
    """The torque on the arm as a plain function of time into the period, angle and speed."""

    def __init__(self, problem: Problem) -> None:
        self.parameters, self.drives = problem.parameters, Drives(problem.parameters)
        self.arm = problem.parameters.arm
        self.stop_b = 2 * self.arm.stop_damping * math.sqrt(self.arm.stop_stiffness_Nm_rad * self.arm.inertia_kg_m2)

    def frictionless(self, t: float, angle: float, speed: float) -> float:
        """Return the sum of all torques except dry friction, in N m."""
        arm, drives = self.arm, self.drives
        torque = drives.motor(t) + drives.hand(t, angle) - (drives.damping + arm.viscous_Nm_s_rad) * speed
        for direction, place in ((1, arm.high_stop_rad), (-1, arm.low_stop_rad)):
            if (angle - place) * direction > 0.0:
                push = arm.stop_stiffness_Nm_rad * (angle - place) + self.stop_b * speed
                torque -= direction * max(0.0, direction * push)
        return torque - torque_and_slope(arm.detents, angle)[0] if arm.detents else torque

    def acceleration(self, t: float, angle: float, speed: float) -> float:
        """Return the acceleration with dry friction: at rest as much as needed, up to stiction."""
        torque, friction = self.frictionless(t, angle, speed), self.drives.friction(t)
        if abs(speed) <= STILL_RAD_S:
            if abs(torque) <= self.arm.stiction * friction:
                return 0.0
            return (torque - math.copysign(friction, torque)) / self.arm.inertia_kg_m2
        return (torque - math.copysign(friction, speed)) / self.arm.inertia_kg_m2

    def caught(self, t: float, before: float, angle: float, speed: float) -> float:
        """Return the speed, or 0 where its sign changed and friction can hold the arm."""
        if before * speed < 0.0 and abs(self.frictionless(t, angle, 0.0)) <= self.arm.stiction * self.drives.friction(
            t
        ):
            return 0.0
        return speed


def explicit_euler(law: Law, t: float, h: float, state: State) -> State:
    """Take a step of explicit Euler: order 1, unstable for an undamped oscillator of any stiffness."""
    angle, speed = state
    return angle + h * speed, speed + h * law.acceleration(t, angle, speed)


def semi_implicit_euler(law: Law, t: float, h: float, state: State) -> State:
    """Take a step of semi-implicit Euler: order 1, symplectic, stable up to h sqrt(k / J) = 2."""
    angle, speed = state
    after = law.caught(t + h, speed, angle, speed + h * law.acceleration(t, angle, speed))
    return angle + h * after, after


def runge_kutta_4(law: Law, t: float, h: float, state: State) -> State:
    """Take a Runge-Kutta step: order 4 where the right side is smooth, stable up to h sqrt(k / J) = 2.8."""
    angle, speed = state
    a1 = law.acceleration(t, angle, speed)
    v2 = speed + 0.5 * h * a1
    a2 = law.acceleration(t + 0.5 * h, angle + 0.5 * h * speed, v2)
    v3 = speed + 0.5 * h * a2
    a3 = law.acceleration(t + 0.5 * h, angle + 0.5 * h * v2, v3)
    v4 = speed + h * a3
    a4 = law.acceleration(t + h, angle + h * v3, v4)
    return angle + h / 6 * (speed + 2 * v2 + 2 * v3 + v4), speed + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def moreau(law: Law, t: float, h: float, state: State) -> State:
    """Take a step of implicit Euler with friction and stop as sets: order 1, stable at any step, without rebound."""
    arm, drives = law.arm, law.drives
    b = drives.damping + arm.viscous_Nm_s_rad
    torque = drives.motor(t + h) + drives.hand(t + h, 0.0)
    setting = Setting(
        arm.inertia_kg_m2, torque, drives.stiffness, b, drives.friction(t + h), arm.low_stop_rad, arm.high_stop_rad,
        arm.stop_stiffness_Nm_rad, law.stop_b,
    )  # fmt: skip
    angle, speed, _ = implicit_euler(setting, h, *state)
    return angle, speed


def solve_fixed(problem: Problem, method: Stepper, step_s: float) -> list[float]:
    """Return the angles at the samples; infinity follows where a run diverged."""
    law, state = Law(problem), (problem.angle_rad, problem.velocity_rad_s)
    steps = round(SAMPLE_S / step_s)
    angles = [problem.angle_rad]
    for sample in range(problem.samples - 1):
        command = problem.command(sample * SAMPLE_S)
        for step in range(steps):
            law.drives.begin(command.motor_Nm, command.brake_A, problem.hand, (sample * steps + step) * step_s)
            angle, speed = method(law, 0.0, step_s, state)
            if not (abs(angle) < FAR_RAD and abs(speed) < FAR_RAD**2):
                return [*angles, *[math.inf] * (problem.samples - len(angles))]
            state = angle, law.caught(step_s, state[1], angle, speed)
            law.drives.end(step_s)
        angles.append(state[0])
    return angles


FIXED: dict[str, Stepper] = {
    "explicit Euler": explicit_euler,
    "semi-implicit Euler": semi_implicit_euler,
    "RK4": runge_kutta_4,
    "implicit Euler, sets": moreau,
}
