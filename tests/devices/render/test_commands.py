import json

import numpy as np
import pytest
from click.testing import CliRunner

from palpate.devices.render.commands import render
from palpate.signals.textures.voice import play
from tests.devices.render.made import model, write


def run(*words):
    return CliRunner().invoke(render, [str(word) for word in words])


@pytest.fixture
def lab(tmp_path):
    write(tmp_path / "models", model(name="texture-cloth-ar"))
    return tmp_path


def test_a_recorded_hand_is_played_and_written(lab):
    hand = lab / "hand.csv"
    hand.write_text("t_s,speed_mm_s,force_N\n0,100,1\n1,100,1\n")
    done = run("cloth", "--method", "ar", "--lab", lab, "--hand", hand, "--seed", 3, "--out", lab / "felt.csv")
    assert done.exit_code == 0, done.output
    assert "1.001 s at 1 kHz by " in done.output
    felt = np.genfromtxt(lab / "felt.csv", delimiter=",", names=True)
    want = play(model(), np.full(1001, 100.0), np.ones(1001), 3)
    np.testing.assert_allclose(felt["acceleration_m_s2"], want, rtol=1e-8)
    np.testing.assert_allclose(felt["t_s"], np.arange(1001) / 1000)


def test_a_simulated_hand_gives_json_and_arrays(lab):
    words = ("cloth", "--method", "ar", "--lab", lab, "--hand", "simulated", "--seconds", 2)
    done = run(*words, "--json", "--out", lab / "felt.npz")
    report = json.loads(done.output)
    assert report["seconds"] == 2.0
    assert report["voice"]["model"] == "texture-cloth-ar"
    assert report["took"]["steps"] == 2000
    arrays = np.load(lab / "felt.npz")
    assert arrays["acceleration_m_s2"].shape == (2000,)
    assert report["level_m_s2"] > 0.5
    mean = json.loads(run(*words, "--json", "--mean").output)
    assert mean["level_m_s2"] < 0.1


def test_paced_playing_is_the_same_and_reports_deadlines(lab):
    words = ("cloth", "--method", "ar", "--lab", lab, "--hand", "simulated", "--seconds", 1)
    done = run(*words, "--paced", "--out", lab / "paced.npz")
    assert done.exit_code == 0, done.output
    run(*words, "--out", lab / "once.npz")
    paced, once = np.load(lab / "paced.npz"), np.load(lab / "once.npz")
    count = len(paced["acceleration_m_s2"])
    assert count > 0
    np.testing.assert_array_equal(paced["acceleration_m_s2"], once["acceleration_m_s2"][:count])
    for words in ("priority ", "output buffer 10 ms", "underruns: ", "later than 1 ms", "not compensated"):
        assert words in done.output


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("clot", "--method", "ar", "--hand", "simulated"), "no model of a texture 'clot'; did you mean 'cloth'?"),
        (("cloth", "--method", "arr", "--hand", "simulated"), "no model by the method 'arr'; did you mean 'ar'?"),
        (("cloth", "--method", "ar", "--hand", "nowhere.csv"), "cannot be read as a hand's recording"),
        (("cloth", "--method", "ar", "--hand", "simulated", "--out", "felt.wav"), "written as .csv or .npz"),
        (("cloth", "--method", "ar", "--hand", "simulated", "--out", "no/felt.csv"), "there is no folder no"),
        (("cloth", "--method", "ar", "--out", "felt.csv"), "--out goes with --hand"),
        (("cloth", "--method", "ar", "--hand", "simulated", "--rig", "rig.yaml"), "give --paced too"),
        (
            ("cloth", "--method", "ar", "--hand", "simulated", "--real-time"),
            "--real-time is for what is played at 1 kHz",
        ),
        (("cloth", "--method", "ar", "--hand", "simulated", "--ahead", 5), "--ahead is for what is played at 1 kHz"),
        (("cloth", "--method", "ar", "--hand", "simulated", "--windowed", "640x480"), "--windowed is for the window"),
        (("cloth", "--method", "ar", "--twins", "--rig", "rig.yaml"), "leave one out"),
    ],
)
def test_mistakes_are_reported(lab, words, message):
    done = run(*words, "--lab", lab)
    assert done.exit_code != 0
    assert message in (done.output + str(done.exception))


def test_more_of_a_recording_than_there_is_cannot_be_played(lab):
    hand = lab / "hand.csv"
    hand.write_text("t_s,speed_mm_s,force_N\n0,100,1\n1,100,1\n")
    done = run("cloth", "--method", "ar", "--lab", lab, "--hand", hand, "--seconds", 5)
    assert "holds 1.001 s; 5 s of it cannot be played" in str(done.exception)
