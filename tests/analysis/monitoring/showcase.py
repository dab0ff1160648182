"""A lab with something of everything, for the pictures in docs/: python -m tests.analysis.monitoring.showcase LAB.

The two sessions that run stay so until this process ends (Ctrl-C).
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from palpate.protocols.plan import Plan, compile_plan
from palpate.studies import catalogue
from palpate.studies.launching.launch import lab_forms
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.sessions.rig import RigPlan
from palpate.studies.simulation.rig import simulated
from tests.analysis.monitoring.people_for_tests import as_they_are, gate, play, straight
from tests.protocols.studies_for_tests import toy
from tests.studies.sessions.nursery import child

NOTES: list[tuple[int, dict[str, Any]]] = [
    (4, {"do": "note", "text": "Headphones slipped; put right. <script>alert(1)</script>"}),
    (17, {"do": "pause"}),
    (17, {"do": "go_on"}),
]


def door_plan(participant: str) -> tuple[Plan, RigPlan]:
    """A participant of the door study, whose study and files are found once."""
    folder = catalogue.SHIPPED / "door_ratings"
    study = catalogue.read_study(folder / "study.yaml").study
    forms = lab_forms(study, folder, live=False)
    return compile_plan(study, allocate(study, participant), 1, forms), simulated(study, folder)


def small_plan(participant: str) -> tuple[Plan, RigPlan]:
    """A participant of a small study in which every stimulus is met three times, and answered fast."""
    study = toy(title="Soft or hard: four samples, three times", order={"design": "williams", "repeats": 3}, rest=None,
                simulation={"latents": {"Soft": {"size": 4.0}}, "answer_s": 1.5, "noise_sd": 1.0})  # fmt: skip
    return compile_plan(study, allocate(study, participant), 1), simulated(study, Path())


def fill(lab: Path) -> None:
    """Sessions that are over, or broke off."""
    for number in range(1, 17):
        change = straight(3.0) if number == 6 else as_they_are
        asides = list(NOTES) if number == 9 else []
        if number == 13:
            asides = [(5, {"do": "abort", "text": "The participant felt unwell"})]
        plan, rig = door_plan(f"P{number:03d}")
        play(lab, plan, rig, change=change, asides=asides, stop_before=20 if number == 11 else None)
    for number in range(1, 5):
        play(lab, *small_plan(f"P{number:03d}"))
    (lab / "sessions" / "door_ratings_P017_s1.sqlite").write_bytes(b"SQLite format 3\0 and then nothing")


@contextmanager
def running(lab: Path, participant: str, questions: int) -> Iterator[None]:
    """A session in a process of its own that waits before the question after `questions`."""
    gates = lab / f"gate-{participant}"
    gates.mkdir()
    for number in range(1, questions + 1):
        (gates / str(number)).touch()
    pid = child(lambda: play(lab, *door_plan(participant), before=gate(gates, 3600)))
    try:
        yield
    finally:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)


def main() -> None:
    lab = Path(sys.argv[1])
    fill(lab)
    with running(lab, "P018", 31), running(lab, "P019", 8):
        print(f"{lab} is there; Ctrl-C ends its sessions", flush=True)
        signal.pause()


if __name__ == "__main__":
    main()
