"""Shares of predictions that are as good as people can tell."""

import numpy as np
import pytest

from palpate.modeling.doors.scores import share_within, share_within_sd
from palpate.modeling.evaluate.intervals import JND
from palpate.modeling.evaluate.rows import ModelDataError

RATED = np.array([[50.0, 50.0], [20.0, 80.0], [0.0, 100.0], [40.0, 60.0]])
OFF = np.array([[10.0, -10.01], [-3.0, 0.0], [12.0, 4.0], [0.5, -30.0]])


def test_the_jnd_itself_is_within():
    within = share_within(RATED + OFF, RATED)
    assert JND == 10
    assert within.share == (0.75, 0.5)
    assert within.error == pytest.approx((np.sqrt(0.75 * 0.25 / 4), 0.25))
    assert within.overall == 0.625
    assert within.overall_error == pytest.approx(np.sqrt(0.625 * 0.375 / 8))


def test_another_jnd_counts_otherwise():
    assert share_within(RATED + OFF, RATED, jnd=3).overall == 3 / 8
    for wrong in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ModelDataError, match="positive number"):
            share_within(RATED, RATED, jnd=wrong)


def test_each_stimulus_is_held_against_its_own_raters():
    sd = np.array([[10.0, 10.0], [1.0, 0.0], [20.0, 3.0], [0.0, 40.0]])
    assert share_within_sd(RATED + OFF, RATED, sd).share == (0.5, 0.5)
    assert share_within_sd(RATED + OFF, RATED, 16.4).overall == 7 / 8


def test_a_stimulus_that_one_person_rated_is_refused():
    sd = np.where(np.arange(4)[:, None] == 2, np.nan, np.ones((4, 2)))
    with pytest.raises(ModelDataError, match="row 3 .* one person rated has no SD"):
        share_within_sd(RATED, RATED, sd)
    with pytest.raises(ModelDataError, match="0 or more"):
        share_within_sd(RATED, RATED, -1.0)


def test_arrays_that_do_not_match_are_refused():
    for predicted, rated in ((RATED[:2], RATED), (RATED[:0], RATED[:0]), (RATED[0], RATED[0])):
        with pytest.raises(ModelDataError, match="the same rows and attributes"):
            share_within(predicted, rated)
    with pytest.raises(ModelDataError, match="predictions: row 1 holds nan"):
        share_within(np.full_like(RATED, np.nan), RATED)
    with pytest.raises(ModelDataError, match=r"SD of the raters has shape \(3,\)"):
        share_within_sd(RATED, RATED, np.ones(3))
