from dataclasses import dataclass, field, replace
from itertools import count

import pytest

from devices.window.bench_stage import Setting
from protocols.forms import LabForms, Likert, Sliders
from protocols.plan import compile_plan
from protocols.requests import Ask, Confirm, Present, Reply, Sense
from protocols.runner import run
from studies.allocation import allocate
from studies.catalogue import SHIPPED, read_study
from tests.devices.window.real.conftest import CALIBRATION, theatre_of
from tests.devices.window.real.forms import QUESTIONS, keys_for

STUDIES = sorted(path.parent.name for path in SHIPPED.glob("*/study.yaml"))
FORMS_OF_THE_LAB = LabForms("**Taking part is voluntary.** You can stop at any time.", QUESTIONS)
PAGES = {Present: "feel_now", Sense: "recording"}


@dataclass
class AtTheWindow:
    """A world and its log: a hand answers everything with the keyboard, in the real window."""

    theatre: object
    clock: count = field(default_factory=count)
    kinds: list = field(default_factory=list)
    answers: list = field(default_factory=list)
    wrong: list = field(default_factory=list)

    def now(self):
        return next(self.clock)

    def append(self, event):
        self.kinds.append(event.kind)

    def perform(self, request):
        if type(request) in PAGES:
            return self._wait(PAGES[type(request)])
        self.theatre.stage.put_on(request)
        self._look()
        if isinstance(request, Confirm):
            self.theatre.stage.tell("give", 127.0)
        else:
            self.theatre.keys(*self._keys(request))
        reply = self.theatre.stage.result()
        self.answers.append(reply.value.get("answers"))
        return reply

    def _wait(self, page):
        self.theatre.stage.tell("wait for", page)
        self.theatre.stage.hear("shown")
        self._look()
        self.theatre.stage.tell("ready")
        assert self.theatre.stage.result() is None
        return Reply({"presented": True})

    def _look(self):
        shown, painted, wrong = self.theatre.picture()
        self.wrong += wrong if shown.tobytes() == painted.tobytes() else [*wrong, "not shown as painted"]

    def _keys(self, request):
        if not isinstance(request, Ask):
            return keys_for(request.body()["do"] if request.body()["do"] == "rest" else "instructions")
        form = request.form
        if isinstance(form, Sliders) and form.tries and request.former is not None:
            return [("enter",)]
        if isinstance(form, Sliders):
            return keys_for(form.name, len(form.attributes))
        return [*keys_for(form.name), ("enter",)] if isinstance(form, Likert) else keys_for(form.name)


def test_all_studies_are_there():
    assert len(STUDIES) == 10


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_is_met_from_its_consent_to_its_end_with_its_first_and_its_last_trial(name):
    found = read_study(SHIPPED / name / "study.yaml")
    whole = compile_plan(found.study, allocate(found.study, "P001"), 1, FORMS_OF_THE_LAB)
    plan = replace(whole, trials=(whole.trials[0], whole.trials[-1]) if len(whole.trials) > 1 else whole.trials)
    setting = Setting(found.study, CALIBRATION, folder=found.folder, fullscreen=True, plan=plan)
    with theatre_of(setting) as theatre:
        world = AtTheWindow(theatre)
        run(plan, world, world, {"calibration": CALIBRATION.definition()})

    assert world.wrong == []
    assert world.kinds[-1] == "session_ended"
    assert world.kinds.count("trial_started") == len(plan.trials)
    asked = len(plan.opening) + len(plan.closing) + sum(trial.form is not None for trial in plan.trials)
    assert len([each for each in world.answers if each is not None]) >= asked
