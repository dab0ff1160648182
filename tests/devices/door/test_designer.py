"""Wishes at the rig: a door that plays, what it should feel like, and what cannot be had."""

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest

from palpate.devices.door.designer import Designer, designer_for, smoothed
from palpate.modeling.files.model_files import Exported, write_model
from palpate.signals.doors.grid import DoorDataError
from palpate.signals.doors.limits import LIMIT_N, STEEPEST_N_DEG
from palpate.signals.models.card import Affine, Clip, Dense, Playable, Port
from palpate.signals.models.errors import ModelFileError
from palpate.signals.models.file import read_model

NAMES, ANTONYMS = ("Light", "Soft"), ("Heavy", "Hard")
ANGLE = np.arange(621) / 10


def ratings(names=NAMES, scale=(-8.0, 8.0)):
    return Port(kind="ratings", size=len(names), unit="0..100", names=names, antonyms=ANTONYMS, scale=scale)


def force_port():
    return Port(kind="force_profile", size=621, unit="N")


def write_force(folder, name="door-force", gain=0.3, port=None, bend=0.0):
    """A door whose force is `gain` x Light everywhere, and `bend` x Soft at every other point."""
    weight = np.zeros((621, 2))
    weight[:, 0] = gain
    weight[::2, 1] = bend
    steps = (Clip(low=0, high=100), Dense(weight="w", bias="b"), Playable(force_N=LIMIT_N, slope_N_deg=STEEPEST_N_DEG))
    exported = Exported(steps, {"w": weight, "b": np.zeros(621)})
    return write_model(folder, name, exported, title="F", method="tried", takes=port or ratings(), gives=force_port())


def write_perception(folder, name="door-perception", port=None, gain=1 / 0.3):
    """Light is the force in the middle times `gain`, Soft 40 less a tenth of the force at the end."""
    weight = np.zeros((2, 621))
    weight[0, 310], weight[1, 620] = gain, -0.1
    exported = Exported((Affine(), Dense(weight="w", bias="b")), {"w": weight, "b": np.array([0.0, 40.0])})
    return write_model(folder, name, exported, title="P", method="tried", takes=force_port(), gives=port or ratings())


@pytest.fixture
def lab(tmp_path):
    write_force(tmp_path / "models")
    write_perception(tmp_path / "models")
    return tmp_path


@pytest.fixture
def designer(lab):
    return designer_for(lab)


def test_a_wish_that_can_be_had(designer):
    design = designer.design({"Soft": 45, "Light": 60})
    assert design.force_N == pytest.approx(np.full(621, 18.0))
    assert design.predicted == pytest.approx([60, 38.2]) and design.off == pytest.approx([0, -6.8])
    assert design.attainable and design.words == ""
    assert np.array_equal(designer.design([60, 45]).force_N, design.force_N)


def test_a_wish_that_cannot_names_the_nearest_possible(designer):
    design = designer.design([60, 95])
    assert not design.attainable and np.array_equal(design.force_N, designer.design([60, 45]).force_N)
    assert design.words == "These wishes cannot be met together. The nearest door found: Soft 38 (wished 95)."


def test_within_ten_a_wish_counts_as_had_and_a_stricter_designer_says_otherwise(designer):
    assert designer.design([60, 48.2]).attainable and not designer.design([60, 48.3]).attainable
    assert not Designer(designer.force, designer.perception, tolerance=3).design([60, 45]).attainable


def test_ratings_are_shown_within_the_scale_and_are_those_of_the_shown_profile(tmp_path):
    folder = tmp_path / "models"
    write_force(folder, gain=1.0)
    write_perception(folder, gain=4.0)
    design = designer_for(tmp_path).design([90, 40])
    assert design.force_N.max() == 60 and design.predicted.tolist() == [100, 34]


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        ([50, 101], "the wish for Soft is 101.0: from 0 to 100"),
        ([-0.1, 50], "the wish for Light is -0.1"),
        ([np.nan, 50], "the wish for Light is nan"),
        ([50], r"2 wishes are expected, found an array of shape \(1,\)"),
        ("soft", "wishes are numbers"),
        ({"Light": 50}, "no wish for Soft"),
        ({"Light": 50, "Soft": 5, "Sofd": 5}, "there is no attribute 'Sofd'; did you mean 'Soft'"),
        ({"Light": "much", "Soft": 5}, "wishes are numbers"),
    ],
)
def test_a_wish_that_is_none_is_refused(designer, wish, words):
    with pytest.raises(DoorDataError, match=words):
        designer.design(wish)


