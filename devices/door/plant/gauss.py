"""One implicit step of an oscillator: the two-stage Gauss method, of order 4 (Hairer, Lubich and Wanner 2006, II.1).

For J x'' + b x' + k x + n(x) = f(t). Stable for every step size (A-stable); and because the method keeps quadratic
invariants, the balance of kinetic energy, spring energy and work holds exactly at its stages, at any stiffness.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

R = sqrt(3) / 6
C1, C2 = 0.5 - R, 0.5 + R
A12, A21 = 0.25 - R, 0.25 + R
D12, D21, D = 0.125 - R / 2, 0.125 + R / 2, 1 / 24
E1, E2 = 0.25 + R / 2, 0.25 - R / 2
CLOSE_RAD = 1e-14
"""Newton's iteration on a nonlinear spring ends at a change below this."""

Stages = tuple[float, float, float, float, float, float]
"""Offset and speed at the end, offsets at the two stages, speeds at the two stages."""
Spring = Callable[[float], tuple[float, float]]
"""Offset -> torque and its slope."""


def step(h: float, x: float, w: float, inertia: float, b: float, k: float, f1: float, f2: float) -> Stages:
    """One step of size h from offset x and speed w, with the torques f1 and f2 at its two stages."""
    hh = h * h
    m11, m12 = inertia + 0.25 * b * h + D * k * hh, A12 * b * h + D12 * k * hh
    m21 = A21 * b * h + D21 * k * hh
    drift = h * w
    r1, r2 = f1 - b * w - k * (x + C1 * drift), f2 - b * w - k * (x + C2 * drift)
    det = m11 * m11 - m12 * m21
    a1, a2 = (m11 * r1 - m12 * r2) / det, (m11 * r2 - m21 * r1) / det
    return _ended(h, x, w, a1, a2)


def step_nonlinear(
    h: float, x: float, w: float, inertia: float, b: float, k: float, f1: float, f2: float, spring: Spring
) -> Stages:
    """The same with a further spring n(x), by Newton's iteration from the linear answer; it always ends."""
    end = step(h, x, w, inertia, b, k, f1, f2)
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
