import numpy as np
import pytest

from devices.models.file import read_model
from devices.render.voice import play
from modeling.textures.recording import TextureDataError
from modeling.textures.training import train_textures
from tests.modeling.textures import judged_small as small
from tests.modeling.textures.made_up_recording import recording


def trained(tmp_path, found=None, methods=("foten_generative",), **more):
    asked = small.wanted(tmp_path / "work", methods, **more)
    return train_textures(
        found or small.recordings(4.0), small.SmallSide(), asked, tmp_path / "models", methods=small.METHODS
    )


def test_one_model_for_each_texture_with_what_was_found_in_its_card(tmp_path):
    written = trained(tmp_path)
    assert [each.card.name for each in written] == [
        f"texture-{name}-foten_generative.json" for name in ("smooth", "rough")
    ]
    for each in written:
        card = read_model(each.card).card
        assert card.metrics == each.metrics
        assert {"mae", "gfc", "free_level", "free_smoothed_gfc", "free_envelope", "free_felt_dB"} <= set(card.metrics)
        assert 0.5 < card.metrics["free_level"] < 1.5
        assert card.training["configuration"]["method"] == "foten_generative"
        assert card.training["configuration"]["parts"]["test"]
        assert card.texture.start is not None
        assert any("test part" in note for note in card.notes)
        assert all(path.is_file() for path in each.files)


def test_what_is_written_plays_as_what_was_judged(tmp_path):
    written = trained(tmp_path, small.recordings(4.0, ("smooth",)))
    judged = next((tmp_path / "work" / "models").glob("*/*.json"))
    speed, force = np.full(500, 80.0), np.full(500, 1.0)
    np.testing.assert_array_equal(play(written[0].card, speed, force, 3), play(judged, speed, force, 3))


def test_the_same_command_goes_on_and_writes_the_same_bytes(tmp_path):
    found = small.recordings(4.0, ("smooth",))
    before = [path.read_bytes() for path in trained(tmp_path, found)[0].files]
    assert [path.read_bytes() for path in trained(tmp_path, found)[0].files] == before


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