def test_smoothing_takes_ripples_away_and_keeps_ends_lines_and_limits(tmp_path):
    write_force(tmp_path / "models", bend=0.05)
    write_perception(tmp_path / "models")
    designer = designer_for(tmp_path)
    rough, smooth = (designer.design([50, 80], deg).force_N for deg in (0, 0.5))
    assert np.ptp(np.diff(rough)) == pytest.approx(8) and np.ptp(smooth[50:-50]) < 0.01
    assert smooth[[0, -1]] == pytest.approx(rough[[0, -1]])
    assert smoothed(3 - 0.7 * ANGLE, 4.0) == pytest.approx(3 - 0.7 * ANGLE)
    for wrong in (-1, 10.1, float("nan")):
        with pytest.raises(DoorDataError, match="smoothing over"):
            designer.design([50, 50], wrong)


def test_a_gaussian_takes_from_a_wave_what_theory_says():
    """A sine of period T keeps exp(-2 (pi sd / T)^2) of its height."""
    wave = np.sin(2 * np.pi * ANGLE / 10)
    passed = smoothed(wave, 2.0)[250:370]
    assert passed == pytest.approx(wave[250:370] * np.exp(-2 * (np.pi * 2 / 10) ** 2), abs=1e-4)


def test_the_record_names_both_models(lab, designer):
    cards = {what: read_model(lab / "models" / f"door-{what}.json").card for what in ("force", "perception")}
    assert designer.identity == {
        "force_model": "door-force", "force_sha256": cards["force"].weights.sha256,
        "perception_model": "door-perception", "perception_sha256": cards["perception"].weights.sha256,
    }  # fmt: skip
    assert designer.attributes == NAMES and designer.antonyms == ANTONYMS
    json.dumps(dict(designer.identity))


def test_another_force_model_is_taken_by_name_or_card(lab, tmp_path):
    write_force(lab / "models", "strong", gain=0.5)
    assert designer_for(lab, "strong").identity["force_model"] == "strong"
    elsewhere = tmp_path / "elsewhere"
    shutil.copytree(lab / "models", elsewhere)
    assert designer_for(None, str(elsewhere / "strong.json")).design([50, 40]).force_N[0] == 25
    with pytest.raises(ModelFileError, match="did you mean 'strong'"):
        designer_for(lab, "stron")
    with pytest.raises(ModelFileError, match=r"mine\.json"):
        designer_for(lab, str(tmp_path / "mine.json"))


def test_models_that_do_not_belong_together_are_refused(lab):
    folder = lab / "models"
    force, perception = folder / "door-force.json", folder / "door-perception.json"
    with pytest.raises(ModelFileError, match="takes force_profile and gives ratings; a force model takes ratings"):
        Designer(read_model(perception), read_model(perception))
    write_perception(folder, port=ratings(("Soft", "Light")))
    with pytest.raises(ModelFileError, match="the same attributes in one order are expected"):
        designer_for(lab)
    write_perception(folder, port=ratings(scale=(-5.0, 8.0)))
    with pytest.raises(ModelFileError, match="one scale is expected"):
        designer_for(lab)
    perception.unlink()
    with pytest.raises(ModelFileError, match="door-perception.json: missing"):
        designer_for(lab)
    force.write_text("{}")
    with pytest.raises(ModelFileError):
        designer_for(lab, "door-force")


def test_a_rig_needs_neither_torch_nor_modeling():
    program = "import sys, palpate.devices.door.designer; print([m for m in sys.modules if m.split('.')[0] in %r])"
    names = ("torch", "sklearn", "joblib", "scipy", "pandas", "modeling")
    ran = subprocess.run(
        [sys.executable, "-c", program % (names,)], capture_output=True, text=True, timeout=60, check=True
    )
    assert ran.stdout.strip() == "[]"
