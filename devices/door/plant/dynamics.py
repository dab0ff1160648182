"""The arm in motion: implicit steps between located events, with dry friction as a set and one-sided stops.

Between two events (turning, breaking away, touching or leaving a stop) the arm is a smooth oscillator, for
J x'' + b x' + k x + n(x) = f(t), stepped by the two-stage Gauss method of order 4 (Hairer, Lubich and Wanner 2006,
II.1). It is stable for every step size, and because it keeps quadratic invariants, the balance of kinetic energy,
spring energy and work holds exactly at its stages, at any stiffness. Events are located inside the step.
docs/explanation/door-plant.md has the equations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import ceil, inf, sqrt

from palpate.devices.door.plant.drives import Drives, stiffest, torque_and_slope
from palpate.devices.door.plant.hand import NOBODY, Hand
from palpate.devices.door.plant.moreau import Setting, implicit_euler
from palpate.devices.door.plant.parameters import TICK_S, Parameters

FINE = 0.3
"""Largest step within a relevant oscillation, in radians of its phase."""
QUIET_RAD = 1e-8
"""A smaller oscillation is not resolved, as the step is stable without."""
MOST = 4000
"""Greatest number of steps within a period, before its rest is left to one implicit Euler step."""
TURN, HIGH, LOW, LEAVE, AGAIN = range(1, 6)
"""Events: the speed passes zero, the arm touches the high or the low stop, the push ends, the push begins again before
the stop is back.
"""
R = sqrt(3) / 6
C1, C2 = 0.5 - R, 0.5 + R
A12, A21 = 0.25 - R, 0.25 + R
D12, D21, D = 0.125 - R / 2, 0.125 + R / 2, 1 / 24
E1, E2 = 0.25 + R / 2, 0.25 - R / 2
CLOSE_RAD = 1e-14
"""Newton's iteration on a nonlinear spring ends at a smaller change."""
Stages = tuple[float, float, float, float, float, float]
"""Offset and speed at the end, offsets at the two stages, speeds at the two stages."""
Spring = Callable[[float], tuple[float, float]]
"""Offset -> torque and its slope."""
CLOSE = 1e-13
"""Width of the bracket at the end, as a share of the interval."""


