"""The rig of a set of simulated textures: the twins of a simulated session, whose work is done ahead."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from protocols.events import Event
from protocols.perceiver import Perceiver
from protocols.plan import Plan, Trial
from protocols.requests import Reply, Request, Samples, Sense
from protocols.worlds import Done, Simulated, VirtualClock
from studies.ahead import Ahead
from studies.catalogue import Found
from studies.pictured import KeptCameraTwin, jpegs_of
from studies.profiles import Profiles
from studies.rig import Rig, RigPlan, simulated
from studies.scenes import WHOLE, Strokes, seed_of
from studies.twins import DeviceTwin, demand_surface, sensing, twin_for

Watch = Callable[[Event], None]


@dataclass(frozen=True)
class ToolAhead:
    """The simulated tool (studies.twins.ToolTwin), whose recordings are computed ahead."""

    felt: Ahead[tuple[Samples, ...]]

    def check(self, trial: Trial) -> None:
        """The stimulus says what the simulation needs to know of it."""
        demand_surface(trial)

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Record acceleration, force and position."""
        sense = sensing(request, "tool")
        blocks = tuple(replace(block, t0_ns=t_ns) for block in self.felt(sense))
        return Done(Reply({"recorded": True, "seconds": sense.seconds}, blocks), sense.seconds)


def felt(plan: Plan, request: Sense) -> tuple[Samples, ...]:
    """What the tool's sensors record of strokes over the request's texture, from second 0 on."""
    from studies.virtual_recording import recorded_at_once

    return recorded_at_once("tool", Strokes(plan, WHOLE)(request), request.seconds, 0, seed_of(plan, request.trial))


@dataclass(frozen=True)
class Seen:
    """The pictures of the request's texture under so many lights. It pickles."""

    lights: int

    def __call__(self, _plan: Plan, request: Sense) -> list[bytes]:
        """Each as the bytes of a JPEG file."""
        return list(jpegs_of(request, self.lights))


def rig_for(found: Found, lab: Path, pictures: int, workers: int, watch: Watch) -> RigPlan:
    """The rig of a simulated session whose pictures are kept; events are the same whatever the workers.

    `watch` is told of every event once it is kept.
    """
    kept = pictures if "camera" in found.study.needs else None
    plain = simulated(found.study, found.folder, lab, kept)

    def opened(plan: Plan, t_ns: int) -> Rig:
        device = twin_for(found.study, plan, found.folder, Profiles(found.folder), lab, pictures=kept)
        records, close = _ahead(plan, lab, pictures, workers, device.records)
        world = Simulated(Perceiver(plan), replace(device, records=records), VirtualClock(t_ns))
        return Rig(world, close, watch)

    return RigPlan(plain.description, plain.check, opened)


def _ahead(
    plan: Plan, lab: Path, pictures: int, workers: int, records: Mapping[str, DeviceTwin]
) -> tuple[dict[str, DeviceTwin], Callable[[], None]]:
    """What records, its work done ahead; and what ends that work."""
    if "tool" in records:
        tool = Ahead(felt, plan, workers)
        return {"tool": ToolAhead(tool)}, tool.close
    if "camera" in records:
        seen = Ahead(Seen(pictures), plan, workers)
        return {"camera": KeptCameraTwin(lab, pictures, seen)}, seen.close
    return dict(records), lambda: None
