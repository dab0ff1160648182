"""The sensorised tool's simulated twin: what its sensors give while a hand strokes over a texture.

Acceleration at 1 kHz and position at 120 Hz as in thesis 4.3.3; force at 1 kHz, which its 10 kHz are reduced to there.
Pure Python on purpose: a capture session with a simulated tool needs no numpy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from devices.noise import gaussians
from devices.tool.hand import Hand, free_hand
from devices.tool.texture import Texture, ToolDataError
from devices.tool.vibration import Resonator, level_m_s2, pitch_hz
from protocols.keyed import Key

SENSOR_HZ, TRACKER_HZ = 1000.0, 120.0
STEP = 10
"""Samples over which speed and force count as constant: 10 ms, far below a stroke."""
GRAVITY_M_S2 = 9.80665
TILT = (0.26, -0.17, math.sqrt(1 - 0.26**2 - 0.17**2))
"""How the held tool leans: the direction of gravity in its axes."""
VIBRATES = (0.45, 0.35, math.sqrt(1 - 0.45**2 - 0.35**2))
"""The direction in which the tool vibrates; of unit length, so that DFT321 keeps the level."""
ACCELERATION_NOISE_M_S2, FORCE_NOISE_N, POSITION_NOISE_MM = 0.05, 0.01, 0.05
SLIDING_MM_S = 5.0
"""Speed at which half of the friction is there: it does not jump where the hand turns."""
DEEPEST_MM = 1.5
LONGEST_S = 3600.0

Axes = tuple[list[float], list[float], list[float]]


@dataclass(frozen=True)
class Exploration:
    """Three axes of each sensor, x and y along the surface and z out of it."""

    acceleration_m_s2: Axes
    force_N: Axes
    position_mm: Axes


def explore(texture: Texture, seconds: float, *key: Key) -> Exploration:
    """What the sensors give in `seconds` of free-hand exploration; the key decides hand and noise.

    Raises ToolDataError on a duration that is not from 0.1 s to an hour.
    """
    if not 0.1 <= seconds <= LONGEST_S:
        raise ToolDataError(f"{seconds} s of exploration: from 0.1 to {LONGEST_S:g} s are expected")
    hand = free_hand("hand", *key)
    count = round(seconds * SENSOR_HZ)
    acceleration, force = _sensed(texture, hand, count, key)
    return Exploration(acceleration, force, _tracked(texture, hand, round(seconds * TRACKER_HZ), key))


def _sensed(texture: Texture, hand: Hand, count: int, key: tuple[Key, ...]) -> tuple[Axes, Axes]:
    white, resonator = gaussians(count, "vibration", *key), Resonator(SENSOR_HZ)
    acceleration, force = (
        _noise(ACCELERATION_NOISE_M_S2, count, key, "acceleration"),
        _noise(FORCE_NOISE_N, count, key, "force"),
    )
    for first in range(0, count, STEP):
        t_s = (first + STEP / 2) / SENSOR_HZ
        (_, right, turn_x), (_, up, turn_y) = hand.x_mm.at(t_s), hand.y_mm.at(t_s)
        speed, pressed = math.hypot(right, up), hand.force_N(t_s)
        shaken = resonator.run(white[first : first + STEP], pitch_hz(texture, speed), texture.bandwidth_hz)
        level = level_m_s2(texture, speed, pressed)
        carried = (turn_x / 1000, turn_y / 1000, 0.0)
        rubbed = texture.friction * pressed / (speed + SLIDING_MM_S)
        pushed = (-rubbed * right, -rubbed * up, pressed)
        for axis in range(3):
            steady, share = GRAVITY_M_S2 * TILT[axis] + carried[axis], level * VIBRATES[axis]
            for place, each in enumerate(shaken, first):
                acceleration[axis][place] += steady + share * each
                force[axis][place] += pushed[axis]
    return acceleration, force


def _tracked(texture: Texture, hand: Hand, count: int, key: tuple[Key, ...]) -> Axes:
    """Where the tip is; a soft surface gives way under the force."""
    axes = _noise(POSITION_NOISE_MM, count, key, "position")
    for place in range(count):
        t_s = place / TRACKER_HZ
        pressed = hand.force_N(t_s)
        depth = 0.01 * texture.softness * DEEPEST_MM * pressed / (1 + pressed)
        for axis, value in zip(axes, (hand.x_mm.at(t_s)[0], hand.y_mm.at(t_s)[0], -depth), strict=True):
            axis[place] += value
    return axes


def _noise(size: float, count: int, key: tuple[Key, ...], what: str) -> Axes:
    x, y, z = ([size * each for each in gaussians(count, what, axis, *key)] for axis in "xyz")
    return x, y, z
