"""Free explorations of simulated surfaces: what a rig's sensors record, and the exact signals without sensors.

A result made from them depends on this module alone, not on the sets of sessions that `texture_simulator` makes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.protocols.keyed import Key, keyed_bits, uniform
from palpate.protocols.wording import some
from palpate.signals.arrays import Array
from palpate.studies.catalogue import stimulus_rows
from palpate.studies.sessions.rig import RigError

if TYPE_CHECKING:
    from palpate.devices.surfaces.hand import Hand, Motion
    from palpate.devices.surfaces.scene import SurfaceScene


RATE_HZ = 1000.0
STIMULI = Path(__file__).resolve().parents[1] / "texture_capture" / "stimuli.csv"
FINER = 3
"""Acceleration is simulated at this multiple of the rate, as for the sensors, and then low-passed."""
PASSES_HZ, STOPS_HZ, STOP_DB = 450.0, 500.0, 80.0
PLATE_MM = 100.0
LINE_DEG, LONGER = 31.0, 1.15
"""The direction of the strokes, oblique to every lattice, and the factor by which they are stretched."""
NORMAL = 2
"""The axis of the sample's normal."""


def captured(texture: str, seconds: float, seed: int) -> Mapping[str, tuple[float, Array]]:
    """Return what the twins of the tool's sensors record along one line: {stream: (rate in Hz, (n, channels))}.

    Streams, as in a ledger of texture_capture (thesis 4.3): tool_acceleration (m/s^2, gravity included), tool_force (N,
    N m), tool_position (x, y, z in mm and `seen`, 0 where the marker was hidden). The texture is a stimulus of
    texture_capture. Raises RigError on another texture, and on an impossible number of seconds.
    """
    from palpate.studies.simulation.virtual_recording import recorded_at_once

    scene = _scene(texture, seconds, "captured", seed)
    blocks = recorded_at_once("tool", scene, seconds, 0, keyed_bits("texture sensors", texture, seed) % 2**31)
    return {
        block.stream: (
            block.rate_hz, np.frombuffer(block.data, "<f4").reshape(-1, len(block.channels)).astype(np.float64)
        )
        for block in blocks
    }  # fmt: skip


def scene(texture: str, seconds: float, seed: int, realisation: int = 0) -> Array:
    """Return (3, n) at 1 kHz of a free exploration without sensors: acceleration (m/s^2), speed (mm/s), force (N).

    Filtered and put on one axis as recordings are (palpate.signals.filters). No seed shares its hand with `captured`.
    Another `realisation` is the same hand, speed and force on another place of the surface: what a perfect model might
    play, and so the ceiling for any model. Raises RigError as `captured` does.
    """
    from palpate.devices.surfaces.scene import first_rows
    from palpate.signals.filters import band_pass, low_pass
    from palpate.signals.one_axis import one_axis

    exploration = _scene(texture, seconds, "scene", seed, realisation=realisation)
    count = round(seconds * RATE_HZ)
    felt = first_rows(exploration.acceleration_m_s2(FINER * RATE_HZ), FINER * count)
    vibration = band_pass(_thinned(felt), RATE_HZ)
    place = first_rows(exploration.position_mm(RATE_HZ), count)[:, :NORMAL]
    speed = np.linalg.norm(np.gradient(place, 1 / RATE_HZ, axis=0), axis=1)
    force = first_rows(exploration.wrench(RATE_HZ), count)[:, NORMAL]
    hand = low_pass(np.stack([speed, force], axis=1), RATE_HZ)
    return np.stack([one_axis(vibration, RATE_HZ), np.maximum(hand[:, 0], 0.0), hand[:, 1]])


def scene_again(texture: str, seconds: float, seed: int) -> Array:
    """Return the exploration that `scene` gives for this seed, on another place of the surface. Raises RigError."""
    return scene(texture, seconds, seed, realisation=1)


def _thinned(felt: Array) -> Array:
    """Return the acceleration decimated to 1 kHz, in the band of recordings (palpate.signals.aligning.methods)."""
    from scipy.signal import firwin, kaiserord, oaconvolve

    taps, beta = kaiserord(STOP_DB, 2 * (STOPS_HZ - PASSES_HZ) / (FINER * RATE_HZ))
    weights = firwin(taps | 1, (PASSES_HZ + STOPS_HZ) / 2, window=("kaiser", beta), fs=FINER * RATE_HZ)
    padded = np.pad(felt, ((len(weights) // 2,) * 2, (0, 0)), mode="edge")
    return np.asarray(oaconvolve(padded, weights[:, None], mode="valid", axes=0)[::FINER])


@dataclass(frozen=True)
class Straight:
    """A hand's strokes along the sample's x, turned onto one line and stretched to nearly the whole sample.

    Simulated lattices feel different in another direction, which neither speed nor force reveals; the thesis' samples
    were isotropic (4.3.2). Along one line the direction does not matter.
    """

    hand: Hand

    def at(self, t_s: Array) -> Motion:
        """Return the motion at the given times, in seconds."""
        motion = self.hand.at(t_s)
        way = LONGER * np.array([math.cos(math.radians(LINE_DEG)), math.sin(math.radians(LINE_DEG))])[:, None]
        laid = {name: way * getattr(motion, name)[:1] for name in ("place", "velocity", "turn")}
        return replace(motion, **laid)


@dataclass(frozen=True)
class Elsewhere:
    """A hand that does the same motion `by_mm` further on; the samples repeat at their borders."""

    hand: Hand
    by_mm: tuple[float, float]

    def at(self, t_s: Array) -> Motion:
        """Return the motion at the given times, in seconds."""
        motion = self.hand.at(t_s)
        return replace(motion, place=motion.place + np.array(self.by_mm)[:, None])


def _scene(texture: str, seconds: float, *key: Key, realisation: int = 0) -> SurfaceScene:
    from palpate.devices.surfaces.choice import surface_for
    from palpate.devices.surfaces.hand import free_hand
    from palpate.devices.surfaces.scene import SurfaceScene
    from palpate.devices.surfaces.table import SurfaceDataError

    known = stimuli()
    if texture not in known:
        raise RigError(f"there is no texture {texture!r} in {STIMULI}; there are {some(known)}")
    keys = ("texture exploration", texture, *key)
    where = (PLATE_MM * uniform(*keys, "x", realisation), PLATE_MM * uniform(*keys, "y", realisation))
    hand = Elsewhere(Straight(free_hand(seconds, "hand", *keys)), where if realisation else (0.0, 0.0))
    try:
        return SurfaceScene(surface_for(texture, known[texture]), seconds, *keys, hand=hand)
    except SurfaceDataError as error:
        raise RigError(f"{texture}: {error}") from None


def stimuli() -> dict[str, dict[str, Any]]:
    """Return the rows of the stimulus table of texture_capture, by id."""
    return {row["id"]: dict(row.cells) for row in stimulus_rows(STIMULI)}
