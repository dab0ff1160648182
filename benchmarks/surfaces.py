"""Figures of the simulated surfaces: the error and the saved time of each approximation."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.devices.surfaces.act import BATCH, BLOCKS
from palpate.devices.surfaces.contact import INTERNAL_HZ, THETA, Drive, at_rest, law, ride
from palpate.devices.surfaces.hand import free_hand
from palpate.devices.surfaces.rates import at_rate
from palpate.devices.surfaces.relief import relief
from palpate.devices.surfaces.scene import SurfaceScene, first_rows, ground_of
from palpate.devices.surfaces.table import Surface, read_surfaces
from palpate.devices.surfaces.tool import RADIUS_MM, traced
from palpate.protocols.bench import Case
from palpate.signals.arrays import Array

AREA = "surfaces"
SENSORS = (("acceleration_m_s2", 3000.0), ("wrench", 8000.0), ("position_mm", 120.0))
SURFACES = ("T01", "T19", "T38", "T48")
TONE_HZ = 400.0


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of all sensors of a texture, the contact's blocks, the tip's tracing, and the change of rate."""
    table = read_surfaces()
    seconds, repeats = (10.0, 1) if quick else (60.0, 3)
    for name in SURFACES[:2] if quick else SURFACES:
        yield _whole(table[name], seconds, repeats)
    for name in ("T19",) if quick else ("T01", "T19", "T38"):
        yield from _contact(table[name], BATCH // (8 if quick else 1))
    yield from _tip(table["T48"])
    for rate_hz in (3000.0, 8000.0, 1000.0):
        yield _rate(rate_hz)


def _whole(surface: Surface, seconds: float, repeats: int) -> Case:
    input_name = f"{surface.label}, {seconds:g} s: relief, contact, 3 x 3 kHz, 6 x 8 kHz, 3 x 120 Hz"
    return Case(
        AREA, "all sensors", "as shipped", input_name, round(seconds * INTERNAL_HZ), "samples that are no number",
        lambda: sense_surface(surface, seconds),
        lambda signals: float(sum((~np.isfinite(signal)).sum() for signal in signals)), repeats,
    )  # fmt: skip


def sense_surface(surface: Surface, seconds: float) -> list[Array]:
    """Return every sensor's samples of one act, read alternately as in a session."""
    scene = SurfaceScene(surface, seconds, "bench", under=ground_of(surface))
    pieces = [getattr(scene, name)(rate_hz) for name, rate_hz in SENSORS]
    blocks: list[list[Array]] = [[] for _ in SENSORS]
    for second in range(1, math.ceil(seconds) + 1):
        for place, (_, rate_hz) in enumerate(SENSORS):
            while sum(map(len, blocks[place])) < second * rate_hz:
                blocks[place].append(next(pieces[place]))
    return [np.concatenate(sensor_blocks) for sensor_blocks in blocks]


def _contact(surface: Surface, steps: int) -> Iterator[Case]:
    drive, rule = free_drive(surface, steps), law(surface)
    exact = ride(drive, at_rest(drive, rule), rule, 1).states[0]

    def case(method: str, blocks: int) -> Case:
        return Case(
            AREA, f"contact, {surface.label}", method, f"{steps} steps of 0.1 ms", steps,
            "m, largest of the tip's height",
            lambda: ride(drive, at_rest(drive, rule), rule, blocks).states[0],
            lambda heights: float(np.abs(heights - exact).max()), 1,
        )  # fmt: skip

    yield case("one step after another", 1)
    for blocks in (16, BLOCKS):
        yield case(f"{blocks} blocks side by side", blocks)


def free_drive(surface: Surface, steps: int, *key: str) -> Drive:
    """Return the contact's inputs under a free hand."""
    motion = free_hand(steps / INTERNAL_HZ, "bench", *key).at(
        (np.arange(steps, dtype=np.float64) + THETA) / INTERNAL_HZ
    )
    height, right, up = ground_of(surface).at(*motion.place)
    slope, velocity = np.stack([right, up]), motion.velocity / 1000
    return Drive(height, (slope * velocity).sum(axis=0), motion.force, slope, velocity, motion.turn / 1000)


def _tip(surface: Surface) -> Iterator[Case]:
    height = relief(surface, pixels=392).height_um
    exact = dilate(height)
    methods: dict[str, Callable[[], Any]] = {
        "rows, then columns": lambda: traced(height),
        "every point": lambda: dilate(height),
    }
    for name, run in methods.items():
        yield Case(
            AREA, "tracing by a sphere", name, f"{surface.label}, 392 x 392", height.size,
            "um, RMS over the field", run, lambda result: float(np.sqrt(np.mean((result - exact) ** 2))), 3,
        )  # fmt: skip


def dilate(height_um: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the dilation by a sphere, computed from every offset under it."""
    count = height_um.shape[0]
    reach = int(RADIUS_MM * count / 100)
    top = np.full_like(height_um, -np.inf)
    for up in range(-reach, reach + 1):
        for right in range(-reach, reach + 1):
            square = (up * up + right * right) * (100 / count) ** 2
            if square <= RADIUS_MM**2:
                drop = np.float32(1000 * (RADIUS_MM - math.sqrt(RADIUS_MM**2 - square)))
                np.maximum(top, np.roll(height_um, (up, right), (0, 1)) - drop, out=top)
    return top


def _rate(rate_hz: float) -> Case:
    hertz, rows = min(TONE_HZ, rate_hz / 4), int(15 * rate_hz)
    tone = np.sin(2 * np.pi * hertz * np.arange(200_000) / INTERNAL_HZ)[:, np.newaxis]
    truth = np.sin(2 * np.pi * hertz * np.arange(rows) / rate_hz)
    inside = slice(int(rate_hz), None)
    return Case(
        AREA, f"a tone from 10 kHz to {rate_hz:g} Hz", "band-limited, 10 points", f"{hertz:g} Hz, 15 s", rows,
        "share of the tone, RMS", lambda: first_rows(at_rate(repeat(tone, 2), INTERNAL_HZ, rate_hz), rows)[:, 0],
        lambda result: float(np.sqrt(2 * np.mean((result - truth)[inside] ** 2))), 3,
    )  # fmt: skip
