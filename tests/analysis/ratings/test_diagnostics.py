from __future__ import annotations

import math
from statistics import correlation

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.analysis.ratings.diagnostics import Answered, DiagnosticsError, Limits, diagnose
from palpate.analysis.ratings.word_diagnostics import Worded, diagnose_words


def trial(number, values, seconds=7.0, stimulus=None, practice=False):
    items = dict(zip("abcdefg", values, strict=False))
    return Answered(number, stimulus or f"s{number}", items, seconds, practice)


def signs(trials, low=-10, high=10, **how):
    return {sign.name: sign for sign in diagnose(trials, low, high, **how)}


def attentive(n=20):
    return [trial(i, [(3 * i) % 7 - 3, (5 * i) % 11 - 5, i % 5 - 2]) for i in range(1, n + 1)]


def flagged(by_name):
    return {name for name, sign in by_name.items() if sign.flagged}


def test_an_attentive_rater_has_no_flag():
    assert flagged(signs(attentive())) == set()


def test_a_straight_liner_is_flagged_within_and_across_trials():
    by_name = signs([trial(i, [3, 3, 3]) for i in range(1, 11)])
    assert flagged(by_name) == {"same value on all items", "same answers in a row", "spread within a trial"}
    assert by_name["same value on all items"].value == 1.0
    assert by_name["same answers in a row"].value == 10
    assert by_name["spread within a trial"].value == 0.0


def test_the_same_different_values_in_every_trial_are_a_run_but_no_straight_line():
    by_name = signs([trial(i, [1, -4, 6]) for i in range(1, 11)])
    assert flagged(by_name) == {"same answers in a row"}


def test_a_run_ends_where_an_answer_changes():
    values = [[1, 2], [1, 2], [1, 2], [5, 2], [1, 2], [1, 2]]
    assert signs([trial(i, v) for i, v in enumerate(values, 1)])["same answers in a row"].value == 3


def test_one_item_alike_five_times_of_forty_says_little_but_half_of_them_does():
    few = [trial(i, [0.0 if 10 <= i < 15 else float(i % 9)]) for i in range(1, 41)]
    many = [trial(i, [0.0 if i <= 20 else float(i % 9)]) for i in range(1, 41)]
    assert not signs(few)["same answers in a row"].flagged
    assert signs(many)["same answers in a row"].flagged
    assert signs(few)["same value on all items"].value is None


def test_the_spread_of_a_trial_is_its_population_sd_over_the_range():
    # SD of (-2, 2) is 2, of (-6, 6) is 6: the median is 4 of a range of 20.
    assert signs([trial(1, [-2, 2]), trial(2, [-6, 6])])["spread within a trial"].value == pytest.approx(0.2)


def test_answers_piled_up_at_the_ends_are_flagged():
    sign = signs([trial(i, [10, -10, 3, i % 4]) for i in range(1, 11)])["at the ends"]
    assert (sign.value, sign.n, sign.flagged) == (0.5, 40, True)
    assert sign.sentence == "20 of 40 ratings lie at an end (50%); flagged from 50%."


def test_trials_answered_too_fast_are_counted_by_their_items():
    # Three items at 0.4 s each: 1.2 s is not too fast, 1.19 s is.
    fast = [trial(i, [i % 5, 2, 3], seconds=1.19 if i <= 2 else 1.2) for i in range(1, 21)]
    by_name = signs(fast)
    assert (by_name["too fast"].value, by_name["too fast"].flagged) == (0.1, False)
    assert signs([*fast, trial(21, [1, 2, 4], seconds=0.2)])["too fast"].flagged
    assert by_name["time per item"].value == pytest.approx(0.4)


def test_times_that_are_not_on_record_give_no_number():
    by_name = signs([trial(i, [1, i % 4], seconds=None) for i in range(1, 9)])
    assert by_name["too fast"].value is None
    assert by_name["time per item"].sentence == "No number: no response time is recorded."


def test_a_stimulus_presented_again_is_compared_with_the_time_before_on_every_item():
    first = [trial(i, [i, 10 - i], stimulus=f"s{i}") for i in range(1, 6)]
    again = [trial(i + 5, [i + 1, 9 - i], stimulus=f"s{i}") for i in range(1, 6)]
    by_name = signs([*first, *again])
    pairs = [(i, i + 1) for i in range(1, 6)] + [(10 - i, 9 - i) for i in range(1, 6)]
    assert by_name["retest r"].n == 10
    assert by_name["retest r"].value == pytest.approx(correlation(*zip(*pairs, strict=True)))  # Python's own
    assert by_name["retest difference"].value == pytest.approx(1 / 20)


