import pytest

from palpate.studies.procedures.adviser import End
from palpate.studies.procedures.constant import ConstantStimuli
from palpate.studies.procedures.limits import LimitsAdviser
from tests.studies.procedures.tracks_for_tests import ran, track

SERIES = {
    "kind": "limits", "level": {"column": "x", "from": 0, "to": 9, "points": 10}, "stop": {"trials": 100, "series": 4},
}  # fmt: skip


def presented(changes, answers):
    of = track({**SERIES, **changes})
    adviser = LimitsAdviser(of)
    past = ran(adviser, of, answers=answers)
    return adviser, past, [index for index, _ in past]


def test_series_rise_and_fall_until_the_answer_changes():
    adviser, past, indexes = presented({"stop": {"trials": 100, "series": 2}}, lambda level: level > 3.5)
    assert indexes == [0, 1, 2, 3, 4, 9, 8, 7, 6, 5, 4, 3]
    assert adviser.advise(past) == End("2 series")
    assert (adviser.estimate(past).threshold, adviser.estimate(past).sd) == (3.5, 0.0)


@pytest.mark.parametrize(("direction", "first"), [("ascending", {0}), ("descending", {9})])
def test_all_series_may_go_one_way_and_by_larger_steps(direction, first):
    _, _, indexes = presented({"direction": direction, "step": 2}, lambda level: level > 3.5)
    series = [0, 2, 4] if direction == "ascending" else [9, 7, 5, 3]
    assert indexes == series * 4 and set(indexes[:1]) == first


def test_a_series_begins_up_to_some_points_inside():
    _, _, indexes = presented({"direction": "ascending", "jitter": 3, "stop": {"trials": 100, "series": 30}},
                              lambda level: level > 5.5)  # fmt: skip
    starts = {a for before, a in zip([9, *indexes], indexes, strict=False) if before >= 6}
    assert starts == {0, 1, 2, 3}


def test_where_hits_become_rarer_with_the_level_ascending_series_end_with_a_miss():
    adviser, past, indexes = presented(
        {"easier": "lower", "direction": "ascending", "stop": {"trials": 100, "series": 1}}, lambda level: level < 3.5
    )
    assert indexes == [0, 1, 2, 3, 4] and adviser.estimate(past).threshold == 3.5


@pytest.mark.parametrize(("always", "outside", "bound"), [(True, "below", 0.0), (False, "above", 9.0)])
def test_whoever_always_answers_the_same_gets_an_inequality(always, outside, bound):
    adviser, past, _ = presented({"stop": {"trials": 200, "series": 6}}, lambda _level: always)
    estimate = adviser.estimate(past)
    assert (estimate.outside, estimate.bound, estimate.threshold) == (outside, bound, None)
    assert str(estimate) == f"threshold {outside} {bound:g}" and "sure" not in estimate.to_dict()


def test_an_inequality_says_no_more_than_each_series():
    """Series that begin inside the levels: the threshold is below the start of each."""
    adviser = LimitsAdviser(track({**SERIES, "direction": "ascending", "jitter": 5}))
    assert adviser.estimate(((1, True), (3, True), (0, True), (4, True))).bound == 4.0
    falling = LimitsAdviser(track({**SERIES, "direction": "descending"}))
    assert falling.estimate(((9, False), (8, False))).bound == 8.0


def test_a_series_that_ran_to_the_end_does_not_hide_the_others():
    adviser = LimitsAdviser(track({**SERIES, "direction": "ascending"}))
    crossed = tuple((n, n == 4) for n in range(5))
    at_once = ((0, True),)
    assert adviser.estimate((*crossed, *at_once, *crossed)).threshold == 3.5
    assert adviser.estimate((*crossed, *at_once, *at_once)).outside == "unknown"


def test_the_cap_ends_a_series_too():
    adviser, past, _ = presented({"stop": {"trials": 7, "series": 4}}, lambda level: level > 3.5)
    assert len(past) == 7 and adviser.advise(past) == End("7 trials")


def test_constant_stimuli_present_each_level_once_a_round_in_changing_orders():
    of = track({"kind": "constant", "level": SERIES["level"], "repeats": 3})
    adviser = ConstantStimuli(of)
    indexes = [index for index, _ in ran(adviser, of, answers=lambda _level: True)]
    rounds = [indexes[start : start + 10] for start in (0, 10, 20)]
    assert len(indexes) == 30 and all(sorted(order) == list(range(10)) for order in rounds)
    assert len({tuple(order) for order in rounds}) == 3
    assert adviser.advise(tuple((index, True) for index in indexes)) == End("30 trials")
