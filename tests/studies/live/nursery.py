"""Live sessions with an experimenter at work, killed at random instants: `python -m tests.studies.live.nursery LABS`.

One process imports everything once; each session is a fork of it (tests.studies.sessions.nursery).
"""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

from palpate.studies.sessions.rig import RigPlan
from palpate.studies.sessions.session import start
from palpate.studies.sessions.session_files import ledger_path
from tests.studies.live.halls import Hall, sheets_plan
from tests.studies.sessions.nursery import child, kill_after

BUSY = (
    (0.0, "confirm"), (0.5, "note one"), (1.0, "pause"), (3.0, "go on"), (3.1, "repeat"), (3.2, "confirm"),
    (6.0, "confirm"), (6.5, "repeat last"), (7.0, "confirm"), (7.5, "pause"), (8.0, "note while paused"),
    (9.0, "go on"), *[(10.0, "confirm")] * 6,
)  # fmt: skip
"""What the experimenter does: eight asides among the confirmations."""
KILLS = 9


def begin(lab: Path) -> None:
    """A busy session."""
    start(lab, sheets_plan(), Hall(BUSY).rig)


def dying(rig: RigPlan, seq: int) -> RigPlan:
    """The rig whose process is killed at the instant after event `seq` is written, whatever the machine's load."""

    def opened(plan, t_ns):
        opened_rig = rig.open(plan, t_ns)

        def watch(event):
            if event.seq == seq:
                os.kill(os.getpid(), signal.SIGKILL)
            opened_rig.watch(event)

        return replace(opened_rig, watch=watch)

    return replace(rig, open=opened)


def begin_and_die(lab: Path, seq: int) -> None:
    """A busy session that is killed after event `seq`."""
    start(lab, sheets_plan(), dying(Hall(BUSY).rig, seq))


def ledger(lab: Path) -> Path:
    """Where it lies."""
    return ledger_path(lab, "sheets", "P001")


def main(labs: Path) -> None:
    """One whole session in LABS/whole; killed ones in LABS/0, LABS/1, ...: every third after an event, else by time."""
    chance = random.Random(5)
    started_s = time.perf_counter()
    os.waitpid(child(lambda: begin(labs / "whole")), 0)
    usual = time.perf_counter() - started_s
    for number in range(KILLS):
        lab = labs / str(number)
        if number % 3 == 0:
            os.waitpid(child(lambda lab=lab, seq=5 + 4 * number: begin_and_die(lab, seq)), 0)
        else:
            kill_after(chance.uniform(0.1, 1.0) * usual, lambda lab=lab: begin(lab))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
