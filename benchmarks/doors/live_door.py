"""Figures of a door that follows the sliders: how late the new force is at the hand, and how wrong it is."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, partial
from operator import attrgetter

import numpy as np

from benchmarks.serial_lines import VirtualLine
from palpate.devices.door.designer import Designer, designer_for
from palpate.devices.door.firmware.controller import Firmware
from palpate.devices.door.firmware.twin_plant import TwinPlant
from palpate.devices.door.firmware.wire import Wire
from palpate.devices.door.link import dialogue
from palpate.devices.door.link.limits import Limits, change_for_door, profile_for_door
from palpate.devices.door.link.link import Link
from palpate.devices.door.live import LiveDoor
from palpate.devices.door.making import NEUTRAL
from palpate.devices.door.plant.rendering import FASTEST_NM_S, PASSAGE_TICKS
from palpate.protocols.bench import Case
from palpate.signals.arrays import Array
from palpate.signals.doors.limits import HANDLE_RADIUS_M, bounded

AREA, BAUD, END_DEG = "doors", 1_000_000, 62.0
MOVES, QUICK_MOVES = 200, 30
GAP_S = (0.06, 0.16)
"""Seconds between two moves of a slider: uniform, so that moves fall anywhere between two ticks of 50 ms."""
BEAT_MS = 10
STEP = 0.5
"""Half the step of the difference quotient in the middle, on the scale of 0 to 100."""

Setting = tuple[float, ...]
Force = Callable[[Setting], Array]


@dataclass(frozen=True)
class Followed:
    """One run: the latencies until the door took each change and until its whole force was there, and its error."""

    latency_s: Array
    complete_s: Array
    off_N: float
    missed: int


def methods(designer: Designer) -> Mapping[str, Force]:
    """Return the methods of making a profile that could be used live, by name; the first is the one in use."""
    middle = np.full(len(designer.attributes), NEUTRAL)
    force = designer.force

    @cache
    def slopes() -> tuple[Array, Array]:
        """Return the profile in the middle, and its change with each attribute there."""
        steps = STEP * np.eye(len(middle))
        slopes_N = [(force.run(middle + one) - force.run(middle - one)) / (2 * STEP) for one in steps]
        return np.asarray(force.run(middle)), np.stack(slopes_N)

    def tangent(setting: Setting) -> Array:
        middle_force, slopes_N = slopes()
        return bounded(middle_force + (np.array(setting) - middle) @ slopes_N)

    return {
        "force and perception model (used)": lambda setting: designer.design(np.array(setting)).force_N,
        "force model alone": lambda setting: bounded(np.asarray(force.run(np.array(setting)))),
        "straight line from the middle": tangent,
    }


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of each method at the twin: median and 95th percentile of the latency, beside its error."""
    designer, moves = designer_for(None), QUICK_MOVES if quick else MOVES
    whole = methods(designer)["force and perception model (used)"]
    input_name = f"twin, 1 Mbaud, 20 Hz, {moves} moves"
    runs = {
        name: cache(partial(followed, force, whole, len(designer.attributes), moves))
        for name, force in methods(designer).items()
    }
    looks: Mapping[str, Callable[[Followed], Array]] = {
        "door passes over": attrgetter("latency_s"), "all of it": attrgetter("complete_s")
    }  # fmt: skip
    for what, seconds in looks.items():
        for percentile, called in ((50, "median"), (95, "95 %")):
            case, late = f"slider to new force: {what}, {called}", partial(_late, seconds, percentile)
            for name, run in runs.items():
                yield Case(AREA, case, name, input_name, moves, "N rms", run, attrgetter("off_N"), 1, late)


def _late(seconds: Callable[[Followed], Array], percentile: float, latencies: Followed) -> float:
    return float(np.percentile(seconds(latencies), percentile))


def followed(force: Force, whole: Force, attributes: int, moves: int, seed: int = 1) -> Followed:
    """Move sliders while the twin's door plays, and compare the door with the final profile of each setting.

    Line and door live in virtual time, so that other programs' work is not measured; the model's time is measured on
    this machine's clock, and passes in virtual time as well.
    """
    line = VirtualLine(Wire(Firmware(TwinPlant(seed)), BAUD))
    link = Link("door", line, line.clock_s)
    line.every_ms = lambda t_ms: link.beat() if t_ms % BEAT_MS == 0 else None
    return _followed(link, line, force, whole, attributes, moves, np.random.Generator(np.random.PCG64(seed)))


def _followed(
    link: Link, line: VirtualLine, force: Force, whole: Force, attributes: int, moves: int, chance: np.random.Generator
) -> Followed:
    setting: Setting = (NEUTRAL,) * attributes

    def design(now: Setting) -> tuple[float, ...]:
        start_s = time.perf_counter()
        forces = tuple(force(now).tolist())
        line.run(max(1, round(1000 * (time.perf_counter() - start_s))))
        return forces

    first_force = np.array(design(setting))
    live: LiveDoor[Setting] = LiveDoor(lambda: setting, design, setting)
    moved_ns, due_ns = {setting: line.now_ns()}, 0
    profile = profile_for_door(first_force.tolist(), HANDLE_RADIUS_M, Limits())
    dialogue.greet(link)
    dialogue.upload(link, profile)
    dialogue.play(link, profile)
    while len(moved_ns) <= moves or setting != live.changes[-1].wish:
        link.keep_alive()
        if len(moved_ns) <= moves and line.now_ns() >= due_ns:
            place = int(chance.integers(attributes))
            setting = (*setting[:place], float(chance.uniform(0, 100)), *setting[place + 1 :])
            moved_ns[setting] = line.now_ns()
            due_ns = moved_ns[setting] + round(1e9 * chance.uniform(*GAP_S))
        if (new := live.newer(line.now_ns())) is not None:
            why = dialogue.change(link, change_for_door(new, HANDLE_RADIUS_M, Limits(), END_DEG))
            live.took(line.now_ns(), why)
        link.wait(lambda: False, 0.001)
    return _latencies(live, moved_ns, first_force, whole)


def _latencies(live: LiveDoor[Setting], moved_ns: Mapping[Setting, int], first_force: Array, whole: Force) -> Followed:
    """Return the latencies of all changes that the door has taken. Raise ValueError where it refused one."""
    latency_s, complete_s, squared_error, before = [], [], [], first_force
    for change in live.changes:
        if change.taken_ns is None:
            raise ValueError(f"the twin stayed as it was: {change.why}")
        force = np.array(change.force_N)
        passage_s = max(PASSAGE_TICKS / 1000, float(np.abs(force - before).max()) * HANDLE_RADIUS_M / FASTEST_NM_S)
        latency_s.append((change.taken_ns - moved_ns[change.wish]) / 1e9)
        complete_s.append(latency_s[-1] + passage_s)
        squared_error.append(np.mean((force - whole(change.wish)) ** 2))
        before = force
    return Followed(np.array(latency_s), np.array(complete_s), float(np.sqrt(np.mean(squared_error))), live.missed)
