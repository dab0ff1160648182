"""A lab full of simulated textures: touched, photographed and rated by simulated people, in real ledgers.

Its studies are the shipped ones, or a lab's own with fewer textures or seconds.
"""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.events import Event
from palpate.protocols.files import staged_folder, write_text
from palpate.protocols.plan import Plan
from palpate.protocols.progress import Report
from palpate.protocols.study import Study
from palpate.protocols.tables import table_text
from palpate.protocols.tasks import TASKS
from palpate.protocols.wording import count, some
from palpate.studies.catalogue import SHIPPED, STUDY_FILE, StudyFiles, read_study, stimulus_rows
from palpate.studies.console.words import about
from palpate.studies.lab import SIDECAR
from palpate.studies.launching.changes import study_change
from palpate.studies.launching.launch import plans_of
from palpate.studies.participants.lab_template import make_lab
from palpate.studies.participants.registry import withdrawn
from palpate.studies.sessions.record import Record, read
from palpate.studies.sessions.session import resume, start
from palpate.studies.sessions.session_files import ledger_path, ledgers_in, session_starts
from palpate.studies.simulation.texture_set_rig import rig_for

STUDIES = ("texture_capture", "texture_photos", "texture_ratings")
GROUPS = {"texture_capture": "perception", "texture_photos": "all", "texture_ratings": None}
"""The group of each study that the set consists of."""
SECONDS = 60.0
LEAST_S, MOST_S = 6.0, 3600.0
"""Least and most seconds of stroking.

Features of touch leave out 2.5 s at both ends and take segments of 0.5 s; the speed's window takes 0.06 s more.
"""
FEWEST = 2
"""Least number of textures: simulated people feel a texture relative to the others, so one alone has no rating."""
Row = dict[str, str]


class TextureSetError(ValueError):
    """A set of textures cannot be made; the message says where, what was found and what to do."""


@dataclass(frozen=True)
class TextureSelection:
    """The selected textures, in the studies' order, and the seconds that each is stroked."""

    textures: tuple[str, ...]
    seconds: float = SECONDS

    @property
    def is_shipped(self) -> bool:
        """Whether this is the shipped set."""
        return self.seconds == SECONDS and self.textures == all_textures()

    def __str__(self) -> str:
        return f"{len(self.textures)} textures x {self.seconds:g} s"


def all_textures() -> tuple[str, ...]:
    """Return the ids of the fifty textures."""
    return tuple(row["id"] for row in _rows("texture_ratings"))


def select_textures(textures: tuple[str, ...] = (), seconds: float = SECONDS) -> TextureSelection:
    """Return the selection of the textures with these ids, of all if none is given.

    Raises TextureSetError on an unknown id, a time out of range, or fewer than two textures.
    """
    known = all_textures()
    for name in textures:
        if name not in known:
            padded = f"{name[:1].upper()}{name[1:].zfill(2)}"  # T1 and t01 are T01, whatever other names are as near
            hint = f"did you mean {padded!r}?" if padded in known else nearest(name, known)
            raise TextureSetError(f"no texture is called {name!r}; {hint}")
    selection = tuple(name for name in known if name in textures) if textures else known
    if len(selection) < FEWEST:
        raise TextureSetError(f"{len(selection)} texture: {FEWEST} or more are needed, as people compare them")
    if not LEAST_S <= seconds <= MOST_S:
        raise TextureSetError(
            f"{seconds:g} s of each texture: from {LEAST_S:g} to {MOST_S:g} s are expected, as 2.5 s are left out at"
            " both ends when it is described, and a segment of touch takes 0.5 s"
        )
    return TextureSelection(selection, float(seconds))


def set_studies(lab: Path, selection: TextureSelection) -> dict[str, Study]:
    """Return the three studies with these textures, by name, without writing anything.

    Raises TextureSetError where the lab has a different study by that name.
    """
    studies = {}
    for name in STUDIES:
        if selection.is_shipped:
            studies[name] = read_study(SHIPPED / name / STUDY_FILE).study
        else:
            with TemporaryDirectory() as place:
                studies[name] = read_study(_draft(Path(place), name, selection) / STUDY_FILE).study
        _demand_ours(lab / "studies" / name, studies[name], selection)
    return studies


