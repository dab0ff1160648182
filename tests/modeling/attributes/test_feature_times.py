"""Seconds of features count from what sensors and camera gave, each step once."""

import pytest

from palpate.modeling.attributes import feature_times
from palpate.modeling.attributes.feature_times import feature_seconds, steps_of
from palpate.modeling.textures import preparing


def test_preparation_for_a_sense_is_done_once_and_only_where_it_is_used():
    assert steps_of(("mfcc", "hand", "resnet", "glcm")) == ("recording", "picture", "mfcc", "hand", "resnet", "glcm")
    assert steps_of(("dwt",)) == ("recording", "dwt")
    assert steps_of(("glcm",)) == ("picture", "glcm")
    assert steps_of(()) == ()


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(feature_times, "SECONDS", 8.0)


@pytest.mark.needs("librosa", "pywt")
def test_the_recording_is_prepared_and_the_picture_decoded_while_the_clock_runs(short, monkeypatch):
    """A clock that counts what was done: filtering a recording, decoding a picture."""
    from palpate.analysis.features import pictures

    done = {"filtered": 0, "decoded": 0}

    def counted(module, name, what):
        whole = getattr(module, name)

        def call(*given):
            done[what] += 1
            return whole(*given)

        monkeypatch.setattr(module, name, call)

    counted(preparing, "band_pass", "filtered")
    counted(pictures, "_cut", "decoded")
    seconds = feature_seconds({"mfcc", "hand", "glcm"}, clock=lambda: 1000.0 * done["filtered"] + done["decoded"])
    assert seconds == {"recording": pytest.approx(1000, abs=1000), "mfcc": 0, "hand": 0, "picture": 10, "glcm": 0}
    assert seconds["recording"] >= 1000


@pytest.mark.needs("librosa", "pywt")
def test_only_what_was_requested_is_timed(short):
    seconds = feature_seconds({"dft"})
    assert set(seconds) == {"recording", "dft"}
    assert seconds["recording"] > 5 * seconds["dft"] > 0
