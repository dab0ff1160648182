"""A simulated participant who moves the sliders while the simulated door is felt, by the same loop as at a rig."""

from __future__ import annotations

import array
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from palpate.devices.device import interleaved
from palpate.devices.door.live import PERIOD_NS, LiveDoor
from palpate.devices.door.making import Doors
from palpate.devices.door.plant.parameters import DEFAULT
from palpate.devices.door.plant.rendering import STEP_RAD, Passage, Rendered
from palpate.protocols.events import NS, Present, Samples
from palpate.protocols.forms import Sliders
from palpate.protocols.plan import Plan
from palpate.protocols.simulated_participants import simulated_participant
from palpate.protocols.simulated_world import Done
from palpate.signals.doors.grid import POINTS_PER_DEG
from palpate.signals.doors.limits import HANDLE_RADIUS_M
from palpate.studies.stimuli.made_doors import LiveRecord, Setting

BEGINS_S, MOVES_S = 0.3, 1.5
"""How many seconds the hand rests at the sliders before it moves them, and how many the movement takes."""
TICKS_A_S = 1000


def followed(plan: Plan, request: Present, doors: Doors, done: Done, t_ns: int) -> Done:
    """Return the presentation `done` with sliders moved meanwhile, and the forces on the hand.

    Models and transmission take no virtual time: `made` and `taken` equal the moment at which a setting was seen.
    """
    form, start = request.live_form, dict(request.wish or {})
    if form is None:
        return done
    setting = dict(start)
    live: LiveDoor[Setting] = LiveDoor(lambda: dict(setting), doors.force_N, start, count_ns=lambda: 0)
    force_N = doors.force_N(start)
    record = LiveRecord(form.items(), start, force_N, live, t_ns)
    to = _moves(form, start, simulated_participant(plan).leave_sliders(request))
    for tick_ns in range(t_ns, t_ns + round(done.seconds * NS), PERIOD_NS):
        setting.update(to((tick_ns - t_ns) / NS))
        if live.newer(tick_ns) is not None:
            live.took(tick_ns, "")
    (door,) = done.reply.samples
    angles = [float(angle) for angle in array.array("f", door.data)[0::2]]
    opening = replace(door, data=interleaved(angles, list(_forces(angles, door, record))))
    reply = replace(done.reply, value={**done.reply.value, **record.summary()}, samples=(opening,))
    return replace(done, reply=replace(reply, samples=(*reply.samples, *record.take())))


def _moves(form: Sliders, start: Setting, end: Mapping[str, float]) -> Callable[[float], Setting]:
    """Return a function from seconds to the setting: every slider that is moved goes there at constant speed."""

    def at(t_s: float) -> Setting:
        share = min(max((t_s - BEGINS_S) / MOVES_S, 0.0), 1.0)
        return {
            name: end[name] if share == 1 else form.scale.nearest(value + share * (end[name] - value))
            for name, value in start.items()
        }

    return at


def _forces(angles: list[float], door: Samples, record: LiveRecord) -> Iterator[float]:
    """Yield the force at each sample, in N, by the device's rule for passing from one profile to another."""
    stiffness = DEFAULT.control.end_stiffness_Nm_rad
    end_rad = (len(record.force_N) - 1) * STEP_RAD
    rendered = Rendered([force * HANDLE_RADIUS_M for force in record.force_N], end_rad, stiffness)
    waiting = list(record.live.changes)
    ticks = round(TICKS_A_S / door.rate_hz)
    for number, angle_deg in enumerate(angles):
        while waiting and (waiting[0].taken_ns or 0) <= door.t0_ns + round(number * NS / door.rate_hz):
            rendered = Passage(rendered, [force * HANDLE_RADIUS_M for force in waiting.pop(0).force_N])
        place_rad = angle_deg * POINTS_PER_DEG * STEP_RAD
        yield rendered.at(min(place_rad, end_rad)) / HANDLE_RADIUS_M
        for _ in range(ticks):
            rendered = rendered.after_tick() if isinstance(rendered, Passage) else rendered
