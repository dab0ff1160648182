"""Putting a world together: the one module between sessions and devices."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from devices.door.twin import open_door, read_profile
from protocols.events import World
from protocols.keyed import normal
from protocols.perceiver import Perceiver
from protocols.plan import Plan
from protocols.requests import Present, Reply, Request, Samples
from protocols.study import Stimulus, Study
from protocols.worlds import Done, Simulated, VirtualClock

DOOR_RATE_HZ = 100.0


class RigError(ValueError):
    """The rig that a study needs cannot be had."""


@dataclass(frozen=True)
class Rig:
    """An open rig: its world, and how to make it safe."""

    world: World
    safe: Callable[[], None]


@dataclass(frozen=True)
class RigPlan:
    """How a session gets its rig: what it will be made of, whether it can be had, and the opening of it.

    `check` raises RigError before anything is recorded; `open` takes the plan and the session time, in ns, that the
    rig's clock starts at.
    """

    description: dict[str, Any]
    check: Callable[[Plan], None]
    open: Callable[[Plan, int], Rig]


def simulated(study: Study, folder: Path) -> RigPlan:
    """A simulated participant at the twins of the devices that the study needs; `folder` holds its stimulus files."""
    profiles = Profiles(folder)
    with_door = "door" in study.needs

    def check(plan: Plan) -> None:
        for trial in plan.trials if with_door else ():
            profiles.of(trial.stimulus)

    def opened(plan: Plan, t_ns: int) -> Rig:
        device = DoorTwin(plan, profiles) if with_door else HandedOver(plan)
        return Rig(Simulated(Perceiver(plan), device, VirtualClock(t_ns)), _nothing_moves)

    return RigPlan({"kind": "simulated", "twins": list(study.needs)}, check, opened)


def real(study: Study) -> RigPlan:
    """The lab's own rig. Raises RigError: this version has no driver for a real window or device."""
    needs = ", ".join(study.needs) or "window"
    raise RigError(
        f"{study.study} needs {needs}; this version of Palpate drives simulated devices only: add --simulate"
    )


@dataclass
class Profiles:
    """The door profiles of a study, read once; each must be the file that the study was planned with."""

    folder: Path
    read: dict[str, tuple[float, ...]] = field(default_factory=dict)

    def of(self, stimulus: Stimulus) -> tuple[float, ...]:
        """The 621 forces, in newtons, of a stimulus. Raises RigError, or DoorDataError on a file that is no profile."""
        if stimulus.id not in self.read:
            file = self.folder / stimulus.columns.get("file", "")
            if not file.is_file():
                raise RigError(f"stimulus {stimulus.id!r}: no door profile {file} (the column `file` of its table)")
            if hashlib.sha256(file.read_bytes()).hexdigest() != stimulus.sha256:
                raise RigError(f"{file}: not the file that the session was planned with (its SHA-256 differs)")
            self.read[stimulus.id] = read_profile(file)
        return self.read[stimulus.id]


@dataclass(frozen=True)
class DoorTwin:
    """The simulated door: a simulated hand opens it once along the stimulus' profile."""

    plan: Plan
    profiles: Profiles

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Present a stimulus; the reply carries the angle and the force that the hand met."""
        if not isinstance(request, Present):
            raise RigError(f"the simulated door cannot do {request.body()['do']!r}")
        seconds = self._seconds(request)
        opening = open_door(self.profiles.of(request.trial.stimulus), seconds, DOOR_RATE_HZ)
        block = Samples("door", ("angle", "force"), ("deg", "N"), DOOR_RATE_HZ, t_ns, opening.interleaved())
        return Done(Reply({"presented": True, "seconds": seconds}, (block,)), seconds)

    def _seconds(self, request: Present) -> float:
        trial, who = request.trial, self.plan.who.participant
        chance = normal("opening", self.plan.seed, who, trial.number, trial.attempt)
        return round(seconds_to_present(self.plan) * max(0.5, 1.0 + 0.15 * chance), 3)


@dataclass(frozen=True)
class HandedOver:
    """Where a study needs no device, somebody hands its stimuli over."""

    plan: Plan

    def __call__(self, request: Request, _t_ns: int) -> Done:
        """Present the stimulus."""
        if not isinstance(request, Present):
            raise RigError(f"no device of this study can do {request.body()['do']!r}")
        return Done(Reply({"presented": True}), seconds_to_present(self.plan))


def seconds_to_present(plan: Plan) -> float:
    """How long a simulated presentation takes on average."""
    return plan.study.simulation.present_s if plan.study.simulation is not None else 2.5


def _nothing_moves() -> None:
    """A simulated rig holds no energy: it is safe as it is."""
