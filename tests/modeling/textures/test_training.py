import math

import numpy as np
import pytest

from palpate.modeling.textures.foten import missed_aims
from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.textures.training import train_textures
from palpate.signals.models.file import read_model
from palpate.signals.textures.sounds import RenderError, Sounds
from palpate.signals.textures.voice import opened_voice, play
from tests.modeling.textures import small_evaluation as small
from tests.modeling.textures.recording_for_tests import recording
from tools.half_precision import halve

pytestmark = pytest.mark.needs("torch")


def trained(tmp_path, recordings=None, methods=("foten_generative",), **more):
    options = small.options(tmp_path / "work", methods, **more)
    return train_textures(
        recordings or small.recordings(4.0),
        small.ResonantSurfaces(),
        options,
        tmp_path / "models",
        methods=small.METHODS,
    )


def test_one_model_for_each_texture_with_what_was_found_in_its_card(tmp_path):
    written = trained(tmp_path)
    assert [model.card.name for model in written] == [
        f"texture-{name}-foten_generative.json" for name in ("smooth", "rough")
    ]
    for model in written:
        card = read_model(model.card).card
        assert card.metrics == model.metrics
        assert {"mae", "gfc", "free_level", "free_smoothed_gfc", "free_envelope", "free_felt_dB"} <= set(card.metrics)
        assert 0.5 < card.metrics["free_level"] < 1.5
        assert card.training["configuration"]["method"] == "foten_generative"
        assert card.training["configuration"]["parts"]["test"]
        assert card.texture.start is not None
        assert card.measured_on["one step ahead"].startswith("the test part")
        assert card.measured_on["free"].startswith("the hand of another exploration")
        assert model.cautions == card.missed == ()
        assert all(path.is_file() for path in model.files)


def test_what_is_written_plays_as_what_was_evaluated(tmp_path):
    written = trained(tmp_path, small.recordings(4.0, ("smooth",)))
    evaluation = next((tmp_path / "work" / "models").glob("*/*.json"))
    speed, force = np.full(500, 80.0), np.full(500, 1.0)
    np.testing.assert_array_equal(play(written[0].card, speed, force, 3), play(evaluation, speed, force, 3))


def test_the_same_command_resumes_and_writes_the_same_bytes(tmp_path):
    recordings = small.recordings(4.0, ("smooth",))
    before = [path.read_bytes() for path in trained(tmp_path, recordings)[0].files]
    assert [path.read_bytes() for path in trained(tmp_path, recordings)[0].files] == before


def test_a_short_recordings_card_says_that_its_free_run_was_no_held_out_one(tmp_path):
    (written,) = trained(tmp_path, (recording(1.9, 1, "smooth"),), explore=False)
    card = read_model(written.card).card
    assert "free_felt_dB" in card.metrics and "no held-out numbers" in card.measured_on["free"]
    assert any("no held-out numbers" in caution for caution in written.cautions)


@pytest.mark.parametrize(
    ("distance_dB", "gain", "words"),
    [
        (1.0, 1.1, []),
        (3.2, 1.0, ["3.20 dB"]),
        (1.0, float(np.exp(np.float32(np.log(1.25)))), ["stopped at its limit, 1.250"]),
        (math.nan, 0.8, ["could not be measured", "stopped at its limit, 0.800"]),
    ],
)
def test_a_match_that_stops_at_its_limit_or_stays_far_off_is_named(distance_dB, gain, words):
    missed = list(missed_aims(distance_dB, gain))
    assert len(missed) == len(words) and all(word in sentence for word, sentence in zip(words, missed, strict=True))


def test_a_model_that_missed_its_aim_is_marked_through_halving_and_played_on_request_only(tmp_path):
    written = trained(tmp_path, small.recordings(4.0, ("smooth",)), methods=("ten_wavelet",))
    for card in (written[0].card, halve(written[0].card, tmp_path / "halved")):
        assert read_model(card).card.missed == ("It stayed 9 dB off.",)
        with pytest.raises(RenderError, match=r"missed an aim.*9 dB off.*--accept-missed"):
            opened_voice(Sounds(card))
        assert opened_voice(Sounds(card, accept_missed=True)).card.missed
    assert written[0].cautions == ("It stayed 9 dB off.",)


def test_a_model_that_could_not_run_free_says_so(tmp_path):
    still = recording(6.0, 1, "still")
    still.signals[1] = 0.0
    (written,) = trained(tmp_path, (still,), explore=False)
    assert not any(name.startswith("free_") for name in written.metrics)
    assert any("not run free" in note and "mm/s" in note for note in read_model(written.card).card.notes)


def test_a_method_that_refuses_a_recording_writes_nothing(tmp_path):
    with pytest.raises(TextureDataError, match="had enough"):
        trained(tmp_path, small.recordings(4.0, ("smooth",)), methods=("foten", "ten"))
    assert not (tmp_path / "models").exists()
