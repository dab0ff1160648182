"""Staircases: Levitt's example of rules, reversals counted by hand, and the convergence that theory says."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.special import ndtr, ndtri

from palpate.analysis.choices.psychometric import fit_psychometric
from palpate.analysis.choices.staircase import staircase
from palpate.analysis.statistics.refusals import BadOption, BadValue, NoEstimate, TooFew


def track(levels: list[float], hits: list[int]) -> pd.DataFrame:
    return pd.DataFrame({"level": levels, "correct": hits, "trial": range(1, len(levels) + 1)})


def run(
    rng: np.random.Generator, down: int, up: int, trials: int = 300, steps: tuple[float, float] = (0.5, 0.5)
) -> pd.DataFrame:
    """An observer with P(hit) = .5 + .5 Phi((level - 6) / 2)."""
    level, right, wrong, rows = 10.0, 0, 0, []
    for _ in range(trials):
        hit = rng.random() < 0.5 + 0.5 * ndtr((level - 6) / 2)
        rows.append((level, int(hit)))
        right, wrong = (right + 1, 0) if hit else (0, wrong + 1)
        if right == down or wrong == up:
            level += -steps[0] if right == down else steps[1]
            right = wrong = 0
    return track(*map(list, zip(*rows, strict=True)))


def test_reversals_by_hand() -> None:
    result = staircase(track([5, 4, 3, 3, 4, 5, 4, 3, 4], [1, 1, 1, 0, 0, 1, 1, 0, 0]), "level", "correct", last=2)
    assert result.reversals.to_numpy().tolist() == [
        [4, 3.0, "valley", False],
        [6, 5.0, "peak", True],
        [8, 3.0, "valley", True],
    ]
    assert (result.threshold, result.used) == (4.0, 2)


@pytest.mark.parametrize(
    ("down", "up", "rest"), [(1, 1, 0.5), (2, 1, 0.5**0.5), (3, 1, 0.5 ** (1 / 3)), (4, 1, 0.5**0.25), (2, 2, 0.5)]
)
def test_the_rule_is_derived_from_the_trials(down: int, up: int, rest: float) -> None:
    rule = staircase(run(np.random.default_rng(2), down, up), "level", "correct").rule
    assert (rule.down, rule.up, rule.followed) == (down, up, 1.0)
    assert rule.converges_at == pytest.approx(rest, abs=1e-12)  # Levitt 1971, table 1


def test_unequal_steps_move_the_convergence() -> None:
    rule = staircase(run(np.random.default_rng(2), 2, 1, steps=(0.5, 1.5)), "level", "correct").rule
    assert (rule.down_step, rule.up_step) == (0.5, 1.5)
    assert rule.converges_at == pytest.approx(0.75**0.5)


def test_two_staircases_in_one_table_are_recognised_by_the_leap_between_them() -> None:
    rng = np.random.default_rng(2)
    one, two = run(rng, 2, 1, 100), run(rng, 2, 1, 100)
    both = staircase(pd.concat([one, two], ignore_index=True), "level", "correct")
    assert any("before trial 101, more than twice" in note for note in both.notes)
    unequal = run(rng, 2, 1, 100, steps=(0.5, 1.5))
    assert [staircase(table, "level", "correct").notes for table in (one, two, unequal)] == [(), (), ()]


def test_an_observers_70_7_percent_is_found_by_reversals_and_by_the_fit() -> None:
    rng = np.random.default_rng(5)
    true = 6 + 2 * float(ndtri((0.5**0.5 - 0.5) / 0.5))
    reversals, fits = [], []
    of_two = {"task": "forced_choice", "alternatives": 2, "function": "gaussian"}
    for _ in range(60):
        trials = run(rng, 2, 1, 120)
        reversals.append(staircase(trials, "level", "correct", last=20).threshold)
        try:
            fits.append(fit_psychometric(trials, "level", "correct", **of_two, lapse=0, threshold=0.5**0.5 * 2 - 1))
        except NoEstimate:
            continue
    assert np.mean(reversals) == pytest.approx(true, abs=0.3)
    assert len(fits) >= 58
    assert np.median([fit.threshold for fit in fits]) == pytest.approx(true, abs=0.3)


def test_the_order_of_rows_does_not_matter_when_trials_are_numbered() -> None:
    trials = run(np.random.default_rng(1), 2, 1)
    one = staircase(trials, "level", "correct", "trial")
    two = staircase(trials.sample(frac=1, random_state=1), "level", "correct", "trial")
    assert one.reversals.equals(two.reversals)
    assert one.rule == two.rule


def test_moves_without_a_rule_say_so() -> None:
    rng = np.random.default_rng(3)
    random = track(rng.integers(1, 9, 60).astype(float).tolist(), rng.integers(0, 2, 60).tolist())
    result = staircase(random, "level", "correct")
    assert result.rule is None
    assert "no up-down rule" in result.notes[-1]


def test_what_is_no_staircase_is_refused() -> None:
    with pytest.raises(NoEstimate, match="never|all 4 trials"):
        staircase(track([3, 3, 3, 3], [1, 0, 1, 0]), "level", "correct")
    with pytest.raises(TooFew, match="0 reversals"):
        staircase(track([4, 3, 2, 1], [1, 1, 1, 1]), "level", "correct")
    with pytest.raises(BadOption, match="even"):
        staircase(track([4, 3, 4, 3], [1, 0, 1, 0]), "level", "correct", last=5)
    with pytest.raises(BadValue, match="0 or 1"):
        staircase(track([4, 3, 4, 3], [1, 0, 1, 2]), "level", "correct")
    with pytest.raises(BadValue, match="one staircase"):
        staircase(track([4, 3, 4, 3], [1, 0, 1, 0]).assign(trial=1), "level", "correct", "trial")
