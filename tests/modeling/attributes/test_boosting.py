"""Boosted trees as arrays, against the regressors of scikit-learn that they were."""

import numpy as np
import pytest
from sklearn.ensemble import GradientBoostingRegressor

from palpate.modeling.attributes import boosting
from palpate.modeling.attributes.boosting import BOOSTING, boosted
from palpate.modeling.attributes.material import ratings_of
from palpate.modeling.attributes.whole import whole_of
from tests.modeling.attributes.learned import asked, learning
from tests.modeling.attributes.made_material import made_material


def grown(given):
    front, z = whole_of(given.train, given.touch, given.sight)
    return front, [
        GradientBoostingRegressor(
            n_estimators=boosting.TREES, max_depth=boosting.DEPTH, learning_rate=boosting.RATE,
            max_features=boosting.COLUMNS, random_state=given.seed,
        ).fit(z.astype(np.float32), rating)
        for rating in ratings_of(given.train).T
    ]  # fmt: skip


def test_the_arrays_answer_to_the_bit_as_sklearn_does():
    given = learning(textures=made_material(12, 3, 2).textures)
    front, own = grown(given)
    rows = np.concatenate([front(each) for each in (*given.train, *asked())])
    rows = np.concatenate([rows, np.random.default_rng(1).normal(0, 5, (50, rows.shape[1]))])
    expected = np.stack([each.predict(rows.astype(np.float32)) for each in own], axis=1)
    bias = np.array([each.init_.constant_.item() for each in own])
    assert boosted(front, own, bias).answers(rows).tobytes() == expected.tobytes()


@pytest.mark.long
def test_fit_is_that_of_sklearn():
    given = learning(textures=made_material(12, 3, 2).textures)
    front, own = grown(given)
    texture = asked()[0]
    expected = [each.predict(front(texture).astype(np.float32))[0] for each in own]
    np.testing.assert_allclose(BOOSTING.fit(given).predict(texture)[0], expected, rtol=1e-12)


def test_a_value_between_two_single_precision_numbers_goes_where_sklearn_sends_it():
    given = learning(textures=made_material(12, 3, 2).textures)
    front, own = grown(given)
    tree = own[0].estimators_[0, 0].tree_
    rows = np.zeros((3, front.standard.gain.size))
    rows[:, tree.feature[0]] = tree.threshold[0] + np.array([-1e-12, 0.0, 1e-12])
    expected = own[0].predict(rows.astype(np.float32))
    bias = np.array([each.init_.constant_.item() for each in own])
    assert boosted(front, own, bias).answers(rows)[:, 0].tolist() == expected.tolist()


@pytest.mark.long
def test_a_texture_is_one_row():
    assert BOOSTING.fit(learning()).predict(asked()[0]).shape == (1, 4)
