"""What simulated recordings take computing for, computed ahead by further processes while it is written down."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from palpate.protocols.plan import Plan
from palpate.protocols.requests import Sense
from palpate.studies.errors import RigError
from palpate.studies.workers import serve_the_parent

T = TypeVar("T")


@dataclass
class Ahead(Generic[T]):
    """`make(plan, request)`, where the plan's next requests to record are begun by `workers` processes meanwhile.

    The answers are those of `make` alone, whichever way: it depends on its arguments only, and pickles by name. One
    worker: it is called here. At most one answer more than there are workers waits in memory.
    """

    make: Callable[[Plan, Sense], T]
    plan: Plan
    workers: int = 1
    pools: list[ProcessPoolExecutor] = field(default_factory=list)
    coming: dict[int, Future[T]] = field(default_factory=dict)

    def __call__(self, request: Sense) -> T:
        """The answer to a request. Raises what `make` raises; RigError where a process died."""
        if self.workers == 1 or request.trial.attempt > 1:
            return self.make(self.plan, request)
        self._begin(request)
        try:
            return self.coming.pop(request.trial.number).result()
        except BrokenProcessPool:
            told = f"{request.trial.stimulus.id}: a process that computed it died, likely for want of memory"
            raise RigError(f"{told}; go on with one worker") from None

    def close(self) -> None:
        """End the processes; what they are at is waited for, a few seconds."""
        self.coming.clear()
        while self.pools:
            self.pools.pop().shutdown(cancel_futures=True)

    def _begin(self, request: Sense) -> None:
        if not self.pools:
            spawned = multiprocessing.get_context("spawn")
            self.pools.append(ProcessPoolExecutor(self.workers, spawned, initializer=serve_the_parent))
        for each in self._next(request):
            if each.trial.number not in self.coming:
                self.coming[each.trial.number] = self.pools[0].submit(self.make, self.plan, each)

    def _next(self, request: Sense) -> list[Sense]:
        """This request and those of the trials after it."""
        later = [trial for trial in self.plan.trials if trial.number > request.trial.number]
        asked = [Sense(t.recording.device, t.recording.seconds, t) for t in later if t.recording is not None]
        return [request, *asked[: self.workers]]
