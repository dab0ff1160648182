"""A lab full of simulated textures: touched, photographed and rated by simulated people, in real ledgers."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from palpate.protocols.events import Event
from palpate.protocols.plan import Plan
from palpate.protocols.progress import Report
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS
from palpate.protocols.wording import count, some
from palpate.studies.catalogue import Found
from palpate.studies.console.words import about
from palpate.studies.launching.changes import study_change
from palpate.studies.launching.launch import plans_of
from palpate.studies.participants.lab import SIDECAR
from palpate.studies.participants.lab_template import make_lab
from palpate.studies.participants.registry import withdrawn
from palpate.studies.sessions.record import Record, read
from palpate.studies.sessions.session import resume, start
from palpate.studies.sessions.session_files import ledger_path, ledgers_in, session_starts
from palpate.studies.simulation.texture_set_rig import rig_for
from palpate.studies.simulation.texture_set_studies import (
    GROUPS,
    SECONDS,
    STUDIES,
    Chosen,
    TextureSetError,
    chosen,
    planned,
    told,
    written,
)

Done = Literal["made", "gone on", "kept"]
PICTURES, RATERS = 10, 20
QUICK = ("T01", "T08", "T11", "T15", "T22", "T33", "T37", "T39", "T44", "T48")
"""Of ten classes, each attribute from low to high; intervals of what a model predicts need nine left out."""
QUICK_S, QUICK_PICTURES, QUICK_RATERS = 8.0, 2, 6
MOST_RATERS = 999
BYTES_A_SECOND, BYTES_A_PICTURE, BYTES_A_RATER = 231_000, 850_000, 200_000
"""Measured: docs/how-to/describe-textures.md."""
SPARE = 1.2
"""How much more room there must be than the set is going to take."""


@dataclass(frozen=True)
class SetWanted:
    """What is to be made: pictures of each texture, simulated raters; the workers compute, one writes."""

    chosen: Chosen
    pictures: int = PICTURES
    raters: int = RATERS
    seed: int = 0
    workers: int = 1


@dataclass(frozen=True)
class Made:
    """One session of the set: what was done of it now, and whether it is complete."""

    study: str
    participant: str
    ledger: Path
    done: Done
    complete: bool
    events: int
    ended: str


def set_wanted(
    textures: tuple[str, ...], seconds: float | None, pictures: int | None, raters: int | None, seed: int,
    workers: int, quick: bool,
) -> SetWanted:  # fmt: skip
    """Return what is to be made. What is None is 60 s, 10 pictures, 20 raters, or that of a quick set."""
    some = QUICK if quick and not textures else textures
    given = chosen(some, seconds if seconds is not None else (QUICK_S if quick else SECONDS))
    shown = pictures if pictures is not None else (QUICK_PICTURES if quick else PICTURES)
    people = raters if raters is not None else (QUICK_RATERS if quick else RATERS)
    return SetWanted(given, shown, people, seed, workers)


def make_set(lab: Path, wanted: SetWanted, report: Report) -> list[Made]:
    """Make LAB a lab where it is none, and have its sessions of texture_capture, texture_photos and texture_ratings.

    A session that is complete is kept, one that was interrupted is gone on with; the list ends with the first that is
    not complete (Ctrl-C). Raises TextureSetError, before anything is written, where the lab has sessions or studies by
    these names that are not of this set, where somebody withdrew by a name of the set, and where the disk has no room.
    """
    _demand_sizes(wanted)
    _demand_no_others(lab, wanted)
    _demand_nobody_withdrew(lab, wanted)
    _demand_room(lab, wanted)
    pace = Pace(_weights(wanted), _cpu_s(wanted))
    studies = planned(lab, wanted.chosen)
    before = {
        (name, who): _before(lab, study, who, wanted)
        for name, study in studies.items()
        for who in _people(name, wanted)
    }
    report(estimate(wanted))
    if not (lab / SIDECAR).is_file():
        make_lab(lab)
    made: list[Made] = []
    for name, found in written(lab, wanted.chosen).items():
        people = _people(name, wanted)
        for plan in plans_of(found.study, lab, people, wanted.seed, False, group=GROUPS[name]):
            made.append(_made(lab, found, plan, before[name, plan.who.participant], wanted, pace, report))
            if not made[-1].complete:
                return made
    return made


def estimate(wanted: SetWanted) -> str:
    """Describe the set, and the room and processor time that it takes from nothing."""
    pictures, raters = count(wanted.pictures, "picture"), count(wanted.raters, "simulated rater")
    room, time = f"{room_bytes(wanted) / 1e6:,.0f} MB", f"{_cpu_s(wanted):.0f} s of processor time"
    return (
        f"{told(wanted.chosen)}, {pictures} of each, {raters}: about {room}, and about {time} on an idle core (where"
        " other programs run, much longer); the time left is said with each texture"
    )


def room_bytes(wanted: SetWanted) -> int:
    """How much room the set takes on the disk, about."""
    count = len(wanted.chosen.textures)
    touched = round(count * wanted.chosen.seconds * BYTES_A_SECOND)
    return touched + count * wanted.pictures * BYTES_A_PICTURE + wanted.raters * BYTES_A_RATER


def _weights(wanted: SetWanted) -> dict[str, float]:
    return cpu_s(len(wanted.chosen.textures), wanted.chosen.seconds, wanted.pictures)


def _cpu_s(wanted: SetWanted) -> float:
    weights, textures = _weights(wanted), len(wanted.chosen.textures)
    steps = {"texture_capture": textures, "texture_photos": textures, "texture_ratings": wanted.raters}
    return sum(number * weights[step] for step, number in steps.items())


def _demand_sizes(wanted: SetWanted) -> None:
    if not 1 <= wanted.pictures <= PICTURES:
        raise TextureSetError(f"{wanted.pictures} pictures of each texture: from 1 to {PICTURES} are expected")
    if not 1 <= wanted.raters <= MOST_RATERS:
        raise TextureSetError(f"{wanted.raters} raters: from 1 to {MOST_RATERS} are expected")
    if wanted.workers < 1:
        raise TextureSetError(f"{wanted.workers} workers: 1 or more are expected")


def _people(study: str, wanted: SetWanted) -> list[str]:
    return [f"P{number:03d}" for number in range(1, 1 + (wanted.raters if study == "texture_ratings" else 1))]


def _demand_no_others(lab: Path, wanted: SetWanted) -> None:
    """Raise where a person sat in the lab, whose pseudonym a simulated one would take, and where it has sessions by
    these names that the set does not."""
    if any(each.in_person for each in session_starts(ledgers_in(lab))):
        raise TextureSetError(f"{lab}: people took part here; a set of simulated textures wants a lab of its own")
    for study in STUDIES:
        ours = {ledger_path(lab, study, who).name for who in _people(study, wanted)}
        others = [path for path in ledgers_in(lab, study) if path.name not in ours]
        if others:
            raise TextureSetError(
                f"{some(others, 1)}: a session of {study} that is not of {len(ours)} simulated participants; a set of"
                " simulated textures wants a lab of its own, or as many raters as it was made with"
            )


def _demand_nobody_withdrew(lab: Path, wanted: SetWanted) -> None:
    """Raise where a pseudonym that a simulated participant would take is of somebody who withdrew."""
    taken = sorted(withdrawn(lab) & {who for study in STUDIES for who in _people(study, wanted)})
    if taken:
        raise TextureSetError(
            f"{lab}: {some(taken)} withdrew here, and no session can be had in that name, not even a simulated "
            "one; a set of simulated textures wants a lab of its own, or fewer raters (--raters)"
        )


def _demand_room(lab: Path, wanted: SetWanted) -> None:
    there = next(folder for folder in (lab.resolve(), *lab.resolve().parents) if folder.exists())
    free, taken = shutil.disk_usage(there).free, sum(each.stat().st_size for each in _there(lab))
    lacks = SPARE * room_bytes(wanted) - taken - free
    if lacks > 0:
        raise TextureSetError(
            f"{there}: {free / 1e9:.2g} GB free, and the set takes {room_bytes(wanted) / 1e9:.2g} GB; give a lab on"
            " another disk, or fewer textures (--textures), seconds or pictures"
        )


def _there(lab: Path) -> Iterator[Path]:
    """Files that a set begun before has there already."""
    for study in STUDIES:
        yield from ledgers_in(lab, study)
    yield from (lab / "pictures").glob("*/*.jpg")


def _before(lab: Path, study: Study, who: str, wanted: SetWanted) -> Record | None:
    """The session as far as it was had before; raises where it is another one, or cannot be gone on with."""
    path = ledger_path(lab, study.study, who)
    if not path.exists():
        return None
    record = read(path)
    if other := _other(record, study, wanted):
        raise TextureSetError(
            f"{path}: {other}: it is left as it is. Ask for what it was made with, or give another lab"
        )
    if record.status not in ("complete", "interrupted"):
        raise TextureSetError(f"{path}: the session was {record.status}; give another lab")
    return record


def _other(record: Record, study: Study, wanted: SetWanted) -> str:
    """What makes a session another than the set's, in words; "" where nothing does."""
    header = record.header
    if header["rig"]["kind"] != "simulated":
        return "a person's session, none of a simulated set"
    if changed := study_change(header["study"], study):
        return f"it has another study ({changed})"
    if header["seed"] != wanted.seed:
        return f"it has seed {header['seed']}, not {wanted.seed}"
    if "camera" in study.needs and header["rig"].get("pictures") != wanted.pictures:
        return f"it keeps {header['rig'].get('pictures', 'no')} pictures of each texture, not {wanted.pictures}"
    return "" if header["group"] == GROUPS[study.study] else f"it is of the group {header['group']}"


