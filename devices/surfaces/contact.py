"""The tip on the surface: stiff contact with lift-off and friction with stick-slip, step by step.

Normal to the surface (mass m, hand's damping c_h and force F0, contact k and c, lowest point z, ground s):

    m z'' = -F0 - c_h z' + N,    N = max(0, k (s - z) + c (s' - z'))

Along it (deflection u of the tip in the hand's grip, whose velocity is V and acceleration A):

    m_t u'' + c_t u' + k_t u = F - N grad s - m_t A,    F against V + u', |F| <= mu N, equal while the tip slides

Both are set-valued and stiff, and solved implicitly (theta method): N and F follow in closed form from the velocities
that there would be without them, so every step ends with the exact law and takes energy at any stiffness.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.devices.surfaces.table import Surface
from palpate.signals.arrays import Array

INTERNAL_HZ = 10_000.0
THETA = 0.55
"""0.5 conserves energy, 1 damps most; slightly above 0.5, motions that the step cannot resolve die away."""
AGREE = np.array([1e-11, 1e-8, 1e-10, 1e-10, 1e-8, 1e-8, 1e-8])[:, np.newaxis]
"""Differences below which two states count as equal: z, z', u, u', sliding speed (m and m/s)."""
STATES = 7


@dataclass(frozen=True)
class Tool:
    """A stylus as it is held. An engineering judgement, similar to pen-hold measurements; not measured."""

    mass_kg: float = 0.080
    body_N_mm: float = 100.0
    """Stiffness of body and plate in series with the surface."""
    body_damping: float = 0.06
    grip_N_s_m: float = 10.0
    side_mass_kg: float = 0.080
    side_N_mm: float = 3.0
    side_damping: float = 0.35


HELD = Tool()


@dataclass(frozen=True)
class Law:
    """The contact law of a surface under a tool, in SI units, with the constants of a step."""

    stiffness: float
    damping: float
    grip: float
    mass: float
    side_mass: float
    side_stiffness: float
    side_damping: float
    static: float
    kinetic: float
    stribeck: float
    step_s: float = 1 / INTERNAL_HZ


def law(surface: Surface, tool: Tool = HELD) -> Law:
    """Return the contact law of surface and tool in series; damping is a share of the mass's critical damping."""
    stiffness = 1000 / (1 / surface.stiffness_N_mm + 1 / tool.body_N_mm)
    ratio = surface.damping_ratio + tool.body_damping
    side = 1000 * tool.side_N_mm
    return Law(
        stiffness, 2 * ratio * math.sqrt(stiffness * tool.mass_kg), tool.grip_N_s_m, tool.mass_kg, tool.side_mass_kg,
        side, 2 * tool.side_damping * math.sqrt(side * tool.side_mass_kg), surface.static_friction,
        surface.kinetic_friction, surface.stribeck_mm_s / 1000,
    )  # fmt: skip


@dataclass(frozen=True)
class Drive:
    """The inputs of the steps, in SI units, all of length n: ground and its rate, force, slopes, hand (2, n)."""

    ground: Array
    rate: Array
    force: Array
    slope: Array
    velocity: Array
    turn: Array

    def blocks(self, count: int) -> Drive:
        """Return the drive cut into blocks of equal length that lie side by side: (..., steps, count)."""
        return Drive(
            *(
                np.ascontiguousarray(np.swapaxes(column.reshape(*column.shape[:-1], count, -1), -1, -2))
                for column in vars(self).values()
            )
        )

    def of(self, chosen: NDArray[np.intp]) -> Drive:
        """Return the drive of the chosen blocks."""
        return Drive(*(np.ascontiguousarray(column[..., chosen]) for column in vars(self).values()))


@dataclass(frozen=True)
class Ride:
    """The results of the steps: per step the state after it (7, n), normal force (n,) and friction (2, n)."""

    states: Array
    normal: Array
    friction: Array


def at_rest(drive: Drive, law: Law) -> Array:
    """Return the state in which the tip rests on the ground under the force, of shape (7,) or (7, blocks)."""
    state = np.zeros((STATES, *drive.ground.shape[1:]))
    state[0] = drive.ground[0] - drive.force[0] / law.stiffness
    return state


def ride(drive: Drive, start: Array, law: Law, blocks: int) -> Ride:
    """Compute every step in order from a start state; n must be a multiple of `blocks`.

    The blocks are computed side by side from guessed states, and again from the final states of their predecessors,
    until all agree: the first k are exact after k rounds, and all are soon, because the contact forgets (see AGREE).
    """
    cut = drive.blocks(blocks)
    # The state of a tip that slides along steadily with the hand: a guess, of shape (7, blocks).
    starts, velocity = at_rest(cut, law), cut.velocity[:, 0]
    starts[1], starts[6] = cut.rate[0], np.sqrt((velocity**2).sum(axis=0))
    starts[2:4] = -law.kinetic * cut.force[0] / law.side_stiffness * velocity / (starts[6] + 1e-9)
    starts[:, 0] = start
    todo = np.arange(blocks)
    steps, count = cut.ground.shape
    out = Ride(np.empty((STATES, steps, count)), np.empty((steps, count)), np.empty((2, steps, count)))
    while todo.size:
        _steps(cut.of(todo), starts[:, todo], law, out, todo)
        ended = out.states[:, -1, :-1]
        wrong = np.any(np.abs(ended - starts[:, 1:]) > AGREE, axis=0)
        starts[:, 1:][:, wrong] = ended[:, wrong]
        todo = np.flatnonzero(wrong) + 1
    whole = (out.states, out.normal, out.friction)
    return Ride(*(np.swapaxes(values, -1, -2).reshape(*values.shape[:-2], -1) for values in whole))


