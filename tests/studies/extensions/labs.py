"""A lab with an extension of its own in its folder: a task that asks about a set, and a procedure."""

from __future__ import annotations

from pathlib import Path

from palpate.command_line import _status

TASK = '''"""Name the largest of a set."""

from dataclasses import dataclass

from palpate.protocols.events import Ask, Present, Reply
from palpate.protocols.forms import FormKind, OwnColumn, OwnTable
from palpate.protocols.strict import Strict
from palpate.protocols.tasks.steps import Task, form_of, outcome_of

VERSION = "1.2"


class Settings(Strict):
    aloud: bool = False


@dataclass(frozen=True)
class Largest:
    stimuli: tuple[str, ...]
    aloud: bool
    name: str = "acme.largest"

    def items(self):
        return ["place"]

    def problem(self, answers):
        return None if answers.get("place") in range(len(self.stimuli)) else "a place in the set is expected"


def feel_all(trial):
    for one in trial.each():
        yield Present(one)
    return outcome_of((yield Ask(form_of(trial), trial)))


def simulate(person, ask, form):
    largest = max(form.stimuli, key=len)
    return Reply({"answers": {"place": form.stimuli.index(largest)}, "seconds": 1.0}), 1.0


def rows(form, answers, reply, request):
    yield {"stimulus": form.stimuli[answers["place"]]}


TASKS = {
    "largest": Task(
        "The largest of a set is named.", feel_all, keys=("settings",), settings=Settings, answers="acme_largest",
        block_form=lambda study, stimuli: Largest(tuple(s.id for s in stimuli), study.settings.aloud),
    )
}
COLUMNS = (OwnColumn("stimulus", "The largest of its set.", key=True),)
FORMS = {
    "largest": FormKind(
        "naming the largest", simulate, table=OwnTable("acme_largest", "One row for each set.", COLUMNS, rows)
    )
}
'''
STUDY = """study: sets
task: acme.largest
stimuli: stimuli.csv
settings: {aloud: true}
order: {design: as_listed, within: block, blocks: {by: kind}}
"""
STIMULI = "id,kind\nA,x\nBBB,x\nCC,y\nD,y\n"
PROCEDURE = '''"""Choose any level, whatever was answered."""

from dataclasses import dataclass
from typing import Literal

from palpate.protocols.keyed import uniform
from palpate.protocols.procedures import Ending
from palpate.studies.procedures.adviser import End, Estimate, ProcedureKind, Step


class Settings(Ending):
    ends = frozenset()
    kind: Literal["drawn.any_level"]
    seed: int = 0


@dataclass(frozen=True)
class AnyLevel:
    track: object

    def advise(self, past):
        if len(past) == self.track.trials:
            return End("all trials done")
        draw = uniform("any level", self.track.name, self.track.procedure.seed, len(past))
        return Step(int(draw * len(self.track.levels)))

    def estimate(self, past):
        return Estimate(outside="unknown")


PROCEDURES = {"any_level": ProcedureKind(AnyLevel, Settings)}
'''
THRESHOLD = """study: levels
task: intervals
stimuli: [{id: f40, waveform: sine, frequency_hz: 40, reference: m_s2}]
intervals: {design: forced_choice, seconds: 0.6, gap_s: 0.5}
ask: [{name: chosen, kind: choice, of: intervals}]
procedure:
  kind: drawn.any_level
  seed: 3
  level: {column: level_db, from: -40, to: 10, points: 11}
  stop: {trials: 6}
order: {design: random}
needs: [window, vibration]
simulation: {observer: {threshold: -8, slope: 3, scale: db}}
"""


def add_study(lab: Path, name: str, study: str, stimuli: str = "") -> None:
    """Write a study into the lab."""
    folder = lab / "studies" / name
    folder.mkdir(parents=True)
    (folder / "study.yaml").write_text(study, encoding="utf-8")
    if stimuli:
        (folder / "stimuli.csv").write_text(stimuli, encoding="utf-8")


def make_lab(lab: Path, allowed: bool = True) -> Path:
    """Make a lab that has the two extensions, and a study with each."""
    assert _status(["init", str(lab)]) == 0
    (lab / "extensions").mkdir()
    (lab / "extensions" / "acme.py").write_text(TASK, encoding="utf-8")
    (lab / "extensions" / "drawn.py").write_text(PROCEDURE, encoding="utf-8")
    add_study(lab, "sets", STUDY, STIMULI)
    add_study(lab, "levels", THRESHOLD)
    if allowed:
        (lab / "lab.yaml").write_text("extensions: true\n", encoding="utf-8")
    return lab
