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
from protocols.worlds import Done, Simulated, VirtualClock

DOOR_RATE_HZ = 100.0


class RigError(ValueError):
    """The rig that a study needs cannot be had."""


@dataclass(frozen=True)
class Rig:
    """A world, what it is made of, and how to make it safe."""

    world: World
    description: dict[str, Any]
    safe: Callable[[], None]


def simulated(plan: Plan, folder: Path, t_ns: int = 0) -> Rig:
    """A simulated participant at the twins of the devices that the study needs, from a virtual time on."""
    device = DoorTwin(plan, folder) if "door" in plan.study.needs else HandedOver(plan)
    world = Simulated(Perceiver(plan), device, VirtualClock(t_ns))
    return Rig(world, {"kind": "simulated", "twins": list(plan.study.needs)}, _nothing_moves)


def real(plan: Plan) -> Rig:
    """The lab's own rig. Raises RigError: this version has no driver for a real window or device."""
    needs = ", ".join(plan.study.needs) or "window"
    raise RigError(
        f"{plan.study.study} needs {needs}; this version of Palpate drives simulated devices only: add --simulate"
    )


@dataclass
class DoorTwin:
    """The simulated door: a simulated hand opens it once along the stimulus' profile."""

    plan: Plan
    folder: Path
    profiles: dict[str, tuple[float, ...]] = field(default_factory=dict)

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Present a stimulus; the reply carries the angle and the force that the hand met."""
        if not isinstance(request, Present):
            raise RigError(f"the simulated door cannot do {request.body()['do']!r}")
        seconds = self._seconds(request)
        opening = open_door(self._profile(request), seconds, DOOR_RATE_HZ)
        block = Samples("door", ("angle", "force"), ("deg", "N"), DOOR_RATE_HZ, t_ns, opening.interleaved())
        return Done(Reply({"presented": True, "seconds": seconds}, (block,)), seconds)

    def _seconds(self, request: Present) -> float:
        trial, who = request.trial, self.plan.who.participant
        chance = normal("opening", self.plan.seed, who, trial.number, trial.attempt)
        return round(seconds_to_present(self.plan) * max(0.5, 1.0 + 0.15 * chance), 3)

    def _profile(self, request: Present) -> tuple[float, ...]:
        stimulus = request.trial.stimulus
        if stimulus.id not in self.profiles:
            file = self.folder / stimulus.columns.get("file", "")
            if not file.is_file():
                raise RigError(f"{file}: the profile of stimulus {stimulus.id!r} is not there")
            if hashlib.sha256(file.read_bytes()).hexdigest() != stimulus.sha256:
                raise RigError(f"{file}: not the file that the session was planned with (its SHA-256 differs)")
            self.profiles[stimulus.id] = read_profile(file)
        return self.profiles[stimulus.id]


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
