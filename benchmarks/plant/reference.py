"""The same problems by SciPy's adaptive methods, each smooth stretch separately and every event located.

Written independently of dynamics.py on purpose (own friction, lags and events): dynamics.py is measured against it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from benchmarks.plant.problems import SAMPLE_S, Problem
from palpate.devices.door.plant.parameters import PlantError

GRAIN_S = 5e-4
"""The interval at which a resting arm is checked; its breaking away is then located exactly."""
MOST_EVENTS = 1500
"""Ten times the events of any problem; with a loose tolerance an arm at rest can reverse forever."""
Guard = Callable[[float, Any], float]


@dataclass
class Segment:
    """A stretch of held commands, with lags and powder in closed form from the end of the stretch before."""

    problem: Problem
    start_s: float
    end_s: float
    motor: tuple[float, float]
    coil: tuple[float, float]
    powder_A: float

    def motor_Nm(self, t: float) -> float:
        """Return the motor's torque."""
        begin, target = self.motor
        return target + (begin - target) * math.exp((self.start_s - t) / self.problem.parameters.motor.lag_s)

    def coil_A(self, t: float) -> float:
        """Return the coil's current."""
        begin, target = self.coil
        return target + (begin - target) * math.exp((self.start_s - t) / self.problem.parameters.brake.lag_s)

    def powder(self, t: float) -> float:
        """Return the powder's share of the current, which lags behind it by the play."""
        play, coil = self.problem.parameters.brake.play_A, self.coil_A(t)
        return min(max(self.powder_A, coil - play), coil + play)

    def friction_Nm(self, t: float) -> float:
        """Return the dry friction while sliding."""
        brake = self.problem.parameters.brake
        return (
            self.problem.parameters.arm.coulomb_Nm
            + brake.drag_Nm
            + min(max(brake.gain_Nm_A * self.powder(t), 0.0), brake.limit_Nm)
        )


@dataclass
class Mode:
    """The smooth equation that holds: sliding direction, pressed stop, and a stop whose surface is still recovering."""

    slide: int
    side: int
    left: int


class Adaptive:
    """One solution of a problem by one SciPy method at one tolerance."""

    def __init__(self, problem: Problem, method: str, rtol: float, atol: float) -> None:
        self.problem, self.arm = problem, problem.parameters.arm
        self.options = {"method": method, "rtol": rtol, "atol": atol}
        self.stop_b = 2 * self.arm.stop_damping * math.sqrt(self.arm.stop_stiffness_Nm_rad * self.arm.inertia_kg_m2)
        self.mode = Mode(int(np.sign(problem.velocity_rad_s)), 0, 0)
        self.state = np.array([problem.angle_rad, problem.velocity_rad_s])

    def angles(self) -> list[float]:
        """Return the angle at every sample."""
        angles_rad = np.full(self.problem.samples, np.nan)
        angles_rad[0], events = self.problem.angle_rad, 0
        for segment in segments(self.problem):
            t = segment.start_s
            while t < segment.end_s - 1e-12:
                if (events := events + 1) > MOST_EVENTS:
                    raise PlantError(f"{self.options['method']}, rtol {self.options['rtol']:g}: chatters at {t:g} s.")
                t = self._smooth(segment, t, angles_rad) if self.mode.slide else self._rest(segment, t, angles_rad)
        return [float(angle) for angle in angles_rad]

    def _torque(self, segment: Segment, t: float, angle: float, speed: float) -> float:
        """Return the sum of all torques except dry friction."""
        hand = self.problem.hand
        goal, pace = hand.path(t)
        torque = (
            segment.motor_Nm(t)
            + hand.torque_Nm
            + hand.stiffness_Nm_rad * (goal - angle)
            + hand.damping_Nm_s_rad * (pace - speed)
        )
        torque -= self.arm.viscous_Nm_s_rad * speed
        return torque - self._press(angle, speed, self.mode.side) * self.mode.side if self.mode.side else torque

    def _press(self, angle: float, speed: float, side: int) -> float:
        place = self.arm.high_stop_rad if side > 0 else self.arm.low_stop_rad
        return side * (self.arm.stop_stiffness_Nm_rad * (angle - place) + self.stop_b * speed)

    def _smooth(self, segment: Segment, t: float, angles: Any) -> float:
        def right(t: float, y: Any) -> list[float]:
            torque = self._torque(segment, t, y[0], y[1]) - self.mode.slide * segment.friction_Nm(t)
            return [y[1], torque / self.arm.inertia_kg_m2]

        guards = self._guards()
        wanted_s = [*_samples(t, segment.end_s), segment.end_s]
        run = solve_ivp(
            right, (t, segment.end_s), self.state, t_eval=wanted_s, events=list(guards.values()), **self.options
        )
        if run.status < 0:
            raise PlantError(f"{self.options['method']}, rtol {self.options['rtol']:g}: {run.message}")
        for at, state in zip(run.t, np.transpose(run.y), strict=True):
            if _is_sample(at):
                angles[round(at / SAMPLE_S)] = state[0]
        for event, times, states in zip(guards, run.t_events, run.y_events, strict=True):
            if len(times):
                self.state = np.array(states[-1])
                self._enter(segment, float(times[-1]), event)
                return float(times[-1])
        self.state = run.y[:, -1]
        return segment.end_s

    def _guards(self) -> dict[str, Guard]:
        """Return the functions that fall through zero at the events that can end this mode."""
        mode, arm = self.mode, self.arm
        guards: dict[str, Guard] = {"turn": lambda _t, y: mode.slide * y[1]}
        if mode.side:
            guards["leave"] = lambda _t, y: self._press(y[0], y[1], mode.side)
        elif mode.left:
            place = arm.high_stop_rad if mode.left > 0 else arm.low_stop_rad
            guards["back"] = lambda _t, y: mode.left * (y[0] - place)
            guards["again"] = lambda _t, y: -self._press(y[0], y[1], mode.left)
        else:
            guards["high"] = lambda _t, y: arm.high_stop_rad - y[0]
            guards["low"] = lambda _t, y: y[0] - arm.low_stop_rad
        for guard in guards.values():
            vars(guard).update(terminal=True, direction=-1.0)
        return guards

    def _enter(self, segment: Segment, t: float, event: str) -> None:
        mode = self.mode
        if event == "turn":
            self.state[1] = 0.0
            self.mode = Mode(self._breaks(segment, t), mode.side, mode.left)
        elif event in {"high", "low"}:
            self.state[0] = self.arm.high_stop_rad if event == "high" else self.arm.low_stop_rad
            self.mode = Mode(mode.slide, 1 if event == "high" else -1, 0)
        elif event == "again":
            self.mode = Mode(mode.slide, mode.left, 0)
        else:
            # Without a damper the push ends where the stop begins: its surface is back at once.
            left = mode.side if event == "leave" and self.stop_b else 0
            self.mode = Mode(mode.slide, 0, left)

    def _breaks(self, segment: Segment, t: float) -> int:
        torque = self._torque(segment, t, self.state[0], 0.0)
        return int(np.sign(torque)) if abs(torque) > self.arm.stiction * segment.friction_Nm(t) else 0

    def _rest(self, segment: Segment, t: float, angles: Any) -> float:
        """Stay at rest until friction can no longer hold; locate that moment by a coarse scan and then exactly."""

        def over(t: float) -> float:
            return float(abs(self._torque(segment, t, self.state[0], 0.0)) - self.arm.stiction * segment.friction_Nm(t))

        grid = np.linspace(t, segment.end_s, max(2, math.ceil((segment.end_s - t) / GRAIN_S) + 1))
        passed = next((k for k, at in enumerate(grid) if over(at) > 0), None)
        until = segment.end_s if passed is None else float(grid[passed])
        if passed:
            until = float(brentq(over, grid[passed - 1], until, xtol=1e-15, rtol=1e-15))
        for at in [*_samples(t, until), until]:
            if _is_sample(at):
                angles[round(at / SAMPLE_S)] = self.state[0]
        if passed is not None:
            self.mode = Mode(
                int(np.sign(self._torque(segment, until, self.state[0], 0.0))), self.mode.side, self.mode.left
            )
        return until


