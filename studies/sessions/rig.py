"""What a session needs of its rig, live or simulated: a world, how it is made safe, and how it is opened."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from palpate.protocols.events import Event, World
from palpate.protocols.plan import Plan


class RigError(ValueError):
    """The rig that a study needs cannot be had."""


def _do_nothing() -> None:
    """Nothing moves, as in a simulated rig, and nothing is held."""


def _watch_nothing(_event: Event) -> None:
    """Nobody looks on."""


@dataclass(frozen=True)
class Rig:
    """An open rig: its world, and how to make it safe.

    `watch` is told of every event once it is kept, those of a session that is gone on with first; `finish` is called
    once the session has come to its end.
    """

    world: World
    safe: Callable[[], None] = _do_nothing
    watch: Callable[[Event], None] = _watch_nothing
    finish: Callable[[], None] = _do_nothing


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
    drop: Callable[[], None] = _do_nothing
    """Lets go of what `check` opened, where it comes to no `open`."""
