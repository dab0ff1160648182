"""Putting a world together: the one module between sessions and devices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.protocols.events import Event, World
from palpate.protocols.perceiver import Perceiver
from palpate.protocols.plan import Plan
from palpate.protocols.study import Study
from palpate.protocols.worlds import Simulated, VirtualClock


def _nothing_moves() -> None:
    """A simulated rig holds no energy: it is safe as it is."""


def _nothing_to_tell(_event: Event) -> None:
    """Nobody looks on."""


@dataclass(frozen=True)
class Rig:
    """An open rig: its world, and how to make it safe.

    `watch` is told of every event once it is kept, those of a session that is gone on with first; `finish` is called
    once the session has come to its end.
    """

    world: World
    safe: Callable[[], None]
    watch: Callable[[Event], None] = _nothing_to_tell
    finish: Callable[[], None] = _nothing_moves


@dataclass(frozen=True)
class RigPlan:
    """How a session gets its rig: what it will be made of, whether it can be had, and the opening of it.

    `check` raises RigError before anything is recorded; `open` takes the plan and the session time, in ns, that the
    rig's clock starts at. `calibration` is the window's, confirmed at the session's start; None without a window.
    """

    description: dict[str, Any]
    check: Callable[[Plan], None]
    open: Callable[[Plan, int], Rig]
    calibration: dict[str, Any] | None = None
    drop: Callable[[], None] = _nothing_moves
    """Lets go of what `check` opened, where it comes to no `open`."""


def simulated(study: Study, folder: Path, lab: Path | None = None, pictures: int | None = None) -> RigPlan:
    """A simulated participant at the twins of the devices that the study needs; `folder` holds its stimulus files.

    A `lab` brings its own models, where it has any; a camera keeps so many `pictures` of each stimulus there, none
    where it is None.
    """
    from palpate.studies.profiles import Profiles
    from palpate.studies.twins import renderings_of, twin_for

    profiles = Profiles(folder)
    renderings = renderings_of(folder, lab) if "texture_renderer" in study.needs else None

    def check(plan: Plan) -> None:
        twin_for(study, plan, folder, profiles, lab, renderings, pictures).check(plan)

    def opened(plan: Plan, t_ns: int) -> Rig:
        device = twin_for(study, plan, folder, profiles, lab, renderings, pictures)
        return Rig(Simulated(Perceiver(plan, feels=device.feels), device, VirtualClock(t_ns)), _nothing_moves)

    kept = {} if pictures is None else {"pictures": pictures}
    return RigPlan({"kind": "simulated", "twins": list(study.needs), **kept}, check, opened)