class Dynamics:
    """Angle and velocity of the arm, which `advance` moves through time.

    The angle is stored as an offset from `origin`, the position of the stop that was touched last: a stop of 1e8 N
    m/rad is pressed by nanoradians, which an angle near 1 rad could not represent.
    """

    __slots__ = (
        "_b", "_k", "arm", "damping", "drives", "end", "inertia", "ledger", "left", "notch_k", "origin",
        "side", "slide", "stages", "stiffness", "w", "x",
    )  # fmt: skip

    def __init__(self, parameters: Parameters, angle_rad: float = 0.0, velocity_rad_s: float = 0.0) -> None:
        self.arm, self.inertia = parameters.arm, parameters.arm.inertia_kg_m2
        self.stiffness = parameters.arm.stop_stiffness_Nm_rad
        self.damping = 2 * self.arm.stop_damping * sqrt(self.stiffness * self.inertia)
        self.drives, self.ledger, self.notch_k = Drives(parameters), Ledger(), stiffest(self.arm.detents)
        self.origin, self.x, self.w = 0.0, angle_rad, velocity_rad_s
        self.side = self.left = 0
        self.slide = (velocity_rad_s > 0) - (velocity_rad_s < 0)
        self._k = self._b = 0.0
        self.end: Stages = (angle_rad, velocity_rad_s, angle_rad, angle_rad, 0.0, 0.0)
        self.stages = (0.0,) * 6
        for side, place in ((1, self.arm.high_stop_rad), (-1, self.arm.low_stop_rad)):
            if (angle_rad - place) * side > 0:
                self._touch(side, angle_rad - place)

    @property
    def angle_rad(self) -> float:
        """Return the arm's angle in radians."""
        return self.origin + self.x

    def hand_torque(self) -> float:
        """Return the hand's torque now, positive opening, as a sensor at the handle measures it."""
        drives = self.drives
        return drives.hand(drives.until, self.origin) - drives.stiffness * self.x - drives.damping * self.w

    def advance(
        self, motor_Nm: float, brake_A: float, hand: Hand, start_s: float = 0.0, duration_s: float = TICK_S
    ) -> None:
        """Move through one period of held commands, beginning at `start_s` on the hand's clock."""
        self.drives.begin(motor_Nm, brake_A, self._gripped(hand, start_s), start_s)
        t, steps, close = 0.0, 0, duration_s * (1 - 1e-12)
        while t < close:
            self._mode()
            if steps == MOST:
                self._last_resort(t, duration_s - t)
                break
            t = self._move(t, duration_s - t) if self.slide else self._rest(t, duration_s)
            steps += 1
        self.drives.end(duration_s)

    def _gripped(self, hand: Hand, start_s: float) -> Hand:
        """Return the hand, or NOBODY while it would have to hold more than its grip."""
        if hand.grip_Nm == inf:
            return hand
        angle, speed = hand.path(start_s)
        pull = hand.stiffness_Nm_rad * (angle - self.angle_rad) + hand.damping_Nm_s_rad * (speed - self.w)
        return hand if abs(pull) <= hand.grip_Nm else NOBODY

    def _mode(self) -> None:
        """Set stiffness and damping of everything that acts on the arm now."""
        drives = self.drives
        self._k, self._b = drives.stiffness, drives.damping + self.arm.viscous_Nm_s_rad
        if self.side:
            self._k += self.stiffness
            self._b += self.damping

    def _move(self, t: float, rest: float) -> float:
        """Take one step while sliding, up to the first event in it, and return the time reached."""
        h = self._forward(t, self._size(t, rest))
        event, passed = 0, self._passed(0)
        while passed:
            event = passed
            h = first_zero(partial(self._guard_at, t, event), 0.0, h, self._guard(event, self.x, self.w), -1.0)
            self._trial(t, h)
            passed = self._passed(event)
        self._commit(h)
        self._enter(event, t + h)
        return t + h

    def _forward(self, t: float, h: float) -> float:
        """Try a step, halved until the arm slides in one direction at both stages, and return its size."""
        self._trial(t, h)
        for _ in range(40):
            _, w, _, _, v1, v2 = self.end
            if self.slide * w < 0.0 or (self.slide * v1 >= 0.0 and self.slide * v2 >= 0.0):
                break
            h *= 0.5
            self._trial(t, h)
        return h

    def _size(self, t: float, rest: float) -> float:
        """Return the step size: the whole rest unless a relevant oscillation is faster."""
        rate = max(sqrt((self._k + self.notch_k) / self.inertia), self._b / self.inertia)
        if rate * rest <= 1.25 * FINE:
            return rest
        # All that acts on an arm that rests at the origin, but stops and detents.
        drives = self.drives
        torque = drives.motor(t) + drives.hand(t, self.origin) - self.slide * drives.friction(t)
        away = self.x - torque / self._k if self._k else 0.0
        pace = self.w if self._k else self.w - torque / self._b
        if abs(away) + abs(pace) / rate <= QUIET_RAD and not self.notch_k:
            return rest
        return rest / ceil(rest * rate / FINE)

    def _trial(self, t: float, h: float) -> None:
        """Try a step of size h; `end` holds its result and `stages` its inputs until the next trial."""
        drives, slide, t1, t2 = self.drives, self.slide, t + C1 * h, t + C2 * h
        m1, p1, r1 = drives.motor(t1), drives.hand(t1, self.origin), drives.friction(t1)
        m2, p2, r2 = drives.motor(t2), drives.hand(t2, self.origin), drives.friction(t2)
        self.stages = m1, m2, p1, p2, r1, r2
        f1, f2 = m1 + p1 - slide * r1, m2 + p2 - slide * r2
        if self.notch_k:
            spring = self._notches
            self.end = gauss_step_nonlinear(h, self.x, self.w, self.inertia, self._b, self._k, f1, f2, spring)
        else:
            self.end = gauss_step(h, self.x, self.w, self.inertia, self._b, self._k, f1, f2)

    def _notches(self, x: float) -> tuple[float, float]:
        return torque_and_slope(self.arm.detents, self.origin + x)

    def _guard_at(self, t: float, event: int, h: float) -> float:
        self._trial(t, h)
        return self._guard(event, self.end[0], self.end[1])

    def _guard(self, event: int, x: float, w: float) -> float:
        """Return the value that passes from positive to negative at an event."""
        if event == TURN:
            return self.slide * w
        if event == HIGH:
            return self.arm.high_stop_rad - self.origin - x
        if event == LOW:
            return self.origin - self.arm.low_stop_rad + x
        if event == LEAVE:
            return self.side * (self.stiffness * x + self.damping * w)
        return -self.left * (self.stiffness * x + self.damping * w)

    def _passed(self, known: int) -> int:
        """Return an event, other than the known one, that the trial step passed; 0 for none."""
        x, w = self.end[0], self.end[1]
        if self.slide * w < 0.0 and known != TURN:
            return TURN
        if self.side:
            return LEAVE if known != LEAVE and self._guard(LEAVE, x, w) < 0.0 else 0
        if self.left and self.left * x > 0.0:
            return AGAIN if known != AGAIN and self._guard(AGAIN, x, w) < 0.0 else 0
        if known != HIGH and self._guard(HIGH, x, w) < 0.0:
            return HIGH
        return LOW if known != LOW and self._guard(LOW, x, w) < 0.0 else 0

    def _enter(self, event: int, t: float) -> None:
        """Change to the state after the event."""
        if event == TURN:
            self.w, self.slide = 0.0, self._breaks(t)
        elif event in {HIGH, LOW}:
            self._touch(1 if event == HIGH else -1, 0.0)
        elif event == LEAVE:
            self.left, self.side = self.side, 0
        elif event == AGAIN:
            self.side, self.left = self.left, 0
        if self.left and self.left * self.x <= 0.0:
            self.left = 0

    def _touch(self, side: int, pressed: float) -> None:
        self.side, self.left, self.x = side, 0, pressed
        self.origin = self.arm.high_stop_rad if side > 0 else self.arm.low_stop_rad

    def _commit(self, h: float) -> None:
        """Accept the trial step, and record the work of its two stages."""
        x1, x2, v1, v2 = self.end[2:]
        motor1, motor2, pull1, pull2, rub1, rub2 = self.stages
        drives, ledger, half = self.drives, self.ledger, 0.5 * h
        ledger.motor_J += half * (motor1 * v1 + motor2 * v2)
        ledger.friction_J += half * self.slide * (rub1 * v1 + rub2 * v2)
        ledger.viscous_J += half * self.arm.viscous_Nm_s_rad * (v1 * v1 + v2 * v2)
        if drives.holds:
            k, b = drives.stiffness, drives.damping
            ledger.hand_J += half * ((pull1 - k * x1 - b * v1) * v1 + (pull2 - k * x2 - b * v2) * v2)
        if self.side:
            k, b = self.stiffness, self.damping
            ledger.stop(half * ((k * x1 + b * v1) * v1 + (k * x2 + b * v2) * v2))
        if self.notch_k:
            ledger.detent_J += half * (self._notches(x1)[0] * v1 + self._notches(x2)[0] * v2)
        self.x, self.w = self.end[0], self.end[1]

    def _still(self, t: float) -> float:
        """Return the torque on the resting arm, without friction."""
        torque = self.drives.motor(t) + self.drives.hand(t, self.origin) - self._k * self.x
        return torque - self._notches(self.x)[0] if self.notch_k else torque

    def _breaks(self, t: float) -> int:
        """Return the direction in which the resting arm breaks away; 0 while friction can hold it."""
        self._mode()
        torque = self._still(t)
        if abs(torque) <= self.arm.stiction * self.drives.friction(t):
            return 0
        return 1 if torque > 0.0 else -1

    def _rest(self, t: float, until: float) -> float:
        """Rest until friction can no longer hold, and return the time reached."""
        self.slide = self._breaks(t)
        if self.slide:
            return t
        if not self._breaks(until):
            return until
        broken = first_zero(self._margin, t, until, self._margin(t), self._margin(until))
        self.slide = 1 if self._still(broken) > 0.0 else -1
        return broken

    def _margin(self, t: float) -> float:
        """Return how much more torque friction could hold."""
        return self.arm.stiction * self.drives.friction(t) - abs(self._still(t))

    def _last_resort(self, t: float, h: float) -> None:
        """Complete the period with one implicit Euler step."""
        drives, origin = self.drives, self.origin
        drives_k, b = drives.stiffness, drives.damping + self.arm.viscous_Nm_s_rad
        f = drives.motor(t + h) + drives.hand(t + h, origin)
        if self.notch_k:
            f -= self._notches(self.x)[0]
        low, high = self.arm.low_stop_rad - origin, self.arm.high_stop_rad - origin
        setting = Setting(self.inertia, f, drives_k, b, drives.friction(t + h), low, high, self.stiffness, self.damping)
        self.x, self.w, side = implicit_euler(setting, h, self.x, self.w)
        self.side = self.left = 0
        self.slide = (self.w > 0) - (self.w < 0)
        if side:
            self._touch(side, self.x - (high if side > 0 else low))


