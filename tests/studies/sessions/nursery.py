"""Runs sessions in processes of their own and kills them: `python -m tests.studies.sessions.nursery LABS SEED KILLS`.

One process imports everything once; each session is a fork of it, killed with SIGKILL at a random instant. Where the
kernel can filter system calls, the disk is full for one in three of them, from that instant until the kill.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies import catalogue
from palpate.studies.sessions.rig import RigPlan
from palpate.studies.sessions.session import resume, start
from palpate.studies.sessions.session_files import ledger_path
from palpate.studies.simulation.rig import simulated
from tests.needs import has_seccomp

SHORT = {"1": {"car": ["BC3", "FORD"]}, "2": {"car": ["K3"]}}
FULL = getattr(signal, "SIGUSR1", 0)
"""From now on every write is answered with "no space left on the device"."""
DOORS = catalogue.SHIPPED / "door_ratings"


def the_plan(groups: Mapping[str, Mapping[str, Sequence[str]]] = SHORT) -> Plan:
    """Thirty trials, or fewer, with the measured door among them, lively enough to go back and to lapse."""
    definition = catalogue.read_study(DOORS / "study.yaml").study.definition()
    simulation = {**definition["simulation"], "revise_rate": 0.1, "lapse_rate": 0.1}
    study = Study.model_validate(
        {**definition, "groups": groups, "simulation": simulation, "rest": {"every": 5}, "opening": []}
    )
    return compile_plan(study, ParticipantRow("P001", "1", 3), seed=7)


def the_rig() -> RigPlan:
    """The simulated rig of the door study."""
    return simulated(the_plan().study, DOORS)


def child(act: Callable[[], object]) -> int:
    """Fork a process that does one thing."""
    pid = os.fork()
    if pid == 0:
        try:
            act()
        finally:
            os._exit(0)
    return pid


def usual_seconds(path: Path, act: Callable[[], object]) -> tuple[float, float]:
    """How long an undisturbed session takes here: until its ledger is there, and from then on."""
    started_s = time.perf_counter()
    pid = child(act)
    wait_for(path)
    there = time.perf_counter()
    os.waitpid(pid, 0)
    return there - started_s, time.perf_counter() - there


def wait_for(path: Path, longest_s: float = 60.0) -> None:
    """Until the file is there."""
    end = time.perf_counter() + longest_s
    while not path.exists() and time.perf_counter() < end:
        time.sleep(0.0005)


def kill_after(
    seconds: float, act: Callable[[], object], once: Path | None = None, full_s: float | None = None
) -> None:
    """Do something in a process of its own, and kill it so many seconds later, counted from when a file is there.

    Its disk is full for the last `full_s` of these.
    """
    pid = child(act)
    if once is not None:
        wait_for(once)
    time.sleep(seconds if full_s is None else max(0.0, seconds - full_s))
    if full_s is not None:
        os.kill(pid, FULL)
        time.sleep(min(full_s, seconds))
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)


def main(labs: Path, seed: int, kills: int) -> None:
    """Kill `kills` sessions, each in a lab of its own at an instant drawn evenly over a usual session.

    Every second one is resumed and that is killed, too, at an instant within what was left of it. Three in four are
    counted from when their ledger is there: how long a busy machine takes until then decides nothing. What is usual is
    measured anew before every ten, as a machine that was busy may be so no longer.
    """
    chance, plan, rig = random.Random(seed), the_plan(), the_rig()
    if has_seccomp():
        from tests.faults.machine import FAULTS, install

        signal.signal(FULL, lambda *_: install(FAULTS["disk full"]))

    def ledger(lab: Path) -> Path:
        return ledger_path(lab, plan.study.study, plan.who.participant)

    before = after = 0.0
    for number in range(kills):
        if number % 10 == 0:
            usual = labs / f"usual{number}"
            before, after = usual_seconds(ledger(usual), lambda usual=usual: start(usual, plan, rig))
        lab, path = labs / str(number), ledger(labs / str(number))
        latest, once = (1.1 * before, None) if number % 4 == 0 else (1.1 * after, path)
        full_s = chance.uniform(0, 0.05) if number % 3 == 0 and has_seccomp() else None
        instant = chance.uniform(0, latest)
        kill_after(instant, lambda lab=lab: start(lab, plan, rig), once, full_s)
        if number % 2 and path.exists():
            kill_after(chance.uniform(0, latest - instant), lambda path=path: resume(path, rig))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
