"""Every baseline on textures that it has not seen: it learns what its senses tell, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.modeling.attributes import whole_textures
from palpate.modeling.attributes.material import MaterialError, Rated, ratings_of
from palpate.modeling.attributes.model_file import read_model, write_model
from palpate.modeling.attributes.registry import METHODS
from tests.modeling.attributes.learning_for_tests import answers, learning, unseen_textures
from tests.modeling.attributes.material_for_tests import simulated_material

pytestmark = pytest.mark.needs("torch")

NAMES = ["ann", "vision_cnn", "haptic_cnn", "tactile_cnn_lstm", "tactile_svm", "ridge", "boosting", "mean"]
LEARNING = [name for name in NAMES if name != "mean"]
NETWORKS = NAMES[:4]
TELLING = {"touch": [0, 2, 3], "sight": [1]}
"""The attributes that a sense tells: friction and compliance are felt only, bumps are seen only."""
FEW = {"epochs": 2}


@pytest.fixture
def few_trees(monkeypatch):
    """As few epochs are for networks; never beside `fitted`, which is shared."""
    monkeypatch.setattr(whole_textures, "TREES", 10)


@pytest.fixture(scope="module")
def fitted():
    by_name = {}

    def of(name):
        if name not in by_name:
            by_name[name] = METHODS[name].fit(learning(METHODS[name]))
        return by_name[name]

    return of


@pytest.mark.parametrize("name", NAMES)
def test_each_answers_with_finite_rows_of_four(name, fitted):
    for texture in unseen_textures():
        rows = fitted(name).predict(texture)
        assert rows.shape == (len(rows), 4)
        assert rows.dtype == np.float64
        assert np.isfinite(rows).all()


@pytest.mark.parametrize("name", LEARNING)
def test_each_beats_the_mean_where_its_senses_tell_and_only_there(name, fitted):
    rated = ratings_of(unseen_textures())
    own, floor = (np.abs(answers(fitted(method), unseen_textures()) - rated).mean(axis=0) for method in (name, "mean"))
    telling = sorted(place for sense in METHODS[name].sees for place in TELLING[sense])
    hidden = sorted({0, 1, 2, 3} - set(telling) - ({0} if "sight" in METHODS[name].sees else set()))
    assert (own[telling] < 0.7 * floor[telling]).all(), (own, floor)
    assert (own[hidden] > 0.75 * floor[hidden]).all(), (own, floor)


@pytest.mark.parametrize("name", NAMES)
def test_the_same_bits_again_whatever_order_the_textures_come_in(name, few_trees):
    given = learning(METHODS[name], settings=FEW)
    turned = replace(given, train=given.train[::-1])
    first, again = (METHODS[name].fit(data).predict(unseen_textures()[0]) for data in (given, turned))
    assert first.tobytes() == again.tobytes()


@pytest.mark.parametrize("name", ["ann", "boosting"])
def test_another_seed_is_another_fit(name, few_trees):
    given = learning(METHODS[name], settings=FEW)
    first, other = (METHODS[name].fit(replace(given, seed=seed)).predict(unseen_textures()[0]) for seed in (0, 1))
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("name", NAMES)
def test_a_file_gives_the_same_answers(name, fitted, tmp_path):
    card = {"name": "t", "title": "T", "method": name, "attributes": [(p.low, p.high) for p in learning().attributes]}
    path = write_model(tmp_path, fitted(name), card, METHODS)
    again = read_model(path, METHODS).fitted
    for texture in unseen_textures()[:2]:
        assert again.predict(texture).tobytes() == fitted(name).predict(texture).tobytes()


@pytest.mark.parametrize("name", LEARNING)
def test_a_texture_without_what_is_looked_at_is_refused_by_name(name, fitted):
    unseen = {sense: {} for sense in METHODS[name].sees}
    bare = replace(unseen_textures()[0], variants={}, **unseen)
    with pytest.raises(MaterialError, match=f"{bare.id}: no "):
        fitted(name).predict(bare)
    given = learning(METHODS[name], settings=FEW)
    with pytest.raises(MaterialError, match=f"{bare.id}: no "):
        METHODS[name].fit(replace(given, train=(*given.train, bare)))


@pytest.mark.parametrize("name", LEARNING)
def test_no_row_at_all_and_rows_of_another_width_are_refused(name, fitted):
    texture = unseen_textures()[0]
    for cut, message in (((slice(0, 0), slice(None)), "no|not one"), ((slice(None), slice(1, None)), "features")):
        sight, touch = ({kind: rows[cut] for kind, rows in own.items()} for own in (texture.sight, texture.touch))
        with pytest.raises(MaterialError, match=message):
            fitted(name).predict(replace(texture, touch=touch, sight=sight, variants={}))


@pytest.mark.parametrize("name", LEARNING)
def test_one_texture_is_too_few_and_two_with_one_row_each_are_enough(name):
    two = simulated_material(textures=2, segments=1, pictures=1).textures
    with pytest.raises(MaterialError, match="1 texture to learn from; at least 2"):
        METHODS[name].fit(learning(textures=two[:1], settings=FEW))
    rows = METHODS[name].fit(learning(textures=two, settings=FEW)).predict(unseen_textures()[0])
    assert np.isfinite(rows).all()
    assert rows.shape[1] == 4


@pytest.mark.parametrize("name", LEARNING)
def test_a_column_that_was_constant_has_no_say_later(name, few_trees):
    def spoiled(texture, value):
        touch, sight = ({k: r.copy() for k, r in own.items()} for own in (texture.touch, texture.sight))
        touch["mfcc"][:, 7] = value
        sight["glcm"][:, 7] = value
        variants = {k: r.copy() for k, r in texture.variants.items()}
        variants["glcm"][:, 7] = value
        return replace(texture, touch=touch, sight=sight, variants=variants)

    given = learning(METHODS[name], settings=FEW)
    given = replace(given, train=tuple(spoiled(texture, 0.1) for texture in given.train))
    model = METHODS[name].fit(replace(given, held=tuple(spoiled(texture, 0.1) for texture in given.held)))
    calm, wild = (model.predict(spoiled(unseen_textures()[0], value)) for value in (0.1, 1e6))
    assert calm == pytest.approx(wild, abs=1e-3)


@pytest.mark.parametrize("name", LEARNING)
def test_textures_that_are_all_the_same_are_answered_with_their_rating(name):
    one = simulated_material(textures=1, segments=3, pictures=2).textures[0]
    same = [replace(one, id=f"S{place}", made_from=frozenset({str(place)})) for place in range(4)]
    result = answers(METHODS[name].fit(learning(textures=same, settings=FEW)), [one])
    assert result[0] == pytest.approx(one.rated.mean, abs=5.0)


@pytest.mark.parametrize("name", NAMES)
def test_a_rating_that_is_missing_or_not_finite_is_refused(name):
    given = learning(METHODS[name])
    for rated, message in ((None, "was not rated"), (Rated(np.full(4, np.nan), np.zeros(4), 3), "finite")):
        bad = replace(given.train[3], rated=rated)
        with pytest.raises(MaterialError, match=message):
            METHODS[name].fit(replace(given, train=(*given.train[:3], bad)))


def test_the_mean_is_the_mean():
    given = learning()
    assert answers(METHODS["mean"].fit(given), unseen_textures()) == pytest.approx(
        np.tile(ratings_of(given.train).mean(axis=0), (12, 1))
    )