def write_studies(lab: Path, selection: TextureSelection) -> dict[str, StudyFiles]:
    """Return the three studies with their folders: the shipped ones, else those in LAB/studies, written if missing."""
    if selection.is_shipped:
        return {name: read_study(SHIPPED / name / STUDY_FILE) for name in STUDIES}
    for name in STUDIES:
        if not (lab / "studies" / name).exists():
            with staged_folder(lab / "studies" / name) as folder:
                _draft(folder, name, selection)
    return {name: read_study(lab / "studies" / name / STUDY_FILE) for name in STUDIES}


def _demand_ours(folder: Path, study: Study, selection: TextureSelection) -> None:
    if not folder.exists():
        return
    file = folder / STUDY_FILE
    if not selection.is_shipped and file.is_file() and read_study(file).study.definition() == study.definition():
        return
    raise TextureSetError(
        f"{folder}: the lab has a {folder.name} already, which is not of {selection}; it is left unchanged. Use"
        " the textures and seconds that the set there was made with, or give another lab"
    )


def _draft(folder: Path, name: str, selection: TextureSelection) -> Path:
    """Copy the shipped study's files, with fewer rows or other seconds, into an empty folder; return the study file."""
    shutil.copytree(SHIPPED / name, folder, dirs_exist_ok=True)
    study = folder / STUDY_FILE
    # its comments, which speak of fifty textures, give way to one that says what this is
    bare = re.sub(r"(?m)^#.*\n|[ \t]+#.*$", "", study.read_text("utf-8"))
    write_text(
        study, f"# The shipped {name} with other textures or seconds: {selection}, by palpate textures simulate\n{bare}"
    )
    rows = [changed for row in _rows(name) if (changed := _changed(row, name, selection)) is not None]
    write_text(folder / "stimuli.csv", table_text(rows[0], (row.values() for row in rows)))
    write_text(folder / "README.md", _readme(name, selection))
    return folder


def _rows(name: str) -> list[Row]:
    return [dict(row.cells) for row in stimulus_rows(SHIPPED / name / "stimuli.csv")]


def _changed(row: Row, name: str, selection: TextureSelection) -> Row | None:
    """Return a row as the set has it, None if it is left out. Rows of other groups stay unchanged."""
    if GROUPS[name] is not None and row["set"] != GROUPS[name]:
        return row
    if row["id"] not in selection.textures:
        return None
    return {**row, "seconds": f"{selection.seconds:g}"} if "seconds" in row else row


def _readme(name: str, selection: TextureSelection) -> str:
    return f"""# {name}, {selection}

Written by `palpate textures simulate`: the study that Palpate ships, with these textures or seconds only.
{", ".join(selection.textures)}.

Simulated people feel a texture relative to the study's others: their ratings of a texture in a smaller set
are not those of the full one.
"""


Done = Literal["made", "gone on", "kept"]
PICTURES, RATERS = 10, 20
QUICK = ("T01", "T08", "T11", "T15", "T22", "T33", "T37", "T39", "T44", "T48")
"""The textures of a quick set: ten classes, each attribute from low to high; prediction intervals need nine."""
QUICK_S, QUICK_PICTURES, QUICK_RATERS = 8.0, 2, 6
MOST_RATERS = 999
BYTES_A_SECOND, BYTES_A_PICTURE, BYTES_A_RATER = 231_000, 850_000, 200_000
"""Measured: docs/how-to/describe-textures.md."""
CPU_A_SECOND, CPU_A_TEXTURE, CPU_A_PICTURE, CPU_A_RATER = 0.04, 0.75, 0.21, 0.6
"""Processor seconds on an idle core, measured: docs/how-to/describe-textures.md."""
SPARE = 1.2
"""The room that must be free, as a multiple of what the set will take."""


@dataclass(frozen=True)
class SetOptions:
    """Options of a set: pictures of each texture, simulated raters, seed; `workers` processes compute, one writes."""

    selection: TextureSelection
    pictures: int = PICTURES
    raters: int = RATERS
    seed: int = 0
    workers: int = 1


@dataclass(frozen=True)
class SetSession:
    """The outcome for one session of the set: what was done now, and whether it is complete."""

    study: str
    participant: str
    ledger: Path
    done: Done
    complete: bool
    events: int
    ended: str


def set_options(
    textures: tuple[str, ...], seconds: float | None, pictures: int | None, raters: int | None, seed: int,
    workers: int, quick: bool,
) -> SetOptions:  # fmt: skip
    """Return the options of a set; None means 60 s, 10 pictures, 20 raters, or those of a quick set."""
    default_s, default_pictures, default_raters = (
        (QUICK_S, QUICK_PICTURES, QUICK_RATERS) if quick else (SECONDS, PICTURES, RATERS)
    )
    ids = QUICK if quick and not textures else textures
    return SetOptions(
        select_textures(ids, default_s if seconds is None else seconds),
        default_pictures if pictures is None else pictures,
        default_raters if raters is None else raters,
        seed,
        workers,
    )