def _made(
    lab: Path, found: Found, plan: Plan, record: Record | None, wanted: SetWanted, pace: Pace, report: Report
) -> Made:
    who, study = plan.who.participant, found.study.study
    path = ledger_path(lab, study, who)
    if record is not None and record.complete:
        pace.skip(study, 1 if TASKS[plan.study.task].asks else len(plan.trials))
        return Made(study, who, path, "kept", True, len(record.events), "complete")
    seen = 0 if record is None else len(record.events)
    rig = rig_for(found, lab, wanted.pictures, wanted.workers, _telling(plan, seen, pace, report))
    sat = start(lab, plan, rig) if record is None else resume(path, rig)
    return Made(study, who, path, "made" if record is None else "gone on", sat.complete, sat.events, sat.reason)


def _telling(plan: Plan, seen: int, pace: Pace, report: Report) -> Callable[[Event], None]:
    """Tell how far a session has come: of a recording each texture, of ratings the end. `seen` is known already."""
    study, number = plan.study.study, len(plan.trials)
    ends = "session_ended" if TASKS[plan.study.task].asks else "trial_ended"

    def watch(event: Event) -> None:
        if event.kind != ends:
            return
        if event.seq < seen:
            pace.skip(study)
            return
        seconds = pace.step(study)
        left = f"; {about(seconds)}" if round(seconds, -1) else ""
        if event.kind == "trial_ended":
            report(f"{study}: {plan.trials[(event.trial or 1) - 1].stimulus.id}, {event.trial} of {number}{left}")
        else:
            report(f"{study}: {plan.who.participant}, {count(number, 'texture')} rated{left}")

    return watch


