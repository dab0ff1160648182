"""Runs sessions in processes of their own and kills them: started as `python -m tests.studies.nursery LABS SEED KILLS`.

One process imports everything once; each session is a fork of it, killed with SIGKILL at a random instant.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from protocols.plan import ParticipantRow, Plan, compile_plan
from protocols.study import Study
from studies import catalogue
from studies.rig import RigPlan, simulated
from studies.session import ledger_path, resume, start

SHORT = {"1": {"car": ["BC3", "FORD"]}, "2": {"car": ["K3"]}}
DOORS = catalogue.SHIPPED / "door_ratings"


def the_plan() -> Plan:
    """Thirty trials with the measured door among them, lively enough to go back and to lapse."""
    definition = catalogue.read_study(DOORS / "study.yaml").study.definition()
    simulation = {**definition["simulation"], "revise_rate": 0.1, "lapse_rate": 0.1}
    study = Study.model_validate(
        {**definition, "groups": SHORT, "simulation": simulation, "rest": {"every": 5}, "opening": []}
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


def usual_seconds(lab: Path, plan: Plan, rig: RigPlan) -> float:
    """How long an undisturbed session takes here."""
    begun = time.perf_counter()
    os.waitpid(child(lambda: start(lab, plan, rig)), 0)
    return time.perf_counter() - begun


def kill_after(seconds: float, act: Callable[[], object]) -> None:
    """Do something in a process of its own, and kill it so many seconds later."""
    pid = child(act)
    time.sleep(seconds)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)


def main(labs: Path, seed: int, kills: int) -> None:
    """Kill `kills` sessions, each in a lab of its own at an instant drawn evenly over a usual session.

    Every second one is taken up again and that is killed, too.
    """
    chance, plan, rig = random.Random(seed), the_plan(), the_rig()
    usual = min(usual_seconds(labs / f"usual{number}", plan, rig) for number in range(3))
    for number in range(kills):
        lab = labs / str(number)
        kill_after(chance.uniform(0, 1.1 * usual), lambda lab=lab: start(lab, plan, rig))
        path = ledger_path(lab, plan.study.study, plan.who.participant)
        if number % 2 and path.exists():
            kill_after(chance.uniform(0, 0.5 * usual), lambda path=path: resume(path, rig))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
