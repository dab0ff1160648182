"""What a session needs of its rig, live or simulated: a world, how to make it safe, and how to open it.

`RecordedBeside` is the world in which sensors are recorded beside everything that is done in trials.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from palpate.protocols.events import Event, Reply, Request, Samples, World, WorldEvent
from palpate.protocols.plan import Plan
from palpate.protocols.study import Stimulus


class RigError(ValueError):
    """The rig that a study needs is not available."""


class StimulusRefused(RigError):
    """A device cannot present `stimulus`, which has the level of a track in its columns, or must not.

    `column` is the column of the stimulus that is wrong, None if no single one is.
    """

    def __init__(self, message: str, stimulus: Stimulus, column: str | None = None) -> None:
        super().__init__(message)
        self.stimulus, self.column = stimulus, column


def _do_nothing() -> None:
    """Do nothing: in a simulated rig nothing moves, and nothing is held open."""


@dataclass(frozen=True)
class Rig:
    """An open rig: its world, and how to make it safe.

    `watch` is called with every event after it was recorded, when a session is resumed first with those recorded
    before; `finish` is called once the session has come to its end.
    """

    world: World
    safe: Callable[[], None] = _do_nothing
    watch: Callable[[Event], None] = lambda _event: None
    finish: Callable[[], None] = _do_nothing


@dataclass(frozen=True)
class RigPlan:
    """How a session gets its rig: a description for the record, a check of what is available, and the opening.

    `check` raises RigError before anything is recorded; `open` takes the plan and the session time, in ns, at which the
    rig's clock starts. `calibration` is the window's, confirmed at the session's start; None without a window.
    """

    description: dict[str, Any]
    check: Callable[[Plan], None]
    open: Callable[[Plan, int], Rig]
    calibration: dict[str, Any] | None = None
    drop: Callable[[], None] = _do_nothing
    """Close what `check` opened; called if `open` is not."""


@dataclass
class RecordedBeside:
    """A world whose replies in trials hold what some sensors measured since the previous reply.

    `ready` is called before each request of a trial: it returns what comes instead, such as a sensor's fault, or None.
    A fault while a form is answered comes with the next request, so that no answer is lost; outside trials, where
    nothing could be repeated, it waits for the next trial.
    """

    world: World
    ready: Callable[[], WorldEvent | None]
    take: Callable[[], tuple[Samples, ...]]

    def now(self) -> int:
        """Return the time of the world."""
        return self.world.now()

    def perform(self, request: Request) -> WorldEvent:
        """Perform the request and add the samples to its reply."""
        if getattr(request, "trial", None) is None:
            return self.world.perform(request)
        if (instead := self.ready()) is not None:
            return instead
        event = self.world.perform(request)
        if not isinstance(event, Reply):
            return event
        return replace(event, samples=(*event.samples, *self.take()))