def gauss_step(h: float, x: float, w: float, inertia: float, b: float, k: float, f1: float, f2: float) -> Stages:
    """Return one step of size h from offset x and speed w, with the torques f1 and f2 at its two stages."""
    hh = h * h
    m11, m12 = inertia + 0.25 * b * h + D * k * hh, A12 * b * h + D12 * k * hh
    m21 = A21 * b * h + D21 * k * hh
    drift = h * w
    r1, r2 = f1 - b * w - k * (x + C1 * drift), f2 - b * w - k * (x + C2 * drift)
    det = m11 * m11 - m12 * m21
    a1, a2 = (m11 * r1 - m12 * r2) / det, (m11 * r2 - m21 * r1) / det
    return _ended(h, x, w, a1, a2)


def gauss_step_nonlinear(
    h: float, x: float, w: float, inertia: float, b: float, k: float, f1: float, f2: float, spring: Spring
) -> Stages:
    """Return such a step with a further spring n(x), by Newton's iteration from the linear result; it always ends."""
    end = gauss_step(h, x, w, inertia, b, k, f1, f2)
    hh, drift = h * h, h * w
    for _ in range(12):
        p1, p2 = end[2], end[3]
        n1, k1 = spring(p1)
        n2, k2 = spring(p2)
        k1, k2 = k1 + k, k2 + k
        g1, g2 = f1 - n1 + (k1 - k) * p1, f2 - n2 + (k2 - k) * p2
        m11, m12 = inertia + 0.25 * b * h + D * k1 * hh, A12 * b * h + D12 * k1 * hh
        m21, m22 = A21 * b * h + D21 * k2 * hh, inertia + 0.25 * b * h + D * k2 * hh
        r1, r2 = g1 - b * w - k1 * (x + C1 * drift), g2 - b * w - k2 * (x + C2 * drift)
        det = m11 * m22 - m12 * m21
        end = _ended(h, x, w, (m22 * r1 - m12 * r2) / det, (m11 * r2 - m21 * r1) / det)
        if abs(end[2] - p1) + abs(end[3] - p2) <= CLOSE_RAD:
            break
    return end


