"""The study of photos: it asks no questions, and the pictures of a simulated camera can be computed at any time."""

import io

import pytest
from PIL import Image

from palpate.protocols.events import Sense
from palpate.protocols.plan import compile_plan
from palpate.protocols.trial import ParticipantRow
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.console.headless import asks_anything
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.rig import RigError
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated
from palpate.studies.stimuli.scenes import pictures_of

STUDY_FILES = read_study(SHIPPED / "texture_photos" / "study.yaml")


def test_every_texture_gets_ten_pictures_and_nobody_is_asked(tmp_path):
    assert not asks_anything(STUDY_FILES.study)
    plan = compile_plan(STUDY_FILES.study, ParticipantRow("E001", "all"))
    result = start(tmp_path, plan, simulated(STUDY_FILES.study, STUDY_FILES.folder))
    replies = [event.value for event in read(result.path).events if event.kind == "reply" and "pictures" in event.value]
    assert result.complete and len(replies) == len(plan.trials) == 50
    assert [[photo["light"] for photo in reply["pictures"]] for reply in replies] == [list(range(1, 11))] * 50
    assert [reply["pictures"][0]["surface"] for reply in replies] == [trial.stimulus.id for trial in plan.trials]
    assert replay(result.path).complete


@pytest.mark.long
def test_a_picture_shows_the_trial_s_own_surface():
    plan = compile_plan(STUDY_FILES.study, ParticipantRow("E001", "all"))
    one, other = (next(pictures_of(Sense("camera", 60.0, plan.trials[n]))) for n in (26, 46))
    assert Image.open(io.BytesIO(one)).size == (1568, 1568) and one != other


def test_what_cannot_be_simulated_is_refused_before_anything_is_recorded(tmp_path):
    stimuli = [{"id": "mine", "columns": {"sim_softness": "very"}}]
    study = STUDY_FILES.study.model_validate(STUDY_FILES.study.definition() | {"stimuli": stimuli, "groups": {}})
    with pytest.raises(RigError, match="'very' in the column 'sim_softness'"):
        simulated(study, STUDY_FILES.folder).check(compile_plan(study, ParticipantRow("E001")))
