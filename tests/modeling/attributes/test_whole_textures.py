"""Ridge regression on whole textures, against scikit-learn's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sklearn.ensemble import GradientBoostingRegressor
from sklearn.linear_model import Ridge
from sklearn.model_selection import GroupKFold

from palpate.modeling.attributes import whole_textures
from palpate.modeling.attributes.learnable import inner_folds
from palpate.modeling.attributes.material import MaterialError, ratings_of
from palpate.modeling.attributes.whole_textures import BOOSTING, LIMIT, RIDGE, SHARES, boosted, whole_of
from palpate.modeling.regression import PENALTIES, inner_errors, path_of
from tests.modeling.attributes.learning_for_tests import learning, unseen_textures
from tests.modeling.attributes.material_for_tests import simulated_material


def weighed(textures, given, share):
    """The rows that ridge sees, made the long way: each block 1 / sqrt(its columns), and the share of its sense."""
    _, z = whole_of(textures, given.touch, given.sight)
    blocks = [(520, share), (6, share), (520, share), (6, share), (256, 1 - share), (256, 1 - share)]
    return z * np.concatenate([np.full(size, (own / size) ** 0.5) for size, own in blocks])


@pytest.mark.long
@pytest.mark.parametrize("noise", [1.0, 15.0])
def test_it_chooses_and_answers_as_sklearn_does_over_every_share_and_penalty(noise):
    given = learning(textures=simulated_material(14, 4, 3, noise=noise).textures)
    fitted, y = RIDGE.fit(given), ratings_of(given.train)
    folds = list(GroupKFold(5).split(y, groups=np.arange(14)))
    errors = {}
    for share in SHARES:
        x = weighed(given.train, given, share)
        for penalty in PENALTIES:
            off = np.zeros(4)
            for train, test in folds:
                off += ((Ridge(penalty).fit(x[train], y[train]).predict(x[test]) - y[test]) ** 2).sum(axis=0)
            errors[share, penalty] = off
    for place in range(4):
        share, penalty = fitted.share[place], fitted.penalty[place]
        assert errors[share, penalty][place] == pytest.approx(min(one[place] for one in errors.values()), rel=1e-6)
        other = Ridge(penalty).fit(weighed(given.train, given, share), y[:, place])
        own = [fitted.predict(texture).mean(axis=0)[place] for texture in given.train]
        assert own == pytest.approx(other.predict(weighed(given.train, given, share)), abs=1e-6)


def test_inner_errors_are_those_of_sklearn():
    chance = np.random.default_rng(0)
    x, y = chance.normal(size=(20, 5)), chance.normal(size=(20, 3))
    folds = list(GroupKFold(4).split(x, groups=np.arange(20)))
    inner = inner_errors(x, y, folds)
    for place, penalty in enumerate(PENALTIES):
        off = sum(((Ridge(penalty).fit(x[a], y[a]).predict(x[b]) - y[b]) ** 2).sum(axis=0) for a, b in folds)
        assert inner[place] == pytest.approx(off)
    assert path_of(x, y).weights(1.0).shape == (5, 3)


def test_rows_are_all_pairs_and_their_mean_is_the_answer_to_the_whole():
    fitted = RIDGE.fit(learning())
    texture = unseen_textures()[0]
    rows = fitted.predict(texture)
    assert len(rows) == 4 * 3
    whole = fitted.front(texture) @ fitted.weight.T + fitted.bias
    assert rows.mean(axis=0) == pytest.approx(whole[0])
    assert rows.std(axis=0).min() > 0


@pytest.mark.parametrize(("sense", "rows"), [("touch", 3), ("sight", 4)])
def test_it_can_use_one_sense_alone(sense, rows):
    fitted = RIDGE.fit(learning(**{sense: ()}))
    assert len(fitted.predict(replace(unseen_textures()[0], **{sense: {}}))) == rows
    assert set(fitted.share) == {1.0}
    with pytest.raises(MaterialError, match="no kind of feature"):
        RIDGE.fit(learning(touch=(), sight=()))


def test_each_attribute_leans_on_the_sense_that_tells_it():
    share = RIDGE.fit(learning()).share
    assert share[1] < 0.5
    assert share[2:].tolist() == [1.0, 1.0]


def test_a_single_picture_has_no_spread_and_is_no_outlier():
    texture = unseen_textures()[0]
    one = replace(texture, sight={kind: rows[:1] for kind, rows in texture.sight.items()}, variants={})
    fitted = RIDGE.fit(learning())
    assert fitted.front(one)[0, -256:].tolist() == [0.0] * 256
    assert fitted.predict(one).mean(axis=0) == pytest.approx(fitted.predict(texture).mean(axis=0), abs=8.0)


def test_textures_of_one_file_stay_on_one_side_of_inner_folds():
    textures = simulated_material(8, 1, 1).textures
    twins = [replace(texture, made_from=frozenset({f"{place // 2}"})) for place, texture in enumerate(textures)]
    tested = []
    for train, test in inner_folds(twins):
        assert not {place // 2 for place in train} & {place // 2 for place in test}
        tested += test.tolist()
    assert sorted(tested) == list(range(8))
    with pytest.raises(MaterialError, match="all made from the same"):
        list(inner_folds([replace(texture, made_from=frozenset({"x"})) for texture in textures]))


def test_what_is_far_off_all_that_was_learned_from_is_kept_within_limits():
    fitted, texture = RIDGE.fit(learning()), unseen_textures()[0]
    for value in (1e6, 1e30):
        loud = replace(texture, touch={**texture.touch, "mfcc": np.full((4, 520), value, "f4")})
        assert np.abs(fitted.front(loud)).max() == LIMIT
        assert np.isfinite(fitted.predict(loud)).all()
        whole = fitted.front(loud) @ fitted.weight.T + fitted.bias
        assert fitted.predict(loud).mean(axis=0) == pytest.approx(whole[0])


def test_it_tells_what_it_chose():
    lines = []
    RIDGE.fit(learning(report=lines.append))
    assert [line.split(":")[1].strip() for line in lines] == [
        "Rough-Smooth",
        "Flat-Bumpy",
        "Sticky-Slippery",
        "Hard-Soft",
    ]


def grown(given):
    front, z = whole_of(given.train, given.touch, given.sight)
    return front, [
        GradientBoostingRegressor(
            n_estimators=whole_textures.TREES, max_depth=whole_textures.DEPTH, learning_rate=whole_textures.RATE,
            max_features=whole_textures.COLUMNS, random_state=given.seed,
        ).fit(z.astype(np.float32), rating)
        for rating in ratings_of(given.train).T
    ]  # fmt: skip


def test_the_arrays_answer_to_the_bit_as_sklearn_does():
    given = learning(textures=simulated_material(12, 3, 2).textures)
    front, own = grown(given)
    rows = np.concatenate([front(texture) for texture in (*given.train, *unseen_textures())])
    rows = np.concatenate([rows, np.random.default_rng(1).normal(0, 5, (50, rows.shape[1]))])
    expected = np.stack([model.predict(rows.astype(np.float32)) for model in own], axis=1)
    bias = np.array([model.init_.constant_.item() for model in own])
    assert boosted(front, own, bias).answers(rows).tobytes() == expected.tobytes()


@pytest.mark.long
def test_fit_is_that_of_sklearn():
    given = learning(textures=simulated_material(12, 3, 2).textures)
    front, own = grown(given)
    texture = unseen_textures()[0]
    expected = [model.predict(front(texture).astype(np.float32))[0] for model in own]
    np.testing.assert_allclose(BOOSTING.fit(given).predict(texture)[0], expected, rtol=1e-12)


def test_a_value_between_two_single_precision_numbers_goes_where_sklearn_sends_it():
    given = learning(textures=simulated_material(12, 3, 2).textures)
    front, own = grown(given)
    tree = own[0].estimators_[0, 0].tree_
    rows = np.zeros((3, front.standard.gain.size))
    rows[:, tree.feature[0]] = tree.threshold[0] + np.array([-1e-12, 0.0, 1e-12])
    expected = own[0].predict(rows.astype(np.float32))
    bias = np.array([model.init_.constant_.item() for model in own])
    assert boosted(front, own, bias).answers(rows)[:, 0].tolist() == expected.tolist()


@pytest.mark.long
def test_a_texture_is_one_row():
    assert BOOSTING.fit(learning()).predict(unseen_textures()[0]).shape == (1, 4)
