"""Virtual textures as a simulated study has them: rendered once by the models' files, compared, and felt."""

import json
import shutil
from dataclasses import dataclass
from statistics import mean

import pytest

from protocols.plan import compile_plan
from protocols.requests import Present
from studies import similarity_table
from studies.played_textures import read_felt
from studies.renderings import Renderings
from studies.rig import RigError, simulated
from studies.twins import twin_for
from tests.protocols.every_task import LAB
from tests.studies.small_textures import write, write_all
from tests.studies.ten import found_study, plan_for

FOLDER = similarity_table.FOLDER
STUDY = found_study("texture_similarity").study


def stimulus(name):
    return next(each for each in STUDY.stimuli if each.id == name)


CLOTH = stimulus("cloth_AR")


@dataclass
class Counted(Renderings):
    """Counts how often a model is opened."""

    opened: int = 0

    def _voice(self, card):
        self.opened += 1
        return super()._voice(card)


def counted(lab):
    return Counted(FOLDER, lab, shipped=False)


@pytest.fixture
def lab(tmp_path):
    write(tmp_path / "models", "cloth", "ar")
    return tmp_path


def test_a_model_is_rendered_once_for_all_participants_of_a_lab(lab):
    first, second = counted(lab), counted(lab)
    made = first.of(CLOTH).record()
    assert (first.of(CLOTH).record(), second.of(CLOTH).record()) == (made, made)
    assert (first.opened, second.opened) == (1, 0)
    write(lab / "models", "cloth", "dstn").rename(lab / "models" / "texture-cloth-ar.json")
    third = counted(lab)
    assert third.of(CLOTH).record()["compared"] != made["compared"] and third.opened == 1


def test_the_record_names_the_files_and_counts_deadlines(lab):
    made = counted(lab).of(CLOTH).record()
    card = json.loads((lab / "models" / "texture-cloth-ar.json").read_text())
    assert (made["model"], made["method"]) == ("texture-cloth-ar", "ar")
    assert made["weights_sha256"] == card["weights"]["sha256"] and len(made["sha256"]) == 64
    hand = read_felt(FOLDER / CLOTH.columns["file"])
    assert made["deadlines"] == {"steps": hand.shape[1], "late": 0, "underruns": 0, "clock": "virtual"}
    assert made["runtime"] and made["compared"]["friction"] == float(CLOTH.columns["friction"])


def test_models_and_hands_that_are_not_what_they_should_be_are_refused_before_anything_is_recorded(lab, tmp_path):
    with pytest.raises(RigError, match="cloth_AR.*no model by the method 'arr'"):
        counted(lab).check(CLOTH.model_copy(update={"columns": {**CLOTH.columns, "model": "arr"}}))
    with pytest.raises(RigError, match="no model of a texture 'clothes'"):
        counted(lab).check(CLOTH.model_copy(update={"columns": {**CLOTH.columns, "texture": "clothes"}}))
    with pytest.raises(RigError, match="needs the column 'model'"):
        counted(lab).check(CLOTH.model_copy(update={"columns": {"texture": "cloth"}}))
    folder = shutil.copytree(FOLDER, tmp_path / "copy")
    (folder / "felt" / "cloth.csv").write_text("t_s\n0\n")
    with pytest.raises(RigError, match="its SHA-256 differs"):
        Renderings(folder, lab, shipped=False).check(CLOTH)
    weights = lab / "models" / "texture-cloth-ar.safetensors"
    weights.write_bytes(weights.read_bytes()[:-1] + b"\0")
    with pytest.raises(RigError, match=r"texture-cloth-ar\.safetensors"):
        counted(lab).check(CLOTH)


def of_two(textures=("cloth",)):
    """The study with two methods of one texture."""
    some = tuple(each for each in STUDY.stimuli if each.columns["texture"] in textures)
    some = tuple(each for each in some if each.columns["method"] in ("AR", "FoTEN"))
    return STUDY.model_copy(update={"stimuli": some})


def rated(lab, study, people=12):
    """method -> its ratings, by people who feel the lab's models."""
    found = {}
    for number in range(1, people + 1):
        who = plan_for("texture_similarity", f"P{number:03d}").who
        plan = compile_plan(study, who, 1, LAB)
        rig = simulated(study, FOLDER, lab)
        rig.check(plan)
        world = rig.open(plan, 0).world
        for trial in plan.trials:
            answered = world.person.latent("Completely different", trial.stimulus)
            found.setdefault(trial.stimulus.columns["method"], []).append(answered)
    return found


def test_people_feel_what_the_models_play_not_what_the_table_says(tmp_path):
    write_all(tmp_path / "good", ("cloth",), ("ar", "foten_generative"))
    write_all(tmp_path / "odd", ("cloth",), ("foten_generative",))
    write(tmp_path / "odd" / "models", "steel_mesh", "ar").rename(tmp_path / "odd" / "models" / "texture-cloth-ar.json")
    good, odd = rated(tmp_path / "good", of_two(), 1), rated(tmp_path / "odd", of_two(), 1)
    assert good["FoTEN"] == odd["FoTEN"]
    assert mean(odd["AR"]) < mean(good["AR"]) - 10


def test_the_twin_s_reply_carries_the_rendering_and_takes_as_long_as_people_explore(lab):
    plan = compile_plan(of_two(), plan_for("texture_similarity").who, 1, LAB)
    twins = twin_for(plan.study, plan, FOLDER, lab=lab)
    trial = next(each for each in plan.trials if each.stimulus.id == "cloth_AR")
    done = twins(Present(trial), 0)
    assert done.seconds == STUDY.simulation.present_s
    assert done.reply.value["rendered"]["compared"] == dict(twins.feels(trial.stimulus))


def rows():
    return [{"id": each.id, **each.columns} for each in STUDY.stimuli]


def test_the_weights_are_points_for_each_dB_whatever_the_table_s_spread():
    declared = STUDY.simulation.latents["Completely different"]
    assert declared == pytest.approx(similarity_table.weights(rows()), abs=0.006)


def test_the_table_holds_what_is_kept_of_the_shipped_models():
    kept = json.loads((FOLDER / "rendered.json").read_text())
    compared = {(each["model"], *each["compared"].values()) for each in kept.values()}
    told = {
        (f"texture-{r['texture']}-{r['model']}", *(float(r[name]) for name in ("friction", "level_dB", "spectrum_dB")))
        for r in rows()
    }
    assert compared == told and len(told) == 24


def test_the_shipped_models_still_play_what_is_kept_of_them():
    """One of them, rendered anew: what another processor rounds otherwise is not felt."""
    fresh = Renderings(FOLDER, None, shipped=False).feels(CLOTH)
    assert fresh == pytest.approx({name: float(CLOTH.columns[name]) for name in fresh}, abs=0.3)