def make_set(lab: Path, options: SetOptions, report: Report) -> list[SetSession]:
    """Make LAB a lab if it is none, and record its sessions of texture_capture, texture_photos and texture_ratings.

    A complete session is left as it is, an interrupted one is resumed; the list ends with the first that is not
    complete (Ctrl-C). Raises TextureSetError, before anything is written, where the lab has sessions or studies by
    these names that are not of this set, where a pseudonym of the set belongs to somebody who withdrew, and where the
    disk has no room.
    """
    if not 1 <= options.pictures <= PICTURES:
        raise TextureSetError(f"{options.pictures} pictures of each texture: from 1 to {PICTURES} are expected")
    if not 1 <= options.raters <= MOST_RATERS:
        raise TextureSetError(f"{options.raters} raters: from 1 to {MOST_RATERS} are expected")
    if options.workers < 1:
        raise TextureSetError(f"{options.workers} workers: 1 or more are expected")
    _demand_no_others(lab, options)
    if taken := sorted(withdrawn(lab) & {who for study in STUDIES for who in _people(study, options)}):
        raise TextureSetError(
            f"{lab}: {some(taken)} withdrew here, and no session can be run under that name, not even a simulated "
            "one; a set of simulated textures needs its own lab, or fewer raters (--raters)"
        )
    _demand_room(lab, options)
    pace = Pace(_weights(options), _cpu_s(options))
    studies = set_studies(lab, options.selection)
    before = {
        (name, who): _earlier_record(lab, study, who, options)
        for name, study in studies.items()
        for who in _people(name, options)
    }
    report(estimate(options))
    if not (lab / SIDECAR).is_file():
        make_lab(lab)
    made: list[SetSession] = []
    for name, study_files in write_studies(lab, options.selection).items():
        people = _people(name, options)
        for plan in plans_of(study_files.study, lab, people, options.seed, False, group=GROUPS[name]):
            made.append(_run_session(lab, study_files, plan, before[name, plan.who.participant], options, pace, report))
            if not made[-1].complete:
                return made
    return made


def estimate(options: SetOptions) -> str:
    """Describe the set, and the disk space and processor time that a new one takes."""
    pictures, raters = count(options.pictures, "picture"), count(options.raters, "simulated rater")
    room, time = f"{room_bytes(options) / 1e6:,.0f} MB", f"{_cpu_s(options):.0f} s of processor time"
    return (
        f"{options.selection}, {pictures} of each, {raters}: about {room}, and about {time} on an idle core (where"
        " other programs run, much longer); the time left is shown with each texture"
    )


def room_bytes(options: SetOptions) -> int:
    """Return roughly how many bytes the set takes on the disk."""
    count = len(options.selection.textures)
    touched = round(count * options.selection.seconds * BYTES_A_SECOND)
    return touched + count * options.pictures * BYTES_A_PICTURE + options.raters * BYTES_A_RATER


def _weights(options: SetOptions) -> dict[str, float]:
    return cpu_s(len(options.selection.textures), options.selection.seconds, options.pictures)


def _cpu_s(options: SetOptions) -> float:
    weights, textures = _weights(options), len(options.selection.textures)
    steps = {"texture_capture": textures, "texture_photos": textures, "texture_ratings": options.raters}
    return sum(number * weights[step] for step, number in steps.items())


def _people(study: str, options: SetOptions) -> list[str]:
    return [f"P{number:03d}" for number in range(1, 1 + (options.raters if study == "texture_ratings" else 1))]


def _demand_no_others(lab: Path, options: SetOptions) -> None:
    """Raise TextureSetError if people took part in the lab, or it has sessions of other origin by the names of the set.

    Simulated participants would take the pseudonyms of people.
    """
    if any(start.in_person for start in session_starts(ledgers_in(lab))):
        raise TextureSetError(f"{lab}: people took part here; a set of simulated textures needs its own lab")
    for study in STUDIES:
        ours = {ledger_path(lab, study, who).name for who in _people(study, options)}
        others = [path for path in ledgers_in(lab, study) if path.name not in ours]
        if others:
            raise TextureSetError(
                f"{some(others, 1)}: a session of {study} that is not of {len(ours)} simulated participants; a set of"
                " simulated textures wants a lab of its own, or as many raters as it was made with"
            )


