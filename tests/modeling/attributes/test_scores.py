import numpy as np
import pytest
from scipy import stats
from sklearn.metrics import mean_absolute_error, root_mean_squared_error

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.scores import by_class, difference, errors

CHANCE = np.random.Generator(np.random.PCG64(3))
RATED, PREDICTED = CHANCE.uniform(0, 100, (30, 4)), CHANCE.uniform(0, 100, (30, 4))


def test_errors_are_those_of_scikit_learn():
    result = errors(PREDICTED, RATED)
    np.testing.assert_allclose(result.mae, mean_absolute_error(RATED, PREDICTED, multioutput="raw_values"))
    np.testing.assert_allclose(result.rmse, root_mean_squared_error(RATED, PREDICTED, multioutput="raw_values"))
    assert result.mean_mae == pytest.approx(np.mean(result.mae))
    assert result.mean_mae == pytest.approx(np.mean(result.texture_mae))
    assert result.mean_rmse == pytest.approx(np.mean(result.rmse))


def test_what_is_just_the_jnd_off_is_within_it():
    result = errors(np.array([[60.0, 0.0], [40.0, 11.0]]), np.array([[50.0, 0.0], [50.0, 0.0]]))
    assert result.within == (1.0, 0.5)
    assert result.all_within == 0.75


def test_classes_are_scored_by_themselves_with_how_many_they_are():
    result = by_class(PREDICTED, RATED, ["wood", "mesh", "wood"] * 10)
    assert {name: count for name, (count, _) in result.items()} == {"wood": 20, "mesh": 10}
    np.testing.assert_allclose(result["mesh"][1].mae, errors(PREDICTED[1::3], RATED[1::3]).mae)


def test_a_paired_difference_has_the_interval_of_scipys_t_test():
    one, other = CHANCE.normal(8, 2, 50), CHANCE.normal(9, 2, 50)
    result = difference(one, other, range(50))
    ends = stats.ttest_rel(one, other).confidence_interval(0.95)
    assert (result.mean, result.low, result.high) == pytest.approx((np.mean(one - other), ends.low, ends.high))
    five = difference(one, other, range(50), compared=5)
    ends = stats.ttest_rel(one, other).confidence_interval(0.99)
    assert (five.low, five.high) == pytest.approx((ends.low, ends.high))


def test_textures_of_one_group_count_as_one():
    one, other = np.array([1.0, 1.0, 5.0, 2.0]), np.zeros(4)
    result = difference(one, other, (0, 0, 1, 2))
    assert result.groups == 3
    assert result.mean == pytest.approx(9 / 4)  # over the four textures, as the MAE beside it is


def test_the_interval_over_groups_is_that_of_statsmodels_cluster_robust_errors():
    from statsmodels.api import OLS as ols

    groups = np.repeat(np.arange(14), [1, 3, 1, 2, 1, 1, 4, 1, 2, 1, 1, 5, 1, 1])
    shared = CHANCE.normal(1, 2, 14)[groups]
    off = shared + CHANCE.normal(0, 1, len(groups))
    fit = ols(off, np.ones(len(off))).fit(cov_type="cluster", cov_kwds={"groups": groups}, use_t=True)
    result = difference(off, np.zeros(len(off)), groups.tolist())
    assert (result.mean, result.low, result.high) == pytest.approx((off.mean(), *fit.conf_int(0.05)[0]))
    apart = difference(off, np.zeros(len(off)), range(len(off)))
    assert result.high - result.low > 1.2 * (apart.high - apart.low)


def test_a_difference_may_be_chance_or_none():
    base = CHANCE.normal(10, 1, 20)
    assert difference(base + CHANCE.normal(0, 1, 20), base, range(20)).chance
    surely = difference(base - 3 + CHANCE.normal(0, 0.1, 20), base, range(20))
    assert not surely.chance
    assert surely.mean < 0
    assert difference(base[:2], base[:2] + 1, range(2)).chance  # too few to tell


def test_what_cannot_be_compared_is_refused():
    for predicted in (PREDICTED[:3], PREDICTED[:, :2], PREDICTED * np.nan):
        with pytest.raises(MaterialError):
            errors(predicted, RATED)
    with pytest.raises(MaterialError):
        errors(np.empty((0, 4)), np.empty((0, 4)))
    with pytest.raises(MaterialError):
        difference(np.ones(3), np.ones(2), range(3))
