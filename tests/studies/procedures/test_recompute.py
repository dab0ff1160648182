from dataclasses import replace

from palpate.studies.procedures.questplus import QuestPlusAdviser
from palpate.studies.procedures.recompute import recompute
from palpate.studies.sessions.record import read
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated
from tests.studies.procedures.tracks_for_tests import QUESTPLUS, plan, study

SHORT = {**QUESTPLUS, "stop": {"trials": 6}}


def recorded(folder):
    declared = study(SHORT)
    return start(folder, plan(SHORT), simulated(declared, folder)).path


def test_choices_made_again_are_those_on_record_and_others_are_named_with_their_loss(tmp_path, monkeypatch):
    assert recompute(read(recorded(tmp_path / "same"))) == (14, [])
    advise = QuestPlusAdviser.advise

    def worse(self, past):
        step = advise(self, past)
        return replace(step, index=0) if len(past) == 3 else step

    with monkeypatch.context() as other_version:
        other_version.setattr(QuestPlusAdviser, "advise", worse)
        path = recorded(tmp_path / "worse")
    count, differences = recompute(read(path))
    assert count == 14 and sorted(difference.track for difference in differences) == ["f250", "f40"]
    assert all(difference.recorded == -40.0 != difference.now for difference in differences)
    assert all(difference.loss_nats > 0.01 for difference in differences)


def test_the_command_says_how_many_choices_were_made_again(tmp_path, run_palpate):
    output = run_palpate("replay", str(recorded(tmp_path)), "--recompute")
    assert "14 choices of procedures made again, all as recorded" in output