CPU_A_SECOND, CPU_A_TEXTURE, CPU_A_PICTURE, CPU_A_RATER = 0.04, 0.75, 0.21, 0.6
"""Processor seconds on an idle core, measured: docs/how-to/describe-textures.md."""


def cpu_s(textures: int, seconds: float, pictures: int) -> dict[str, float]:
    """Return the processor time of one step of each study: a texture touched, a texture photographed, a rater."""
    return {
        "texture_capture": CPU_A_TEXTURE + CPU_A_SECOND * seconds,
        "texture_photos": CPU_A_TEXTURE + CPU_A_PICTURE * pictures,
        "texture_ratings": CPU_A_RATER * textures / 50,
    }


class Pace:
    """The time left of work in steps of known weights, from the time that the steps so far took on this machine."""

    def __init__(self, weights: dict[str, float], total: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.weights, self.left, self.spent = weights, total, 0.0
        self.clock, self.began = clock, clock()

    def skip(self, step: str, count: int = 1) -> None:
        """Take steps that were done before out of the work."""
        self.left -= count * self.weights[step]

    def step(self, step: str) -> float:
        """Count a step as done, and return about how many seconds the others take."""
        self.skip(step)
        self.spent += self.weights[step]
        return max(0.0, self.left) * (self.clock() - self.began) / self.spent
