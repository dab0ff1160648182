"""The networks as methods: they learn, they answer to the bit as before, and they say what they cannot do."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.modeling.attributes.material import MaterialError, ratings_of
from palpate.modeling.attributes.methods import Learning, predictions
from palpate.modeling.attributes.network_methods import (
    HT_NET,
    HV_NET,
    VISUO_TACTILE,
    VISUO_TACTILE_THESIS,
    restore_network,
)
from palpate.modeling.attributes.network_training import LITERAL_SETTINGS, SETTINGS
from palpate.modeling.attributes.registry import METHODS
from tests.modeling.attributes.material_for_tests import PAIRS, simulated_material

pytestmark = pytest.mark.needs("torch")

ALL = (VISUO_TACTILE, HV_NET, HT_NET)
SMALL = {"touch": ("dwt", "hand"), "sight": ("glcm",)}
"""Short rows: 256 numbers of a picture, seven channels of touch."""


def learning(textures, held=(), **settings):
    given = {"epochs": 1, "threads": 1, **settings}
    return Learning(tuple(textures), tuple(held), PAIRS, **SMALL, seed=3, settings=given)


@pytest.fixture(scope="module")
def textures():
    return simulated_material(textures=5, segments=4, pictures=3).textures


@pytest.fixture(scope="module", params=ALL, ids=lambda method: method.name)
def fitted(request, textures):
    return request.param, request.param.fit(learning(textures[:3]))


def test_the_registry_has_all_three_and_they_learn_from_every_texture():
    assert [METHODS[method.name] for method in ALL] == list(ALL)
    assert not any(method.holds({}) for method in ALL)
    assert all(method.holds({"early_stopping": True}) for method in ALL)
    assert [sorted(method.sees) for method in ALL] == [["sight", "touch"], ["sight"], ["touch"]]


def test_to_the_letter_it_watches_textures_keeps_its_rate_and_is_restored_to_the_bit(textures):
    assert VISUO_TACTILE_THESIS.holds({}) and METHODS["visuo_tactile_thesis"] is VISUO_TACTILE_THESIS
    assert (LITERAL_SETTINGS.epochs, LITERAL_SETTINGS.stop_patience, LITERAL_SETTINGS.learning_rate) == (200, 10, 1e-3)
    model = VISUO_TACTILE_THESIS.fit(learning(textures[:3], textures[3:4]))
    assert [epoch.learning_rate for epoch in model.trained.history] == [1e-3]
    again = restore_network(*model.saved())
    np.testing.assert_array_equal(again.predict(textures[4]), model.predict(textures[4]))


def test_there_is_an_answer_for_every_segment_or_picture(fitted, textures):
    method, model = fitted
    predicted = model.predict(textures[4])
    assert predicted.shape == (3 if method is HV_NET else 4, 4)
    assert predicted.dtype == np.float64
    assert np.isfinite(predicted).all()


def test_many_are_answered_as_one_is(fitted, textures):
    _, model = fitted
    shorter = replace(textures[3], touch={kind: rows[:1] for kind, rows in textures[3].touch.items()})
    one, other = model.predict_all([textures[4], shorter])
    np.testing.assert_allclose(one, model.predict(textures[4]), rtol=1e-4)
    np.testing.assert_allclose(other, model.predict(shorter), rtol=1e-4)


def test_one_texture_without_features_does_not_keep_the_others_from_a_prediction(fitted, textures, monkeypatch):
    _, model = fitted
    bare = replace(textures[3], touch={}, sight={})
    alone = model.predict(textures[4])
    monkeypatch.setattr(type(model), "predict", None)  # they are predicted together
    other, one = predictions(model, [bare, textures[4]])
    np.testing.assert_array_equal(one, alone)
    assert isinstance(other, MaterialError) and str(other).startswith(f"{bare.id}: ")
    assert predictions(model, []) == []


def test_the_shorter_of_pictures_and_segments_begins_anew(textures):
    """Segment i goes with picture i mod 3: the fourth segment with the first picture."""
    model = VISUO_TACTILE.fit(learning(textures[:3]))
    fourth = replace(
        textures[4],
        touch={kind: rows[3:] for kind, rows in textures[4].touch.items()},
        sight={kind: rows[:1] for kind, rows in textures[4].sight.items()},
    )
    np.testing.assert_allclose(model.predict(textures[4])[3:], model.predict(fourth), rtol=1e-4)


def test_the_same_seed_gives_the_same_bits(fitted, textures):
    method, model = fitted
    again = method.fit(learning(textures[2::-1]))  # nor does the order of the textures matter
    np.testing.assert_array_equal(again.predict(textures[4]), model.predict(textures[4]))
    other = method.fit(replace(learning(textures[:3]), seed=4))
    assert not np.array_equal(other.predict(textures[4]), model.predict(textures[4]))


def test_it_comes_back_from_its_numbers_to_the_bit(fitted, textures):
    from safetensors.numpy import load, save

    from palpate.protocols.canonical import canonical, parse

    _, model = fitted
    arrays, metadata = model.saved()
    again = restore_network(load(save(arrays)), parse(canonical(metadata)))
    np.testing.assert_array_equal(again.predict(textures[4]), model.predict(textures[4]))
    assert again.trained is None


def test_numbers_of_another_network_are_refused(fitted):
    arrays, metadata = fitted[1].saved()
    with pytest.raises(MaterialError, match="not the numbers of a visuo-tactile network"):
        restore_network({name: array for name, array in arrays.items() if name != "network.out.bias"}, metadata)
    with pytest.raises(MaterialError, match="not the numbers of a visuo-tactile network"):
        restore_network(arrays, {})
    with pytest.raises(MaterialError, match="neither sees nor feels"):
        restore_network(arrays, {**metadata, "looks": []})


def test_what_it_looks_at_must_be_there(textures):
    unseen, unfelt = replace(textures[4], sight={}, variants={}), replace(textures[4], touch={})
    data = learning(textures[:3])
    assert HT_NET.fit(data).predict(unseen).shape == (4, 4)
    assert HV_NET.fit(data).predict(unfelt).shape == (3, 4)
    for method, texture, kind in ((HV_NET, unseen, "glcm"), (HT_NET, unfelt, "dwt")):
        with pytest.raises(MaterialError, match=f"T05: no {kind} features"):
            method.fit(data).predict(texture)
        with pytest.raises(MaterialError, match=f"T05: no {kind} features"):
            method.fit(learning([*textures[:3], texture]))
        with pytest.raises(MaterialError, match=f"T05: no {kind} features"):
            VISUO_TACTILE.fit(learning([*textures[:3], texture]))


def test_features_of_another_length_are_refused(textures):
    model = HT_NET.fit(learning(textures[:3]))
    other = replace(textures[4], touch={"dwt": np.zeros((2, 20), "f4"), "hand": np.zeros((2, 6), "f4")})
    with pytest.raises(MaterialError, match="T05: 26 features of touch .*fitted to 30"):
        model.predict(other)


def test_constant_columns_are_harmless(textures):
    flat = [
        replace(texture, touch={kind: np.ones_like(rows) for kind, rows in texture.touch.items()})
        for texture in textures
    ]
    predicted = HT_NET.fit(learning(flat[:4])).predict(flat[4])
    assert np.isfinite(predicted).all()
    assert np.ptp(predicted, axis=0).max() < 1e-3  # equal segments have equal answers


def test_one_texture_is_nothing_to_learn_from(textures):
    with pytest.raises(MaterialError, match="at least 2"):
        HT_NET.fit(learning(textures[:1]))


def test_a_training_that_was_stopped_and_resumed_comes_to_the_same_end(textures, tmp_path):
    def stop(line):
        if "epoch 5 of 6" in line:
            raise KeyboardInterrupt

    data = learning(textures[:3], epochs=6)
    checkpointed = replace(data, settings={**data.settings, "checkpoint": tmp_path})
    with pytest.raises(KeyboardInterrupt):
        HV_NET.fit(replace(checkpointed, report=stop))
    with pytest.raises(KeyboardInterrupt):
        HV_NET.fit(replace(checkpointed, report=stop))
    whole, continued = HV_NET.fit(data), HV_NET.fit(checkpointed)
    np.testing.assert_array_equal(continued.predict(textures[4]), whole.predict(textures[4]))


def test_settings_reach_the_training(textures):
    assert (SETTINGS.stop_patience, SETTINGS.epochs <= 200) == (10, True)
    quick = {"quick": True, "threads": 1}
    assert len(HT_NET.fit(replace(learning(textures[:3]), settings=quick)).trained.history) == 2
    trained = HT_NET.fit(learning(textures[:3], textures[3:4], epochs=4, stop_patience=0, learning_rate=1e-3)).trained
    assert trained.history[0].learning_rate == 1e-3
    assert trained.history[0].held_loss is not None


def test_where_nothing_is_watched_the_course_goes_to_its_end(textures):
    """A step or two an epoch, with or without a picture made anew: the least loss would be chance."""
    trained = HV_NET.fit(learning(textures[:3], epochs=8, stop_patience=0)).trained
    losses = [epoch.train_loss for epoch in trained.history]
    assert (len(losses), trained.best_epoch, trained.stopped) == (8, 8, False)
    assert min(losses) < losses[-1]


def test_a_tiny_training_beats_the_mean_and_both_senses_beat_either_on_unseen_textures():
    """Sight knows bumps; touch roughness, friction and compliance (`simulated_material`); 32 columns are enough to see.

    What either sense knows alone stands in every column, so that a course of nine epochs tells them apart.
    """
    textures = [short(texture) for texture in simulated_material(34, segments=4, pictures=4, noise=0.2).textures]
    train, test = textures[:26], textures[26:]
    mean = np.abs(ratings_of(train).mean(axis=0) - ratings_of(test))
    off = {}
    for method, known in ((VISUO_TACTILE, [0, 1, 2, 3]), (HV_NET, [1]), (HT_NET, [0, 2, 3])):
        model = method.fit(learning(train, epochs=9, batch=4, learning_rate=1.5e-3))
        errors = np.abs(np.stack([model.predict(texture).mean(axis=0) for texture in test]) - ratings_of(test))
        assert errors[:, known].mean() < 0.75 * mean[:, known].mean()
        off[method.name] = errors.mean()
    assert off["visuo_tactile"] < 0.9 * min(off["hv_net"], off["ht_net"])


def short(texture):
    """With 32 of its 256 columns of sight."""
    cut = ({kind: rows[:, :32] for kind, rows in own.items()} for own in (texture.sight, texture.variants))
    return replace(texture, **dict(zip(("sight", "variants"), cut, strict=True)))