def _steps(drive: Drive, start: Array, law: Law, out: Ride, todo: NDArray[np.intp]) -> None:
    """Compute all steps of the blocks `todo` and write them into their columns of `out`."""
    steps = drive.ground.shape[0]
    states = np.empty((steps, STATES, todo.size))
    normal, friction = np.empty((steps, todo.size)), np.empty((steps, 2, todo.size))
    normally, sideways = _Normal.of(drive, law), _Sideways.of(drive, law)
    state = start.copy()
    for n in range(steps):
        normal[n] = normally.step(n, state)
        friction[n] = sideways.step(n, state, normal[n])
        states[n] = state
    out.states[..., todo] = states.transpose(1, 0, 2)
    out.normal[..., todo] = normal
    out.friction[..., todo] = _whole(law) * friction.transpose(1, 0, 2)


@dataclass(frozen=True)
class _Normal:
    """Constants of the step normal to the surface; rows 0 and 1 of the state."""

    pushed: Array
    pressed: Array
    keeps: float
    stiffness: float
    resists: float
    moves: float
    step_s: float

    @classmethod
    def of(cls, drive: Drive, law: Law) -> _Normal:
        """Return the constants, and the inputs of every step."""
        inertia = law.mass / (THETA * law.step_s)
        free, resists = inertia + law.grip, law.stiffness * THETA * law.step_s + law.damping
        gives = 1 / (1 + resists / free)
        return cls(
            gives * (law.stiffness * drive.ground + law.damping * drive.rate), drive.force / free, inertia / free,
            gives * law.stiffness, gives * resists, 1 / free, law.step_s,
        )  # fmt: skip

    def step(self, n: int, state: Array) -> Array:
        """Advance the state by step `n`, and return the normal force in newtons."""
        z, v = state[0], state[1]
        free = self.keeps * v
        free -= self.pressed[n]
        force: Array = self.pushed[n] - self.stiffness * z
        force -= self.resists * free
        np.maximum(force, 0, out=force)
        free += self.moves * force
        z += self.step_s * free
        v *= (THETA - 1) / THETA
        free *= 1 / THETA
        v += free
        return force


@dataclass(frozen=True)
class _Sideways:
    """Constants of the step along the surface; rows 2 to 6 of the state. Friction is counted as a change of speed."""

    base: Array
    slope: Array
    velocity: Array
    keeps: float
    pulls: float
    kinetic: float
    more: float
    law: Law

    @classmethod
    def of(cls, drive: Drive, law: Law) -> _Sideways:
        """Return the constants, and the inputs of every step, as (steps, 2, blocks)."""
        inertia, whole = law.side_mass / (THETA * law.step_s), _whole(law)
        base = drive.velocity - (law.side_mass / whole) * drive.turn
        base, slope, velocity = (
            np.ascontiguousarray(values.transpose(1, 0, 2)) for values in (base, drive.slope / whole, drive.velocity)
        )
        more = (law.static - law.kinetic) / whole
        return cls(base, slope, velocity, inertia / whole, law.side_stiffness / whole, law.kinetic / whole, more, law)

    def step(self, n: int, state: Array, normal: Array) -> Array:
        """Advance the state by step `n`, and return how much friction slows the tip (m/s)."""
        u, rate, velocity = state[2:4], state[4:6], self.velocity[n]
        free = self.keeps * rate
        free -= self.pulls * u
        free += self.base[n]
        free -= normal * self.slope[n]
        grip = np.exp(state[6] * (-1 / self.law.stribeck))
        grip *= self.more
        grip += self.kinetic
        grip *= normal
        square = free * free
        fast = np.sqrt(square[0] + square[1])
        slides = np.maximum(1 - grip / (fast + 1e-300), 0)
        tip: Array = free * slides
        np.multiply(fast, slides, out=state[6])
        between = tip - velocity
        u += self.law.step_s * between
        rate *= (THETA - 1) / THETA
        between *= 1 / THETA
        rate += between
        tip -= free
        return tip


def _whole(law: Law) -> float:
    """Return the force along the surface per change of the tip's speed within a step."""
    return law.side_mass / (THETA * law.step_s) + law.side_damping + law.side_stiffness * THETA * law.step_s
