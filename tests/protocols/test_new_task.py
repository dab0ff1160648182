"""A task with a form of its own is a module of `protocols/tasks/` and a screen: nothing else names it."""

import shutil
import subprocess
import sys

from tests.names import ROOT

TASK = '''
"""Count what was felt: a task with a form of its own."""

from dataclasses import dataclass

from palpate.protocols.forms import FormKind
from palpate.protocols.events import Reply
from palpate.protocols.tasks.steps import Task, feel_and_answer


@dataclass(frozen=True)
class Counting:
    name: str = "counting"

    def items(self):
        return ["bumps"]

    def problem(self, answers):
        return None if type(answers.get("bumps")) is int else "a whole number of bumps is expected"


def simulate(person, ask, form):
    return Reply({"answers": {"bumps": len(ask.trial.stimulus.id)}, "seconds": 1.0}), 1.0


TASK = Task("Bumps are counted.", feel_and_answer, form=lambda *_: Counting())
FORM = FormKind("counting bumps", simulate)
'''
TASK_OF_SETS = '''
"""Name the largest of a set: a task that asks about a whole block, with settings and a table of its own."""

from dataclasses import dataclass

from palpate.protocols.forms import FormKind, OwnColumn, OwnTable
from palpate.protocols.events import Ask, Present, Reply
from palpate.protocols.strict import Strict
from palpate.protocols.tasks.steps import Task, form_of, outcome_of


class Settings(Strict):
    aloud: bool = False


@dataclass(frozen=True)
class Largest:
    stimuli: tuple[str, ...]
    aloud: bool
    name: str = "largest"

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


TASK = Task(
    "The largest of a set is named.", feel_all, keys=("settings",), settings=Settings, answers="largest_ones",
    block_form=lambda study, stimuli: Largest(tuple(s.id for s in stimuli), study.settings.aloud),
)
FORM = FormKind(
    "naming the largest", simulate,
    table=OwnTable(
        "largest_ones", "One row for each set.", (OwnColumn("stimulus", "The largest of its set.", key=True),),
        lambda form, answers, reply, request: [{"stimulus": form.stimuli[answers["place"]]}],
    ),
)
'''
SCREEN = """
def SCREEN(ask, form, page):
    return ("counted on", form.name, page)
"""
COMMON = """
import sys
from pathlib import Path

import palpate

changed, screens = sys.argv[1:]
palpate.__path__.insert(0, changed)
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.events import Ask, Reply
from palpate.protocols.runner import run
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.protocols.runner import Recorded
from palpate.protocols.simulated_world import Done, Simulated, VirtualClock


def plan_of(task, **parts):
    study = {"study": "bumps", "task": task, "stimuli": [{"id": "A"}, {"id": "BBB"}], "order": {"design": "as_listed"}}
    return compile_plan(Study.model_validate({**study, **parts}), ParticipantRow("P001"))


class Kept(list):
    def append(self, event):
        super().append(event)


def session(plan):
    log = Kept()
    run(plan, Simulated(Perceiver(plan), lambda request, t_ns: Done(Reply({}), 1.0), VirtualClock()), log, {})
    return log
"""
SESSION = """
session(plan_of("slider_rating", attributes=[["Rough", "Smooth"]], scale={"from": 0, "to": 9}))
assert "palpate.protocols.tasks.counting" not in sys.modules, "a study of another task imports it"
plan = plan_of("counting")
events = session(plan)
tape = Recorded(events)
run(plan, tape, tape, {})
tape.demand_end()
from palpate.devices.window import build, screens as package
from palpate.protocols.event_shapes import EventShapes
from palpate.studies.console.words import doing
from palpate.studies.sessions.tables import answers_of

package.__path__.append(screens)
print([(row["attribute"], row["value"]) for row in answers_of(plan, "bumps/P001/1", events).responses])
print(next(doing(event.value) for event in events if event.value.get("do") == "ask"))
print(build.screen_for(Ask(plan.trials[0].form, plan.trials[0]), "the page", 0))
"""
SESSION_OF_SETS = """
from pydantic import ValidationError
from palpate.studies.collecting import schema
from palpate.studies.console.words import about_trial
from palpate.studies.sessions.tables import answers_of

kinds = {"A": "x", "BBB": "x", "CC": "y", "D": "y"}
stimuli = [{"id": name, "columns": {"kind": kind}} for name, kind in kinds.items()]
order = {"design": "as_listed", "within": "block", "blocks": {"by": "kind"}, "repeats": 2}
plan = plan_of("largest", stimuli=stimuli, order=order, settings={"aloud": True})
print([about_trial(trial) for trial in plan.trials], plan.study.definition()["settings"])
assert plan.digest == compile_plan(Study.model_validate(plan.study.definition()), ParticipantRow("P001")).digest
events = session(plan)
tape = Recorded(events)
run(plan, tape, tape, {})
rows = answers_of(plan, "bumps/P001/1", events).own["largest_ones"]
print([(row["participant"], row["trial"], row["block"], row["stimulus"], row["counts"]) for row in rows])
assert set(rows[0]) == {column.name for column in schema.form_tables()["largest_ones"].columns}
for task, settings in (("largest", {"aloudly": True}), ("free_lexicon", {"aloud": True})):
    try:
        plan_of(task, settings=settings)
    except ValidationError as error:
        print(error.errors()[0]["loc"], error.errors()[0]["msg"])
"""


def ran(tmp_path, name, task, session):
    """What a session prints where there is one more module of tasks, and its screen."""
    shutil.copytree(
        ROOT / "protocols", tmp_path / "changed" / "protocols", ignore=shutil.ignore_patterns("__pycache__")
    )
    (tmp_path / "changed" / "protocols" / "tasks" / f"{name}.py").write_text(task, encoding="utf-8")
    (tmp_path / "screens").mkdir()
    (tmp_path / "screens" / f"{name}.py").write_text(SCREEN, encoding="utf-8")
    command = [sys.executable, "-c", COMMON + session, str(tmp_path / "changed"), str(tmp_path / "screens")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    return done.stdout.splitlines(), done.stderr


def test_a_task_with_a_form_of_its_own_is_two_files(tmp_path):
    lines, errors = ran(tmp_path, "counting", TASK, SESSION)
    assert lines == [
        "[('bumps', 1.0), ('bumps', 3.0)]", "counting bumps", "('counted on', 'counting', 'the page')",
    ], errors  # fmt: skip


def test_a_task_asks_about_a_whole_block_with_settings_and_a_table_of_its_own(tmp_path):
    lines, errors = ran(tmp_path, "largest", TASK_OF_SETS, SESSION_OF_SETS)
    assert lines == [
        "['CC and D', 'A and BBB', 'A and BBB', 'CC and D'] {'aloud': True}",
        "[('P001', 1, 'y', 'CC', True), ('P001', 2, 'x', 'BBB', True),"
        " ('P001', 3, 'x', 'BBB', True), ('P001', 4, 'y', 'CC', True)]",
        "('settings', 'aloudly') Extra inputs are not permitted",
        "('settings',) Value error, task free_lexicon has no settings; leave this key out",
    ], errors  # fmt: skip
