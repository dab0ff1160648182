"""`palpate models` and `palpate predict`: what a designer sees, and the messages of mistakes."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from palpate.devices.door.stimuli import profile_text
from palpate.devices.models import lookup
from palpate.devices.models.commands import models, predict
from palpate.signals.doors.limits import refusal
from palpate.signals.doors.profile_file import read_profile
from tests.devices.models.commands_for_tests import run, text
from tests.signals.models.cards import FORCE, RATINGS, edited, feeling, saved, shape

RAMP = np.linspace(0, 30, 621)


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """A lab with a model of a feeling and one of a profile, nothing shipped, and one profile in the current folder."""
    monkeypatch.setattr(lookup, "SHIPPED", tmp_path / "shipped")
    monkeypatch.setattr(lookup, "TEXTURES", tmp_path / "textures")
    monkeypatch.chdir(tmp_path)
    feeling(tmp_path / "models")
    shape(tmp_path / "models")
    Path("ramp.csv").write_text(profile_text(RAMP))
    return tmp_path


def test_the_list_names_what_there_is_and_what_is_broken(lab):
    feeling(lab / "shipped", "other")
    edited(feeling(lab / "models", "newer"), format="palpate-model/2")
    feeling(lab / "models", "cut").with_suffix(".safetensors").write_bytes(b"x")
    printed = text(run(models, "list"))
    assert "feeling lab by hand force profile -> ratings 2.50 " in printed
    assert "shape lab by hand ratings -> force profile 4.25 (loop_fresh) " in printed
    assert "other shipped by hand force profile -> ratings 2.50 - " in printed
    assert re.search(r"newer lab .* BROKEN: .* format 'palpate-model/2'", printed)
    assert re.search(r"cut lab .* BROKEN: .* 1 bytes found", printed)
    rows = json.loads(run(models, "list", "--json").stdout)
    assert [row["name"] for row in rows] == ["cut", "feeling", "newer", "shape", "other"]


def test_a_model_that_another_part_reads_is_listed_as_what_it_is(tmp_path):
    from palpate.modeling.attributes.model_file import FORMAT

    folder = tmp_path / "models"
    folder.mkdir()
    (folder / "texture-attributes.json").write_text(json.dumps({"format": FORMAT}))
    (folder / "odd.json").write_text(json.dumps({"format": ["palpate-attributes/1"]}))
    printed = text(run(models, "list", "--lab", tmp_path))
    assert re.search(r"texture-attributes lab .* read by `palpate textures index`", printed)
    assert re.search(r"odd lab .* BROKEN: ", printed)


def test_the_list_says_when_a_model_was_made_and_an_empty_lab_what_to_do(lab, tmp_path_factory):
    feeling(lab / "models", training={"made": "2031-02-03T04:05:06+00:00"})
    assert " 2031-02-03 " in text(run(models, "list"))
    empty = tmp_path_factory.mktemp("empty")
    assert "`palpate train` makes them" in run(models, "list", "--lab", empty).stdout


def test_a_card_is_described_in_words(lab):
    feeling(
        lab / "models",
        training={"data": {"lab.sqlite": "ab12"}, "seconds": 3.5, "of": list("abcdefghij")},
        notes=("simulated people",),
    )
    printed = text(run(models, "card", "feeling"))
    for words in (
        "feeling: A small model", "method by hand", "takes a force profile: 621 numbers, N",
        "Damped (0) to Recoiling (100)", "0 and 100 are -8 and 8 on the scale that people answered on",
        "90 % of new answers within +- 6, 8 split conformal", "metrics mae 2.5",
        "1. 2 features of the profile: max_force_N, mean_force_N 2. dense: 2 to 2", "numbers 6 in 2 arrays",
        "training data.lab.sqlite: ab12 seconds: 3.5 of: a, b, c, d, e, f, g, h, and 2 more (--json shows all)",
        "notes simulated people",
    ):  # fmt: skip
        assert words in printed
    assert json.loads(run(models, "card", "feeling", "--json").stdout)["metrics"] == {"mae": 2.5}


def test_two_models_are_compared_on_the_same_profiles(lab):
    feeling(lab / "models", "moved", offset=60.0, metrics={"mae": 3.0, "r2": 0.5})
    printed = text(run(models, "compare", "feeling", "moved", "--on", "ramp.csv"))
    assert "mae 2.5 3 " in printed
    assert "r2 - 0.5 " in printed
    assert "answers to the same 1 profiles are apart by (0..100): mean greatest at feeling moved 5 10 ramp" in printed
    assert "feeling - moved 0.00 10.00" in printed
    comparison = json.loads(run(models, "compare", "feeling", "moved", "--json").stdout)
    assert comparison["inputs"] == 90
    assert comparison["apart"][0]["by_name"]["Easy-to-pull"] == 0
    assert comparison["metrics"]["moved"]["ms"] > 0


def test_models_that_count_0_to_100_otherwise_are_compared_on_one_scale(lab):
    wide = {"scale": (-16.0, 16.0)}
    edited(feeling(lab / "models", "wide", offset=20.0), gives=RATINGS.model_copy(update=wide).model_dump(mode="json"))
    edited(shape(lab / "models", "wished"), takes=RATINGS.model_copy(update=wide).model_dump(mode="json"))
    comparison = json.loads(run(models, "compare", "feeling", "wide", "--on", "ramp.csv", "--json").stdout)
    assert comparison["apart"][0]["by_name"] == pytest.approx({"Easy-to-pull": 30 - 10, "Damped": 80 - 50})
    comparison = json.loads(run(models, "compare", "shape", "wished", "--json").stdout)
    assert comparison["apart"][0]["greatest"] == pytest.approx(0.62 * 20)


def test_models_of_a_profile_are_compared_on_the_same_wishes(lab):
    shape(lab / "models", "steeper", steep=0.2)
    comparison = json.loads(run(models, "compare", "shape", "steeper", "--json").stdout)
    assert (comparison["inputs"], comparison["apart"][0]["at"]) == (5, "Damped=90")
    assert comparison["apart"][0]["greatest"] == pytest.approx(0.1 / 100 * 620 * 90)


def test_how_a_profile_would_feel_is_predicted(lab):
    printed = text(run(predict, "feeling", "ramp.csv"))
    assert "90 % interval: split conformal" in printed
    assert "ramp.csv Easy-to-pull |------=O==---------------| Hard-to-pull 30.0 24.0 to 36.0 -3.20" in printed
    assert "Damped |-----------------==O==---| Recoiling 80.0 72.0 to 88.0 +4.80" in printed
    predictions = json.loads(run(predict, "feeling", "ramp.csv", "ramp.csv", "--json").stdout)
    assert (predictions["model"], predictions["coverage"], len(predictions["profiles"])) == ("feeling", 0.9, 2)
    first = predictions["profiles"][1]["ratings"][0]
    expected = {"predicted": 30, "low": 24, "high": 36, "on_scale": -3.2, "raw": 30}
    assert {name: first[name] for name in expected} == pytest.approx(expected)


def test_what_a_reader_must_know_stands_over_every_answer(lab):
    feeling(lab / "models", notes=("The ratings are those of simulated people.",))
    assert "The ratings are those of simulated people. ramp.csv" in text(run(predict, "feeling", "ramp.csv"))


def test_an_answer_beyond_the_scale_is_clipped_and_reported(lab):
    spike = RAMP.copy()
    spike[300] = 1e6
    Path("spike.csv").write_text(profile_text(spike))
    printed = text(run(predict, "feeling", "spike.csv"))
    assert "Hard-to-pull 100.0 94.0 to 100.0 +8.00" in printed
    assert "far beyond 0 to 100 before it was cut there: Easy-to-pull, Damped" in printed


def test_a_profile_beyond_what_the_model_answers_to_is_refused_by_name(lab):
    takes = FORCE.model_copy(update={"within": (-600.0, 600.0)})
    edited(lab / "models" / "feeling.json", takes=takes.model_dump(mode="json"))
    assert "it answers to numbers from -600 to 600; others are refused" in text(run(models, "card", "feeling"))
    Path("spike.csv").write_text(profile_text(np.where(np.arange(621) == 300, 1e6, RAMP)))
    with pytest.raises(ValueError, match=r"spike\.csv: feeling: row 1 holds 1e\+06 N at place 301"):
        run(predict, "feeling", "ramp.csv", "spike.csv")


def test_a_recording_is_normalised_with_the_option_recording(lab):
    rows = "\n".join(f"{angle},{angle / 2}" for angle in np.arange(3, 70, 0.037))
    Path("raw.csv").write_text(f"angle_deg,force_N\n{rows}\n")
    with pytest.raises(ValueError, match=r"line 2: angle 3 found, 0\.0 expected\. Or let .* --recording"):
        run(predict, "feeling", "raw.csv")
    predictions = json.loads(run(predict, "feeling", "--recording", "--zero", "raw.csv", "--json").stdout)
    assert predictions["profiles"][0]["ratings"][0]["predicted"] == pytest.approx(32.5, abs=0.05)


def test_a_wish_becomes_a_profile_that_the_door_accepts(lab):
    printed = run(predict, "shape", "--wish", "Easy-to-pull=20", "Damped=30")
    assert run(predict, "shape", "--wish", "Damped=30", "--wish", "Easy-to-pull=20", "--to", "a/made.csv").stdout == (
        "a/made.csv\n"
    )
    assert printed.stdout == Path("a/made.csv").read_text()
    force = np.array(read_profile("a/made.csv"))
    np.testing.assert_allclose(force, 1 + 4 + np.arange(621) * 0.03, atol=5e-5)
    assert refusal(force) is None
    assert printed.stderr == ""


def test_a_profile_that_the_door_would_refuse_is_reported(lab):
    shape(lab / "models", "wild", steep=9.0)
    result = run(predict, "wild", "--wish", "Damped=90")
    assert "the door would refuse to play it" in result.stderr
    predictions = json.loads(run(predict, "wild", "--wish", "Damped=90", "--json").stdout)
    assert "N m at" in predictions["door_refuses"]
    assert predictions["wish"] == {"Easy-to-pull": 50.0, "Damped": 90.0}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["feelng", "ramp.csv"], "no model 'feelng' .*; did you mean 'feeling'?"),
        (["feeling.pt", "ramp.csv"], "there is no such file|not opened"),
        (["models/feeling.safetensors", "ramp.csv"], "give its card, feeling.json"),
        (["shape", "--wish", "Dampd=3"], "no attribute 'Dampd'; did you mean 'Damped'?"),
        (["shape", "--wish", "Recoiling=3"], "Recoiling is the other end of Damped: 0 is Damped, 100 is Recoiling"),
        (["shape", "--wish", "Damped=101"], "a number from 0 .* to 100"),
        (["shape", "--wish", "Damped=nan"], "a number from 0 .* to 100"),
        (["shape", "--wish", "Damped"], "NAME=VALUE is expected, as Easy-to-pull=20"),
        (["shape", "Damped=1", "--wish", "Damped=2"], "Damped is wished twice"),
        (["feeling", "short.csv"], "620 points found, 621 expected"),
    ],
)
def test_a_mistake_names_what_to_do(lab, arguments, words):
    Path("short.csv").write_text("\n".join(profile_text(RAMP).splitlines()[:-1]) + "\n")
    with pytest.raises(ValueError, match=words):
        run(predict, *arguments)


@pytest.mark.parametrize(
    ("command", "arguments", "words"),
    [
        (predict, ["feeling"], "which profile? Give a profile FILE"),
        (predict, ["feeling", "none.csv"], "there is no profile file 'none.csv'"),
        (predict, ["feeling", "--wish", "Damped=1"], "feeling predicts how profiles feel: it takes FILEs"),
        (predict, ["feeling", "ramp.csv", "--zero"], "it goes with --recording"),
        (predict, ["shape"], "what is wished for? Give --wish NAME=VALUE; Easy-to-pull, Damped"),
        (predict, ["shape", "--recording", "ramp.csv"], "shape makes profiles"),
        (models, ["compare", "feeling"], "two models or more are compared"),
        (models, ["compare", "shape", "shape", "--on", "ramp.csv"], "--on is for models that tell how profiles feel"),
    ],
)
def test_a_command_used_wrongly_says_how_to_use_it(lab, command, arguments, words):
    result = run(command, *arguments)
    assert result.exit_code == 2
    assert words in re.sub(r"\s+", " ", result.stderr)


def test_models_that_answer_other_questions_are_not_compared(lab):
    with pytest.raises(ValueError, match="models that answer the same question are compared"):
        run(models, "compare", "feeling", "shape")
    saved(lab / "models", (), {}, FORCE, FORCE, "same")
    with pytest.raises(ValueError, match="feeling gives 2 numbers of ratings .* same 621 numbers of force_profile"):
        run(models, "compare", "feeling", "same")


def test_a_labs_model_comes_before_a_shipped_one_of_its_name(lab):
    feeling(lab / "shipped", offset=0.0)
    assert lookup.find_model("feeling", lab) == lab / "models" / "feeling.json"
    assert lookup.find_model("feeling", lab / "nowhere") == lab / "shipped" / "feeling.json"
    assert lookup.find_model("models/feeling.json", lab) == Path("models/feeling.json")


def test_a_prediction_needs_neither_torch_nor_pandas_nor_scipy(lab):
    code = (
        "import sys; from palpate.devices.models.commands import predict; "
        "before = 'numpy' in sys.modules; "
        "predict(['feeling', 'ramp.csv'], standalone_mode=False); "
        "heavy = {'torch', 'pandas', 'scipy', 'sklearn', 'joblib', 'matplotlib', 'psychopy'} & set(sys.modules); "
        "sys.exit(f'{before} {heavy}' if before or heavy else 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=lab, env={"PYTHONPATH": str(Path(__file__).parents[3])},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert "Hard-to-pull" in done.stdout


def test_every_command_has_help_with_an_example():
    for name in ("card", "compare"):
        assert f"palpate models {name}" in run(models, name, "--help").output
    assert "palpate predict door-force --wish" in run(predict, "--help").output
