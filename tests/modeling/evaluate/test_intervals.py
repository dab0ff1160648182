"""Conformal intervals hold what they say, or are refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.modeling.evaluate.intervals import half_widths, interval, needed, nested_coverage, scaled_half_widths
from palpate.modeling.evaluate.rows import ModelDataError
from tests.examples import examples


@pytest.mark.parametrize(("coverage", "least"), [(0.5, 1), (0.8, 4), (0.9, 9), (0.95, 19), (0.99, 99)])
def test_so_many_residuals_are_needed_and_enough(coverage, least):
    # n >= coverage / (1 - coverage): Lei et al. 2018, section 2
    assert needed(coverage) == least
    assert half_widths(np.arange(1.0, least + 1)[:, None], coverage) == least
    if least > 1:
        with pytest.raises(ModelDataError, match=f"at least {least} stimuli; there are {least - 1}"):
            half_widths(np.ones((least - 1, 2)), coverage)


@pytest.mark.parametrize("coverage", [0.0, 1.0, -0.5, 90.0, float("nan")])
def test_a_coverage_that_is_no_share_is_refused(coverage):
    with pytest.raises(ModelDataError, match="share between 0 and 1"):
        needed(coverage)


def test_the_half_width_is_the_finite_sample_quantile_by_attribute():
    residual = np.c_[np.arange(1.0, 20), -2 * np.arange(1.0, 20)]
    # ceil(20 * 0.9) = 18th of 19; ceil(20 * 0.5) = 10th
    assert half_widths(residual, 0.9).tolist() == [18, 36]
    assert half_widths(residual[::-1], 0.5).tolist() == [10, 20]


@given(st.integers(9, 60), st.floats(0.05, 0.9), st.integers(0, 5))
@settings(max_examples=examples(60), deadline=None)
def test_a_half_width_is_a_residual_and_grows_with_coverage(n, coverage, seed):
    residual = np.random.default_rng(seed).normal(size=(n, 2))
    width = half_widths(residual, coverage)
    assert np.isin(width, np.abs(residual)).all()
    assert (width <= half_widths(residual, 0.9)).all()
    assert half_widths(3 * residual, coverage) == pytest.approx(3 * width)


def test_new_answers_are_held_as_often_as_the_theorem_says():
    # of exchangeable residuals, ceil(21 * 0.9) / 21 = 19 / 21 (Vovk, Gammerman and Shafer 2005)
    draw = np.random.default_rng(5)
    residual, new = draw.standard_t(2, (20, 4000)), draw.standard_t(2, 4000)
    held = np.mean(np.abs(new) <= half_widths(residual, 0.9))
    assert held == pytest.approx(19 / 21, abs=4 * np.sqrt(0.9 * 0.1 / 4000))


def test_nested_coverage_calibrates_on_the_other_folds_only():
    # fold 0 errs by 1 and fold 1 by 10: each is tested with the other's width
    residual, fold = np.repeat([[1.0], [10.0]], 10, axis=0), np.repeat([0, 1], 10)
    coverage = nested_coverage(residual, fold, 0.9)
    assert (coverage.share, coverage.overall) == ((0.5,), 0.5)
    assert coverage.half_width == (5.5,)
    assert coverage.error == (pytest.approx(np.sqrt(0.25 / 20)),)
    assert coverage.stimuli == 20


def test_errors_of_attributes_that_err_together_are_distinguished():
    draw = np.random.default_rng(3)
    alike = np.repeat(draw.normal(size=(200, 1)), 7, axis=1)
    coverage = nested_coverage(alike, np.arange(200) % 5, 0.8)
    assert coverage.overall_error_by_stimulus == pytest.approx(np.sqrt(7) * coverage.overall_error, rel=0.01)
    assert coverage.overall == pytest.approx(0.8, abs=0.1)


def test_scaled_intervals_hold_the_calm_and_the_wild_alike():
    draw = np.random.default_rng(8)
    sd = np.where(np.arange(1000) % 2, 5.0, 1.0)[:, None]
    residual, fold = sd * draw.normal(size=(1000, 1)), np.arange(1000) // 2 % 5
    wild = sd[:, 0] > 1
    scaled = np.abs(residual) <= scaled_half_widths(residual, sd, sd, 0.9)
    plain = np.abs(residual) <= half_widths(residual, 0.9)
    assert [scaled[wild].mean(), scaled[~wild].mean()] == pytest.approx([0.9, 0.9], abs=0.03)
    assert plain[~wild].mean() > 0.99
    assert plain[wild].mean() < 0.85
    assert nested_coverage(residual, fold, 0.9, sd).overall == pytest.approx(0.9, abs=0.03)


def test_an_interval_does_not_shrink_to_nothing():
    residual, sd = np.ones((19, 1)), np.ones((19, 1))
    assert scaled_half_widths(residual, sd, np.zeros((1, 1))) == pytest.approx(0.1)
    with pytest.raises(ModelDataError, match="are 0"):
        scaled_half_widths(residual, np.zeros((19, 1)), sd)


def test_what_is_no_residual_or_sd_is_refused():
    with pytest.raises(ModelDataError, match="row 2 holds nan"):
        half_widths(np.array([[1.0], [np.nan]]), 0.5)
    with pytest.raises(ModelDataError, match=r"\(stimuli, attributes\) is expected"):
        half_widths(np.ones(30), 0.5)
    with pytest.raises(ModelDataError, match="an SD is 0 or more"):
        scaled_half_widths(np.ones((19, 1)), -np.ones((19, 1)), np.ones((1, 1)))
    with pytest.raises(ModelDataError, match="SD of the calibration"):
        scaled_half_widths(np.ones((19, 2)), np.ones((19, 1)), np.ones((1, 2)))
    with pytest.raises(ModelDataError, match="of two folds at least"):
        nested_coverage(np.ones((30, 1)), [0] * 30)
    with pytest.raises(ModelDataError, match="need a fold each"):
        nested_coverage(np.ones((30, 1)), [0, 1])


def test_too_few_residuals_outside_a_fold_are_refused():
    with pytest.raises(ModelDataError, match="at least 9 stimuli; there are 2"):
        nested_coverage(np.ones((12, 1)), [0] * 10 + [1] * 2, 0.9)


def test_the_card_says_how_it_was_calibrated():
    calibrated = interval(np.arange(1.0, 20)[:, None] * [1, 2], 0.9)
    assert calibrated.half_width == (18, 36)
    assert calibrated.method == "conformal, from out-of-fold residuals of 19 stimuli (grouped folds)"
