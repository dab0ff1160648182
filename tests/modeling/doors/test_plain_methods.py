"""Each plain method against the same computed by scikit-learn, or the long way."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from sklearn.decomposition import PCA
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
from sklearn.linear_model import Ridge
from sklearn.model_selection import GroupKFold

from palpate.modeling.doors import forest, linear
from palpate.modeling.doors.forest import FOREST
from palpate.modeling.doors.gaussian_process import GAUSSIAN_PROCESS
from palpate.modeling.doors.linear import (
    PCA_REGRESSION,
    PCA_RIDGE,
    PENALTIES,
    RIDGE,
    best_penalty,
    components_of,
    path_of,
)
from palpate.modeling.doors.nearest import NEAREST
from palpate.modeling.doors.preparing import featured, inner_folds, rows_of
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.modeling.regression import standard_of
from palpate.signals.doors.limits import LIMIT_N, STEEPEST_N_DEG
from tests.modeling.doors.baseline_learning import ON_FEATURES, SEEN, data_of, learn, profiles, unseen_rows


def some(rows=30, columns=5, outputs=3, seed=2):
    draw = np.random.default_rng(seed)
    x = draw.normal(3, 2, (rows, columns))
    return x, x @ draw.normal(size=(columns, outputs)) + draw.normal(size=(rows, outputs)), np.arange(rows) // 2


def noisy():
    """The sixteen stimuli, rated with an error of 8 of 200."""
    data = data_of(SEEN)
    return replace(data, rating=data.rating + np.random.default_rng(4).normal(0, 8, data.rating.shape))


def inner_loss(x, y, group, fit):
    """The squared error over GroupKFold of what `fit` fits, computed the long way."""
    loss = 0.0
    for train, test in GroupKFold(5).split(x, groups=group):
        loss += ((fit(x[train], y[train]).predict(x[test]) - y[test]) ** 2).sum()
    return loss


@pytest.mark.parametrize("penalty", [1e-3, 1.0, 300.0])
def test_a_path_gives_the_weights_of_sklearn_ridge(penalty):
    x, y, _ = some()
    path, other = path_of(x, y), Ridge(penalty).fit(x, y)
    assert path.weights(penalty) == pytest.approx(other.coef_.T, abs=1e-10)
    assert path.answers(x, path.weights(penalty)) == pytest.approx(other.predict(x), abs=1e-10)


def test_the_penalty_is_that_of_least_error_over_grouped_folds():
    x, y, group = some()
    losses = [inner_loss(x, y, group, Ridge(one).fit) for one in PENALTIES]
    assert best_penalty(x, y, group) == PENALTIES[int(np.argmin(losses))]


def test_no_group_lies_on_both_sides_of_an_inner_fold():
    group = np.repeat(np.arange(8), [6, 1, 3, 2, 2, 5, 1, 4])
    tested = []
    for train, test in inner_folds(group):
        assert not set(group[train]) & set(group[test])
        tested += test.tolist()
    assert sorted(tested) == list(range(len(group)))


def test_stimuli_and_their_variants_are_one_group():
    rows = rows_of(learn(), "train")
    assert len(rows.group) == 6 * len(SEEN)
    assert len(set(rows.group.tolist())) == len(SEEN)


def test_a_column_that_is_constant_in_training_is_dropped():
    x = np.c_[np.arange(5.0), np.full(5, 1e6), np.full(5, 0.1) * 3, np.zeros(5)]
    standard = standard_of(x)
    assert standard(x).std(axis=0) == pytest.approx([1, 0, 0, 0])
    assert standard(x + 7)[:, 1:].tolist() == np.zeros((5, 3)).tolist()


@pytest.mark.parametrize("method", ON_FEATURES, ids=lambda method: method.name)
def test_a_feature_without_variance_in_training_has_no_say(method):
    given = learn()
    front, z = featured(rows_of(given))
    dropped = np.flatnonzero(front.standard.gain == 0)
    assert all(np.ptp(z[:, one]) == 0 for one in dropped)
    exported = method.fit(given).exported()
    assert set(np.flatnonzero(exported.tensors["feature_gain"] == 0)) <= set(dropped)


def test_ridge_says_its_penalty():
    lines = []
    fitted = RIDGE.fit(replace(learn(), report=lines.append))
    assert fitted.penalty in PENALTIES
    assert lines == [f"ridge: penalty {fitted.penalty:.3g}"]


def test_the_forest_answers_as_sklearn_does():
    from sklearn.ensemble import RandomForestRegressor

    given = learn()
    rows = rows_of(given, "train")
    front, z = featured(rows)
    other = RandomForestRegressor(
        forest.TREES, min_samples_leaf=forest.LEAST_IN_LEAF, max_features=1 / 3, random_state=given.seed
    ).fit(z, rows.rating)
    fitted = FOREST.fit(given)
    # the same features as sklearn sees them: it compares in single precision
    seen = front(unseen_rows(FOREST)).astype(np.float32).astype(np.float64)
    answers = fitted.trees.value[fitted.trees.leaves(seen)].mean(axis=1)
    assert answers == pytest.approx(other.predict(seen), abs=1e-9)
    spread = np.std([tree.predict(seen) for tree in other.estimators_], axis=0)
    assert fitted.deviation(unseen_rows(FOREST)) == pytest.approx(spread, abs=2.0)


def test_another_seed_grows_another_forest():
    first, again = learn(), replace(learn(), seed=6)
    assert not np.array_equal(
        FOREST.fit(first).predict(unseen_rows(FOREST)), FOREST.fit(again).predict(unseen_rows(FOREST))
    )


def test_the_gaussian_process_answers_as_sklearn_does_and_is_at_least_as_likely():
    given = learn(noisy())
    rows = rows_of(given)
    front, z = featured(rows)
    y = standard_of(rows.rating)(rows.rating)
    fitted = GAUSSIAN_PROCESS.fit(given)
    own = fitted.process
    kernel = ConstantKernel(own.variance) * RBF(own.length) + WhiteKernel(own.variance * own.noise)
    other = GaussianProcessRegressor(kernel, optimizer=None, alpha=0).fit(z, y)
    mean, sd = other.predict(front(unseen_rows(RIDGE)), return_std=True)
    assert fitted.predict(unseen_rows(RIDGE)) == pytest.approx(mean * fitted.gain + fitted.offset, abs=1e-7)
    assert fitted.deviation(unseen_rows(RIDGE)) == pytest.approx(sd * fitted.gain, rel=1e-6)
    wide = [(1e-4, 1e5), (1e-2, 1e4), (1e-9, 1e3)]
    free = ConstantKernel(1.0, wide[0]) * RBF(5.0, wide[1]) + WhiteKernel(0.1, wide[2])
    searched = GaussianProcessRegressor(free, alpha=0).fit(z, y)
    assert other.log_marginal_likelihood_value_ >= searched.log_marginal_likelihood_value_ - 0.02


def test_the_gaussian_process_doubts_what_is_unlike_all_it_has_seen():
    fitted = GAUSSIAN_PROCESS.fit(learn())
    seen, strange = fitted.deviation(profiles(SEEN)), fitted.deviation(np.full((1, 621), 300.0))
    assert strange.min() > 1.5 * seen.max()


def test_components_are_those_of_sklearn_and_no_more_than_there_are():
    x = profiles(SEEN)
    own, other = components_of(x, 4), PCA(4).fit(x)
    assert np.abs(np.sum(own.directions * other.components_, axis=1)) == pytest.approx(np.ones(4))
    assert components_of(x, 40).directions.shape == (len(x) - 1, 621)
    assert components_of(np.ones((3, 621)), 2).directions.shape == (0, 621)


def test_components_and_penalty_of_pca_ridge_are_those_of_least_error(monkeypatch):
    monkeypatch.setattr(linear, "FORWARD_COMPONENTS", (1, 3, 5))
    monkeypatch.setattr(linear, "PENALTIES", PENALTIES[::8])
    lines = []
    given = replace(learn(learn_from="measured"), report=lines.append)
    rows = rows_of(given)

    class Long:
        def __init__(self, count, penalty):
            self.pca, self.ridge = PCA(count), Ridge(penalty)

        def fit(self, x, y):
            codes = self.pca.fit_transform(x)
            self.size = codes[:, 0].std()
            self.ridge.fit(codes / self.size, y)
            return self

        def predict(self, x):
            return self.ridge.predict(self.pca.transform(x) / self.size)

    losses = {
        (count, penalty): inner_loss(rows.force_N, rows.rating, rows.group, Long(count, penalty).fit)
        for count in (1, 3, 5)
        for penalty in PENALTIES[::8]
    }
    count, penalty = min(losses, key=losses.get)
    fitted = PCA_RIDGE.fit(given)
    assert lines == [f"pca_ridge: {count} components, penalty {penalty:.3g}"]
    expected = Long(count, penalty).fit(rows.force_N, rows.rating).predict(unseen_rows(PCA_RIDGE))
    assert fitted.predict(unseen_rows(PCA_RIDGE)) == pytest.approx(expected, abs=1e-8)


def test_components_and_penalty_of_pca_regression_are_those_of_least_error(monkeypatch):
    monkeypatch.setattr(linear, "INVERSE_COMPONENTS", (1, 2, 4))
    monkeypatch.setattr(linear, "PENALTIES", PENALTIES[::8])
    lines = []
    given = replace(learn(), report=lines.append)
    rows = rows_of(given)
    z = standard_of(rows.rating)(rows.rating)

    class Long:
        def __init__(self, count, penalty):
            self.pca, self.ridge = PCA(count), Ridge(penalty)

        def fit(self, x, y):
            self.ridge.fit(x, self.pca.fit_transform(y))
            return self

        def predict(self, x):
            return self.pca.inverse_transform(self.ridge.predict(x).reshape(len(x), -1))

    losses = {
        (count, penalty): inner_loss(z, rows.force_N, rows.group, Long(count, penalty).fit)
        for count in (1, 2, 4)
        for penalty in PENALTIES[::8]
    }
    count, penalty = min(losses, key=losses.get)
    fitted = PCA_REGRESSION.fit(given)
    assert lines == [f"pca_regression: {count} components, penalty {penalty:.3g}"]
    wish = unseen_rows(PCA_REGRESSION)
    expected = Long(count, penalty).fit(z, rows.force_N).predict(standard_of(rows.rating)(wish))
    assert fitted.linear.predict(wish) == pytest.approx(expected, abs=1e-8)


def test_what_pca_regression_makes_is_playable_at_every_corner():
    given = learn()
    corners = np.array(list(product((0.0, 100.0), repeat=7)))
    generated = PCA_REGRESSION.fit(given).predict(corners)
    assert np.abs(generated).max() <= LIMIT_N
    assert np.abs(np.diff(generated)).max() <= STEEPEST_N_DEG / 10 + 1e-9


def test_the_nearest_profile_is_the_one_that_was_rated_so():
    data, given = data_of(SEEN), learn()
    wish = given.scaling.rating_up(data.rating)
    nearest = NEAREST.fit(given).predict(wish + 0.01)
    assert np.array_equal(nearest, data.force_N)


def test_the_nearest_of_equals_does_not_depend_on_the_order(tmp_path):
    data = data_of(SEEN[:2])
    equal = replace(data, rating=np.tile(data.rating[:1], (2, 1)))
    turned = equal.rows(np.array([1, 0]))
    wish = np.full((1, 7), 40.0)
    both_nearest = [NEAREST.fit(replace(learn(), measured=one)).predict(wish) for one in (equal, turned)]
    assert np.array_equal(*both_nearest)


def test_no_stimuli_are_refused():
    given = learn()
    with pytest.raises(ModelDataError, match="0 stimuli; at least 1 are needed"):
        NEAREST.fit(replace(given, measured=given.measured.rows(np.array([], dtype=np.int64))))
