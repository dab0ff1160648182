"""Support vectors as arrays, against scikit-learn's own regression."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.model_selection import GroupKFold
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVR

from palpate.modeling.attributes import tactile_svm
from palpate.modeling.attributes.material import ratings_of
from palpate.modeling.attributes.tactile_svm import TACTILE_SVM
from tests.modeling.attributes.learning_for_tests import learning, unseen_textures
from tests.modeling.attributes.material_for_tests import simulated_material


def test_it_chooses_and_answers_as_sklearn_does_over_the_whole_grid():
    given = learning(textures=simulated_material(10, 3, 1, noise=3.0).textures)
    rows = np.concatenate([texture.rows("touch", given.touch) for texture in given.train]).astype(float)
    z, place = StandardScaler().fit_transform(rows), np.repeat(np.arange(10), 3)
    y = StandardScaler().fit_transform(ratings_of(given.train))
    fitted = TACTILE_SVM.fit(given)
    ask = StandardScaler().fit(rows).transform(unseen_textures()[0].rows("touch", given.touch).astype(float))
    for attribute in range(4):
        errors = {}
        for cost in tactile_svm.COSTS:
            for width in tactile_svm.WIDTHS:
                errors[cost, width / 526] = 0.0
                for train, test in GroupKFold(5).split(y, groups=np.arange(10)):
                    on = np.isin(place, train)
                    svr = SVR(C=cost, gamma=width / 526, epsilon=0.1).fit(z[on], y[place[on], attribute])
                    means = [svr.predict(z[place == one]).mean() for one in test]
                    errors[cost, width / 526] += ((means - y[test, attribute]) ** 2).sum()
        cost, gamma = min(errors, key=errors.get)
        assert fitted.gamma[attribute] == pytest.approx(gamma)
        other = SVR(C=cost, gamma=gamma, epsilon=0.1).fit(z, y[place, attribute]).predict(ask)
        own = ratings_of(given.train)[:, attribute]
        assert fitted.predict(unseen_textures()[0])[:, attribute] == pytest.approx(
            other * own.std() + own.mean(), abs=1e-2
        )


def test_of_a_long_recording_some_segments_are_learned_from_and_all_are_predicted():
    long = simulated_material(4, 40, 1).textures
    fitted = TACTILE_SVM.fit(learning(textures=long))
    assert len(fitted.vectors) <= 4 * tactile_svm.SEGMENTS
    assert fitted.predict(long[0]).shape == (40, 4)


def test_equal_ratings_need_no_vector():
    textures = simulated_material(4, 2, 1).textures
    flat = [replace(texture, rated=textures[0].rated) for texture in textures]
    fitted = TACTILE_SVM.fit(learning(textures=flat))
    assert fitted.vectors.shape == (0, 526)
    assert fitted.predict(unseen_textures()[0]) == pytest.approx(np.tile(textures[0].rated.mean, (4, 1)))