def test_a_rater_who_answers_anew_is_flagged_for_retest():
    first = [trial(i, [i - 6, -i, 3], stimulus=f"s{i}") for i in range(1, 9)]
    again = [trial(i + 8, [6 - i, i, -3], stimulus=f"s{i}") for i in range(1, 9)]
    assert {"retest r", "retest difference"} <= flagged(signs([*first, *again]))


def test_practice_counts_nowhere_and_is_no_first_meeting():
    practice = trial(1, [10, 10, 10], 0.1, stimulus="s2", practice=True)
    with_practice = signs([practice, *[trial(i, [i % 7, i % 5, 1]) for i in range(2, 9)]])
    assert with_practice["retest r"].value is None
    assert with_practice["same value on all items"].n == 7
    assert with_practice["too fast"].value == 0


@pytest.mark.parametrize("value", [0.1, 0.3, 1e9 + 0.1])
def test_equal_ratings_have_no_correlation_rather_than_one_of_rounding(value):
    trials = [trial(i, [value], stimulus=f"s{i % 10}") for i in range(1, 31)]
    sign = signs(trials, low=0, high=2e9)["retest r"]
    assert (sign.value, sign.flagged) == (None, False)
    assert "equal" in sign.sentence


@given(st.lists(st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)), min_size=1, max_size=12))
def test_a_correlation_is_none_or_within_its_bounds(pairs):
    first = [trial(i, [a], stimulus=f"s{i}") for i, (a, _) in enumerate(pairs)]
    again = [trial(100 + i, [b], stimulus=f"s{i}") for i, (_, b) in enumerate(pairs)]
    r = signs([*first, *again], low=-1e6, high=1e6)["retest r"].value
    assert r is None or -1 <= r <= 1


def test_expected_ratings_that_are_not_there_are_missing():
    trials = [trial(1, [1, 2, 3]), Answered(2, "s2", {"a": 1.0})]
    sign = signs(trials, expected=3)["missing"]
    assert (sign.value, sign.flagged) == (pytest.approx(5 / 9), True)


def test_too_few_trials_are_not_flagged_for_their_share():
    assert flagged(signs([trial(i, [10, 10, 10], 0.1) for i in range(1, 5)])) == set()


def test_nothing_answered_gives_reasons_and_no_number():
    assert all(sign.value is None and sign.sentence.startswith("No number") for sign in diagnose([], 0, 1))


def test_thresholds_are_the_callers():
    sign = signs(attentive(), limits=Limits(ends_share=0.0))["at the ends"]
    assert (sign.threshold, sign.flagged) == (0.0, True)


@pytest.mark.parametrize("value", [math.nan, math.inf, 10.5])
def test_a_value_that_no_scale_gives_is_refused(value):
    with pytest.raises(DiagnosticsError, match="trial 1: a = .*; a finite number from -10 to 10 is expected"):
        diagnose([trial(1, [value])], -10, 10)


@pytest.mark.parametrize(("low", "high"), [(1, 1), (2, 1), (math.nan, 1), (0, math.inf)])
def test_a_scale_without_extent_is_refused(low, high):
    with pytest.raises(DiagnosticsError, match="two finite ends"):
        diagnose([], low, high)


def worded(number, words, seconds=20.0, offered=8):
    return Worded(number, f"s{number}", tuple(words), offered, seconds)


def words(trials, **how):
    return {sign.name: sign for sign in diagnose_words(trials, **how)}


def test_somebody_who_ticks_the_same_words_every_time_is_flagged():
    by_name = words([worded(i, ["soft", "warm"] if i % 2 else ["warm", "soft"]) for i in range(1, 7)])
    assert flagged(by_name) == {"same words in a row", "different sets of words"}
    assert by_name["words ticked"].value == 0.25


def test_words_that_fit_the_stimulus_are_not_flagged():
    assert flagged(words([worded(i, "abcdefgh"[: 1 + i % 4]) for i in range(1, 9)])) == set()


def test_empty_and_hurried_trials_of_words_are_flagged():
    by_name = words([worded(i, [] if i % 2 else ["soft", str(i)], seconds=1.0) for i in range(1, 9)])
    assert {"no word at all", "too fast", "time per trial"} == flagged(by_name)


def test_written_words_are_counted_not_shared_out():
    by_name = words([worded(i, ["a", str(i)], offered=0) for i in range(1, 4)], expected=4)
    assert (by_name["words per trial"].value, by_name["words per trial"].unit) == (2.0, "words")
    assert by_name["missing"].value == 0.25


def test_no_words_give_reasons_and_no_number():
    assert all(sign.value is None for sign in diagnose_words([]))
