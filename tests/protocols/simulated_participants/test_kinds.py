"""A kind of simulated participants is one module, found by its name; and goes through sessions."""

import sys

import pytest

from palpate.protocols import simulated_participants
from palpate.protocols.events import Present, Reply
from palpate.protocols.registry import Registry
from palpate.protocols.runner import Recorded, run
from palpate.protocols.simulated_participants import KINDS, SHIPPED_KIND, simulated_participant
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.simulated_world import Done, Simulated, VirtualClock
from palpate.studies.procedures.advised import advised
from tests.protocols.every_task import plan_of
from tests.protocols.worlds_for_tests import MemoryLog

CONSTANT = '''
"""People who answer the middle of every slider after a second."""

from dataclasses import dataclass

from palpate.protocols.events import Reply
from palpate.protocols.simulated_participants import ParticipantKind


@dataclass
class Constant:
    reading_s: float = 1.0

    def answer(self, ask):
        answers = dict.fromkeys(ask.form.items(), 50.0)
        return Reply({"answers": answers, "at_s": dict.fromkeys(answers, 1.0), "seconds": 1.0}), 1.0

    def leave_sliders(self, request):
        return request.wish

    def rest_s(self, rest):
        return 1.0


KIND = ParticipantKind(lambda plan, feels: Constant())
'''


def session(plan, kind):
    log, person = MemoryLog(), simulated_participant(plan, kind=kind)
    world = Simulated(person, lambda request, t_ns: Done(Reply({}), 1.0), VirtualClock())
    run(plan, advised(plan, world), log, {})
    return log.events


@pytest.mark.parametrize("task", ["authoring", "capture"])
@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_kind_goes_through_a_session_of_tasks_with_devices(kind, task):
    """The other tasks: `tests/studies/extensions/test_contracts.py`."""
    plan = plan_of(task)
    record = Recorded(session(plan, kind))
    run(plan, record, record, {})
    record.demand_end()


def test_the_shipped_kind_perceives_and_moves_sliders_only_where_they_are_felt():
    plan = plan_of("authoring")
    person = simulated_participant(plan)
    assert KINDS.keys() >= {SHIPPED_KIND} and person == Perceiver(plan)
    with pytest.raises(ValueError, match="no sliders are moved"):
        person.leave_sliders(Present(plan.trials[0]))


def test_a_further_kind_is_one_module(tmp_path, monkeypatch):
    (tmp_path / "constant.py").write_text(CONSTANT, encoding="utf-8")
    monkeypatch.setattr(simulated_participants, "__path__", [*simulated_participants.__path__, str(tmp_path)])
    monkeypatch.setattr(simulated_participants, "KINDS", Registry(folder=KINDS.folder))
    try:
        plan = plan_of("matching", opening=[], closing=[], questionnaire=None)
        answers = [event.value["answers"] for event in session(plan, "constant") if "answers" in event.value]
    finally:
        sys.modules.pop("palpate.protocols.simulated_participants.constant", None)
    assert len(answers) >= len(plan.trials) and {value for given in answers for value in given.values()} == {50.0}
