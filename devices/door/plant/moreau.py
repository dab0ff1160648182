"""One implicit Euler step in which friction and stop are set-valued: the last resort, which always ends.

Moreau's time stepping (Moreau 1988; Acary and Brogliato 2008, ch. 10) for one degree of freedom: the velocity at the
end of the step balances all torques, with friction anywhere within its band and a stop that only pushes. Every torque
falls as that velocity rises, so there is exactly one solution, found by trying the cases; it never adds energy.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Setting:
    """The inputs of a step: inertia, the linear torque f - k (x) - b w, friction, and the positions of the stops."""

    inertia: float
    f: float
    k: float
    b: float
    friction: float
    low: float
    high: float
    stop_k: float
    stop_b: float


def implicit_euler(s: Setting, h: float, x: float, w: float) -> tuple[float, float, int]:
    """Return offset, speed and the pressed stop (-1 low, 0 none, 1 high) after a step of size h."""
    forward = _against(s, h, x, w, s.friction)
    if forward[0] > 0.0:
        return x + h * forward[0], *forward
    backward = _against(s, h, x, w, -s.friction)
    if backward[0] < 0.0:
        return x + h * backward[0], *backward
    side = 1 if x > s.high else -1 if x < s.low else 0
    return x, 0.0, side


def _against(s: Setting, h: float, x: float, w: float, friction: float) -> tuple[float, int]:
    """Return the speed for the given friction, without a stop or with the one that the arm would reach, and the
    stop.
    """
    push = s.inertia * w / h + s.f - s.k * x - friction
    mass = s.inertia / h + s.b + s.k * h
    speed = push / mass
    for side, place in ((1, s.high), (-1, s.low)):
        if (x + h * speed - place) * side > 0.0:
            held = (push - s.stop_k * (x - place)) / (mass + s.stop_b + s.stop_k * h)
            if (s.stop_k * (x + h * held - place) + s.stop_b * held) * side > 0.0:
                return held, side
    return speed, 0
