"""A world in which sensors are recorded beside everything that is done in trials."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from palpate.protocols.events import World
from palpate.protocols.requests import Came, Reply, Request, Samples


@dataclass
class RecordedBeside:
    """A world whose replies in trials hold what some sensors measured since the reply before.

    `ready` is called before each request of a trial: it returns what comes instead, as a fault of a sensor, or None.
    A fault while a form is answered comes with the next request, so that no answer is lost; outside trials, where
    nothing could be repeated, it waits for the next trial.
    """

    world: World
    ready: Callable[[], Came | None]
    take: Callable[[], tuple[Samples, ...]]

    def now(self) -> int:
        """Return the time of the world."""
        return self.world.now()

    def perform(self, request: Request) -> Came:
        """Perform the request; its reply holds the samples."""
        if getattr(request, "trial", None) is None:
            return self.world.perform(request)
        if (instead := self.ready()) is not None:
            return instead
        came = self.world.perform(request)
        if not isinstance(came, Reply):
            return came
        return replace(came, samples=(*came.samples, *self.take()))