def _ended(h: float, x: float, w: float, a1: float, a2: float) -> Stages:
    hh, drift = h * h, h * w
    return (
        x + drift + hh * (E1 * a1 + E2 * a2),
        w + 0.5 * h * (a1 + a2),
        x + C1 * drift + hh * (D * a1 + D12 * a2),
        x + C2 * drift + hh * (D21 * a1 + D * a2),
        w + h * (0.25 * a1 + A12 * a2),
        w + h * (A21 * a1 + 0.25 * a2),
    )


def first_zero(value: Callable[[float], float], start: float, end: float, at_start: float, at_end: float) -> float:
    """Return where `value` passes from positive to negative between `start` and `end`, on the negative side."""
    low, high, above, below = start, end, at_start, at_end
    while above <= 0.0:
        middle = start + (high - start) / 8
        if middle - start <= CLOSE * (end - start):
            return start
        here = value(middle)
        if here > 0.0:
            low, above = middle, here
        else:
            high, below = middle, here
    kept = 0
    for _ in range(80):
        if high - low <= CLOSE * (end - start) or below == 0.0:
            break
        guess = high - below * (high - low) / (below - above)
        if not low < guess < high:
            guess = 0.5 * (low + high)
        here = value(guess)
        if here > 0.0:
            low, above, below, kept = guess, here, below * (0.5 if kept == 1 else 1.0), 1
        else:
            high, below, above, kept = guess, here, above * (0.5 if kept == -1 else 1.0), -1
    return high


@dataclass(slots=True)
class Ledger:
    """Work done on the arm by motor and hand, and the energy absorbed by friction, dampers, stops and detents.

    `stop_taken_J` grows while the arm pushes into a stop, `stop_returned_J` while the stop pushes it out.
    """

    motor_J: float = 0.0
    hand_J: float = 0.0
    friction_J: float = 0.0
    viscous_J: float = 0.0
    detent_J: float = 0.0
    stop_taken_J: float = 0.0
    stop_returned_J: float = 0.0

    def stop(self, taken_J: float) -> None:
        """Add the energy that a stop absorbed, in joules; negative if it released some."""
        if taken_J >= 0.0:
            self.stop_taken_J += taken_J
        else:
            self.stop_returned_J -= taken_J

    def kinetic_J(self) -> float:
        """Return the arm's kinetic energy by the balance, relative to the start, in joules."""
        took = self.friction_J + self.viscous_J + self.detent_J + self.stop_taken_J - self.stop_returned_J
        return self.motor_J + self.hand_J - took
