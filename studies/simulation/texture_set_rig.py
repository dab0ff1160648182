"""The rig of a set of simulated textures: the twins of a simulated session, with their work computed ahead."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Generic, TypeVar

from palpate.protocols.events import Event, Request, Sense
from palpate.protocols.extensions import finder
from palpate.protocols.plan import Plan
from palpate.protocols.simulated_participants import simulated_participant
from palpate.protocols.simulated_world import Done, Simulated, VirtualClock
from palpate.protocols.trial import Trial
from palpate.studies.catalogue import StudyFiles
from palpate.studies.sessions.rig import Rig, RigError, RigPlan
from palpate.studies.simulation.photographs import KeptCameraTwin, jpegs_of
from palpate.studies.simulation.rig import simulated
from palpate.studies.simulation.twins import DeviceTwin, ToolTwin, twin_for
from palpate.studies.stimuli.profiles import Profiles
from palpate.studies.stimuli.scenes import WHOLE, Strokes, sensing
from palpate.studies.workers import serve_the_parent

Watch = Callable[[Event], None]


@dataclass(frozen=True)
class ToolAhead:
    """A simulated tool whose recordings are computed ahead, and then dated at the time of the request."""

    tool: DeviceTwin
    felt: Ahead[Done]

    def check(self, trial: Trial) -> None:
        """Raise as the tool does."""
        self.tool.check(trial)

    def __call__(self, request: Request, t_ns: int) -> Done:
        """Record acceleration, force and position."""
        done = self.felt(sensing(request, "tool"))
        samples = tuple(replace(block, t0_ns=t_ns) for block in done.reply.samples)
        return replace(done, reply=replace(done.reply, samples=samples))


def felt(plan: Plan, request: Sense) -> Done:
    """Return what the simulated tool records of a request, starting at second 0. Workers import it by name."""
    return ToolTwin(plan, Strokes(plan, WHOLE))(request, 0)


@dataclass(frozen=True)
class Seen:
    """A function that renders the request's texture under the first `lights` lights. It pickles."""

    lights: int

    def __call__(self, _plan: Plan, request: Sense) -> list[bytes]:
        """Return each picture as the bytes of a JPEG file."""
        return list(jpegs_of(request, self.lights))


def rig_for(study_files: StudyFiles, lab: Path, pictures: int, workers: int, watch: Watch) -> RigPlan:
    """Return the rig of a simulated session whose pictures are saved; events are the same whatever the workers.

    `watch` is called with every event once it is written.
    """
    saved_pictures = pictures if "camera" in study_files.study.needs else None
    plain = simulated(study_files.study, study_files.folder, lab, saved_pictures)

    def opened(plan: Plan, t_ns: int) -> Rig:
        device = twin_for(
            study_files.study, plan, study_files.folder, Profiles(study_files.folder), lab, pictures=saved_pictures
        )
        records, close = _ahead(plan, lab, pictures, workers, device.records)
        world = Simulated(simulated_participant(plan), replace(device, records=records), VirtualClock(t_ns))
        return Rig(world, close, watch)

    return RigPlan(plain.description, plain.check, opened)


def _ahead(
    plan: Plan, lab: Path, pictures: int, workers: int, records: Mapping[str, DeviceTwin]
) -> tuple[dict[str, DeviceTwin], Callable[[], None]]:
    """Return the recording devices with their work computed ahead, and a function that ends that work."""
    if "tool" in records:
        tool = Ahead(felt, plan, workers)
        return {"tool": ToolAhead(records["tool"], tool)}, tool.close
    if "camera" in records:
        seen = Ahead(Seen(pictures), plan, workers)
        return {"camera": KeptCameraTwin(lab, pictures, seen)}, seen.close
    return dict(records), lambda: None


T = TypeVar("T")


@dataclass
class Ahead(Generic[T]):
    """A function `make(plan, request)` whose results for the plan's next requests `workers` processes compute ahead.

    The results are those of `make`, which depends on its arguments only and pickles by name. With one worker it is
    called in this process. At most one result more than there are workers waits in memory.
    """

    make: Callable[[Plan, Sense], T]
    plan: Plan
    workers: int = 1
    pools: list[ProcessPoolExecutor] = field(default_factory=list)
    coming: dict[int, Future[T]] = field(default_factory=dict)

    def __call__(self, request: Sense) -> T:
        """Return the result for a request. Raises what `make` raises; RigError where a process died."""
        if self.workers == 1 or request.trial.attempt > 1:
            return self.make(self.plan, request)
        if not self.pools:
            spawned = multiprocessing.get_context("spawn")
            self.pools.append(
                ProcessPoolExecutor(self.workers, spawned, initializer=serve_the_parent, initargs=(finder(),))
            )
        later = [trial for trial in self.plan.trials if trial.number > request.trial.number]
        senses = [Sense(t.recording.device, t.recording.seconds, t) for t in later if t.recording is not None]
        for sense in (request, *senses[: self.workers]):
            if sense.trial.number not in self.coming:
                self.coming[sense.trial.number] = self.pools[0].submit(self.make, self.plan, sense)
        try:
            return self.coming.pop(request.trial.number).result()
        except BrokenProcessPool:
            name = request.trial.stimulus.id
            raise RigError(
                f"{name}: a process that computed it died, probably out of memory; continue with one worker"
            ) from None

    def close(self) -> None:
        """End the processes; wait a few seconds for the work they are at."""
        self.coming.clear()
        while self.pools:
            self.pools.pop().shutdown(cancel_futures=True)
