"""A task with a form of its own is a module of `protocols/tasks/` and a screen: nothing else names it."""

import shutil
import subprocess
import sys

from tests.names import ROOT

TASK = '''
"""Count what was felt: a task with a form of its own."""

from dataclasses import dataclass

from palpate.protocols.forms import FormKind
from palpate.protocols.requests import Reply
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
SCREEN = """
def SCREEN(ask, form, page):
    return ("counted on", form.name, page)
"""
SESSION = """
import sys
from pathlib import Path

import palpate

changed, screens = sys.argv[1:]
palpate.__path__.insert(0, changed)
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.requests import Ask, Reply
from palpate.protocols.runner import run
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.protocols.worlds import Done, Recorded, Simulated, VirtualClock


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


def test_a_task_with_a_form_of_its_own_is_two_files(tmp_path):
    shutil.copytree(
        ROOT / "protocols", tmp_path / "changed" / "protocols", ignore=shutil.ignore_patterns("__pycache__")
    )
    (tmp_path / "changed" / "protocols" / "tasks" / "counting.py").write_text(TASK, encoding="utf-8")
    (tmp_path / "screens").mkdir()
    (tmp_path / "screens" / "counting.py").write_text(SCREEN, encoding="utf-8")
    command = [sys.executable, "-c", SESSION, str(tmp_path / "changed"), str(tmp_path / "screens")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.stdout.splitlines() == [
        "[('bumps', 1.0), ('bumps', 3.0)]", "counting bumps", "('counted on', 'counting', 'the page')",
    ], done.stderr  # fmt: skip