def segments(problem: Problem) -> Iterator[Segment]:
    """Yield stretches between commands, cut where the powder begins to follow the current."""
    ends = [*(command.at_s for command in problem.commands[1:]), problem.duration_s]
    motor_Nm = coil_A = powder_A = 0.0
    for command, end_s in zip(problem.commands, ends, strict=True):
        whole = Segment(problem, command.at_s, end_s, (motor_Nm, command.motor_Nm), (coil_A, command.brake_A), powder_A)
        cut = _play_end(whole)
        if cut is not None:
            yield Segment(problem, whole.start_s, cut, whole.motor, whole.coil, powder_A)
            after = (whole.motor_Nm(cut), command.motor_Nm), (whole.coil_A(cut), command.brake_A)
            yield Segment(problem, cut, end_s, *after, powder_A)
        else:
            yield whole
        motor_Nm, coil_A, powder_A = whole.motor_Nm(end_s), whole.coil_A(end_s), whole.powder(end_s)


def _play_end(segment: Segment) -> float | None:
    """Return when the current has passed the powder's play; None if it does not do so within the segment."""
    lag, play = segment.problem.parameters.brake.lag_s, segment.problem.parameters.brake.play_A
    begin, target = segment.coil
    for edge in (segment.powder_A + play, segment.powder_A - play):
        share = (edge - target) / (begin - target) if begin != target else 0.0
        if 0.0 < share < 1.0:
            cut = segment.start_s - lag * math.log(share)
            if segment.start_s + 1e-9 < cut < segment.end_s - 1e-9:
                return cut
    return None


def _samples(after_s: float, until_s: float) -> list[float]:
    """Return the sample times after one time and before another."""
    first, last = math.floor(after_s / SAMPLE_S + 1e-9) + 1, math.ceil(until_s / SAMPLE_S - 1e-9) - 1
    return [k * SAMPLE_S for k in range(first, last + 1)]


def _is_sample(t: float) -> bool:
    return abs(t / SAMPLE_S - round(t / SAMPLE_S)) < 1e-9


def solve_adaptive(problem: Problem, method: str, rtol: float) -> list[float]:
    """Return the angles at the samples by `Radau` or `LSODA` (or any other of SciPy's) at a relative tolerance.

    Raises:
        PlantError: a method that does not get past an event at this tolerance.
    """
    try:
        return Adaptive(problem, method, rtol, max(rtol * 1e-2, 1e-15)).angles()
    except ValueError as error:
        raise PlantError(f"{problem.name}, {method} at rtol {rtol:g}: {error}") from error
