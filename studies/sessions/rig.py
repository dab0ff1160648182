"""What a session needs of its rig, live or simulated: a world, how to make it safe, and how to open it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from palpate.protocols.events import Event, World
from palpate.protocols.plan import Plan


class RigError(ValueError):
    """The rig that a study needs is not available."""


def _do_nothing() -> None:
    """Do nothing: in a simulated rig nothing moves, and nothing is held open."""


def _watch_nothing(_event: Event) -> None:
    """Ignore the event."""


@dataclass(frozen=True)
class Rig:
    """An open rig: its world, and how to make it safe.

    `watch` is called with every event after it was recorded, when a session is resumed first with those recorded
    before; `finish` is called once the session has come to its end.
    """

    world: World
    safe: Callable[[], None] = _do_nothing
    watch: Callable[[Event], None] = _watch_nothing
    finish: Callable[[], None] = _do_nothing


@dataclass(frozen=True)
class RigPlan:
    """How a session gets its rig: a description for the record, a check of what is there, and the opening.

    `check` raises RigError before anything is recorded; `open` takes the plan and the session time, in ns, that the
    rig's clock starts at. `calibration` is the window's, confirmed at the session's start; None without a window.
    """

    description: dict[str, Any]
    check: Callable[[Plan], None]
    open: Callable[[Plan, int], Rig]
    calibration: dict[str, Any] | None = None
    drop: Callable[[], None] = _do_nothing
    """Close what `check` opened, where `open` is not called after it."""