def _demand_room(lab: Path, options: SetOptions) -> None:
    """Raise TextureSetError if the disk has no room for the files of the set that do not exist yet."""
    there = next(folder for folder in (lab.resolve(), *lab.resolve().parents) if folder.exists())
    files = [*(path for study in STUDIES for path in ledgers_in(lab, study)), *(lab / "pictures").glob("*/*.jpg")]
    free, taken = shutil.disk_usage(there).free, sum(file.stat().st_size for file in files)
    if SPARE * room_bytes(options) - taken - free > 0:
        raise TextureSetError(
            f"{there}: {free / 1e9:.2g} GB free, and the set takes {room_bytes(options) / 1e9:.2g} GB; give a lab on"
            " another disk, or fewer textures (--textures), seconds or pictures"
        )


def _earlier_record(lab: Path, study: Study, who: str, options: SetOptions) -> Record | None:
    """Return the record of an earlier run of the session, if any. Raises TextureSetError if it cannot be resumed."""
    path = ledger_path(lab, study.study, who)
    if not path.exists():
        return None
    record = read(path)
    if difference := _difference(record, study, options):
        raise TextureSetError(
            f"{path}: {difference}: it is left unchanged. Use the settings that it was made with, or give another lab"
        )
    if record.status not in ("complete", "interrupted"):
        raise TextureSetError(f"{path}: the session was {record.status}; give another lab")
    return record


def _difference(record: Record, study: Study, options: SetOptions) -> str:
    """Describe how a session differs from the set's; "" if it does not."""
    header = record.header
    if header["rig"]["kind"] != "simulated":
        return "a person's session, none of a simulated set"
    if changed := study_change(header["study"], study):
        return f"it has another study ({changed})"
    if header["seed"] != options.seed:
        return f"it has seed {header['seed']}, not {options.seed}"
    if "camera" in study.needs and header["rig"].get("pictures") != options.pictures:
        return f"it keeps {header['rig'].get('pictures', 'no')} pictures of each texture, not {options.pictures}"
    return "" if header["group"] == GROUPS[study.study] else f"it is of the group {header['group']}"


def _run_session(
    lab: Path,
    study_files: StudyFiles,
    plan: Plan,
    record: Record | None,
    options: SetOptions,
    pace: Pace,
    report: Report,
) -> SetSession:
    who, study = plan.who.participant, study_files.study.study
    path = ledger_path(lab, study, who)
    if record is not None and record.complete:
        pace.skip(study, 1 if TASKS[plan.study.task].asks else len(plan.trials))
        return SetSession(study, who, path, "kept", True, len(record.events), "complete")
    seen = 0 if record is None else len(record.events)
    rig = rig_for(study_files, lab, options.pictures, options.workers, _watch_progress(plan, seen, pace, report))
    result = start(lab, plan, rig) if record is None else resume(path, rig)
    return SetSession(
        study, who, path, "made" if record is None else "gone on", result.complete, result.events, result.reason
    )


def _watch_progress(plan: Plan, seen: int, pace: Pace, report: Report) -> Callable[[Event], None]:
    """Return a watch that reports the progress of a session: after each texture recorded, at the end of ratings.

    The first `seen` events are known already.
    """
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


def cpu_s(textures: int, seconds: float, pictures: int) -> dict[str, float]:
    """Return the processor seconds of one step of each study: a texture touched, a texture photographed, a rater."""
    return {
        "texture_capture": CPU_A_TEXTURE + CPU_A_SECOND * seconds,
        "texture_photos": CPU_A_TEXTURE + CPU_A_PICTURE * pictures,
        "texture_ratings": CPU_A_RATER * textures / 50,
    }


class Pace:
    """An estimate of the time left for steps of known weights, from the time of the steps so far on this machine."""

    def __init__(self, weights: dict[str, float], total: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.weights, self.left, self.spent = weights, total, 0.0
        self.clock, self.began = clock, clock()

    def skip(self, step: str, count: int = 1) -> None:
        """Subtract steps that were done before from the work."""
        self.left -= count * self.weights[step]

    def step(self, step: str) -> float:
        """Count a step as done, and return about how many seconds the remaining ones take."""
        self.skip(step)
        self.spent += self.weights[step]
        return max(0.0, self.left) * (self.clock() - self.began) / self.spent
