"""Work done ahead by further processes gives what the work gives here; a process that dies is reported."""

import os

import pytest

from palpate.protocols.events import Sense
from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.sessions.rig import RigError
from palpate.studies.simulation.texture_set_rig import Ahead

STUDY = read_study(SHIPPED / "texture_photos" / "study.yaml").study
PLAN = compile_plan(STUDY, ParticipantRow("E001", "all"))


def describe(plan, request):
    return plan.digest, request.trial.stimulus.id, request.seconds, os.getpid()


def dies(_plan, _request):
    os._exit(3)


def refuses(_plan, request):
    raise RigError(f"{request.trial.stimulus.id}: refused")


def requests(count):
    return [Sense("camera", 900.0, trial) for trial in PLAN.trials[:count]]


def test_two_processes_give_what_one_gives_and_are_gone_afterwards():
    here, ahead = Ahead(describe, PLAN), Ahead(describe, PLAN, workers=2)
    alone = [here(request) for request in requests(4)]
    together = [ahead(request) for request in requests(4)]
    assert [reply[:3] for reply in together] == [reply[:3] for reply in alone]
    assert {reply[3] for reply in alone} == {os.getpid()} and os.getpid() not in {reply[3] for reply in together}
    assert sorted(ahead.coming) == [5, 6]
    ahead.close()
    assert not ahead.pools and not ahead.coming


def test_errors_of_the_work_are_raised_here_and_a_dead_process_is_reported():
    refusing, dying = Ahead(refuses, PLAN, workers=2), Ahead(dies, PLAN, workers=2)
    with pytest.raises(RigError, match="T01: refused"):
        refusing(requests(1)[0])
    with pytest.raises(RigError, match="T01: a process that computed it died"):
        dying(requests(1)[0])
    refusing.close()
    dying.close()
