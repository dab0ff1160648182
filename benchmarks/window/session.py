"""A session in the real window, run for the bench: `python -m` this module, lab, width, height and pixels per mm.

Stimuli take no time, so that one question follows another; the bench acts as the experimenter through a pipe.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from benchmarks.window.link import Link, send
from benchmarks.window.stage import RemoteDesk
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.presenter import Presenter
from palpate.devices.window.presenter_window import WindowPresenter, open_presenter
from palpate.protocols.events import Choose, Event, Present, Reply, Request, Sense, Show, WorldEvent
from palpate.protocols.plan import compile_plan
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session import start

STUDY = "door_ratings"


@dataclass
class World:
    """A world with the real window, and stimuli that take no time."""

    presenter: Presenter
    desk: RemoteDesk

    def now(self) -> int:
        """Return nanoseconds of a clock that never runs backwards."""
        return time.monotonic_ns()

    def perform(self, request: Request) -> WorldEvent:
        """Ask in the window, or present at once."""
        if isinstance(request, Present | Sense | Choose | Show):
            return Reply({"presented": True})
        return self.presenter.perform(request, self.desk, self.now)


def main(lab: str, width: str, height: str, px_per_mm: str) -> None:
    """Run the session; send the bench its number of trials, what is shown, and when each answer is on disk."""
    out = sys.stdout.buffer
    sys.stdout = sys.stderr
    entry = read_study(SHIPPED / STUDY / "study.yaml")
    study = entry.study.model_copy(update={"opening": (), "instructions": None, "rest": None})
    plan = compile_plan(study, allocate(study, "P001"), seed=1)
    calibration = Calibration((int(width), int(height)), float(px_per_mm), 0, "never: a virtual display")
    desk = RemoteDesk(Link.from_input(), out)
    presenter = open_presenter(study, calibration, "en", entry.folder, fullscreen=True, plan=plan)
    desk.presenter = presenter if isinstance(presenter, WindowPresenter) else None
    send(out, "trials", len(plan.trials))
    rig = Rig(World(presenter, desk), presenter.close, lambda event: _report_answer(out, event))
    start(Path(lab), plan, RigPlan({"kind": "bench"}, lambda _plan: None, lambda _plan, _t_ns: rig))


def _report_answer(out: IO[bytes], event: Event) -> None:
    """Send the time at which an answer was on disk, on the clock that this process shares with the bench."""
    if event.kind == "reply" and "answers" in event.value:
        send(out, "on disk", time.monotonic_ns())


if __name__ == "__main__":
    main(*sys.argv[1:])
