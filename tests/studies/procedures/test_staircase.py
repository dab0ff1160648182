import numpy as np
import pytest

from palpate.studies.procedures.adviser import End
from palpate.studies.procedures.staircase import StaircaseAdviser
from tests.studies.procedures.tracks_for_tests import TWO_DOWN, ran, share, track

SHORT = {
    "kind": "staircase", "level": {"column": "x", "from": 0, "to": 9, "points": 10}, "start": 5, "down": 2,
    "step": [2, 1], "stop": {"trials": 30, "reversals": 4}, "last": 4,
}  # fmt: skip


def levels(settings, answers):
    """The levels presented for these answers (h: hit, m: miss), and the next one or the end."""
    adviser, past = StaircaseAdviser(track(settings)), ()
    for answer in answers:
        past = (*past, (adviser.advise(past).index, answer == "h"))
    step = adviser.advise(past)
    return [index for index, _ in past], step if isinstance(step, End) else step.index


@pytest.mark.parametrize(
    ("changes", "answers", "presented", "following"),
    [
        ({}, "hhhhm", [5, 5, 3, 3, 1], 2),  # steps of 2 until the first reversal, then of 1
        ({"down": 1}, "hhm", [5, 3, 1], 2),
        ({"down": 3}, "hhhhh", [5, 5, 5, 3, 3], 3),
        ({"down": 4}, "hhhhm", [5, 5, 5, 5, 3], 4),
        ({"up": 2}, "mhmm", [5, 5, 5, 5], 7),
        ({"down": 1, "weight": 3, "step": 1}, "hm", [5, 4], 7),
        ({"easier": "lower"}, "hhm", [5, 5, 7], 6),
        ({"step": 1}, "m" * 6, [5, 6, 7, 8, 9, 9], 9),
        ({"down": 1}, "hmhmh", [5, 3, 4, 3, 4], End("4 reversals")),
    ],
)
def test_a_staircase_goes_by_its_rule(changes, answers, presented, following):
    assert levels({**SHORT, **changes}, answers) == (presented, following)


@pytest.mark.parametrize(
    ("rule", "target"),
    [({"down": 1}, 0.5), ({}, 0.5**0.5), ({"down": 3}, 0.5 ** (1 / 3)), ({"down": 4}, 0.5**0.25),
     ({"down": 1, "weight": 3}, 0.75), ({"up": 2}, None)],
)  # fmt: skip
def test_the_share_of_hits_that_a_staircase_converges_to(rule, target):
    """Levitt 1971, table 1: 50, 70.7, 79.4 and 84.1 %; Kaernbach 1991: 75 %."""
    assert track({**SHORT, **rule}).procedure.target == target


def test_two_down_one_up_rests_at_its_share_of_hits(full_run):
    """On average within .5 dB of the level with 70.7 % hits, over the last six of eight reversals."""
    of = track(TWO_DOWN, stop={"trials": 400, "reversals": 8}, start=-10, step=[16, 8, 4])
    adviser = StaircaseAdviser(of)
    grid = np.array(of.levels)
    point = grid[np.argmin([abs(share(level) - 0.5**0.5) for level in grid])]
    seeds = range(200 if full_run else 40)
    means = [adviser.estimate(ran(adviser, of, seed=seed)).threshold for seed in seeds]
    assert np.mean(means) == pytest.approx(point, abs=0.5)


def test_always_right_ends_at_the_cap_with_a_statement():
    of = track({**SHORT, "step": 1})
    adviser = StaircaseAdviser(of)
    past = ran(adviser, of, answers=lambda _level: True)
    assert len(past) == 30 and adviser.advise(past) == End("30 trials")
    assert (adviser.estimate(past).outside, adviser.estimate(past).bound) == ("below", 0.0)
    wrong = ran(adviser, of, answers=lambda _level: False)
    assert (adviser.estimate(wrong).outside, adviser.estimate(wrong).bound) == ("above", 9.0)


def test_too_few_reversals_are_no_estimate():
    adviser = StaircaseAdviser(track(SHORT))
    assert adviser.estimate(((5, True), (5, True), (3, False))).outside == "unknown"


def test_the_estimate_is_the_mean_of_the_last_reversals():
    adviser = StaircaseAdviser(track({**SHORT, "down": 1, "step": 1, "last": 2}))
    past = ((5, True), (4, False), (5, True), (4, False), (5, True))
    assert adviser.walk(past).reversals == [4, 5, 4, 5]
    assert (adviser.estimate(past).threshold, adviser.estimate(past).sd) == (4.5, None)
