"""Psychometric functions are R's and psignifit's, find a simulated observer again, and refuse what tells nothing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import expit, ndtr

from benchmarks.thresholds import OBSERVERS, SD, THRESHOLD, Observer, fitted_sets, missed
from benchmarks.thresholds import simulated as simulated_sets
from palpate.analysis.choices.intervals import profile_interval, resampled_answers
from palpate.analysis.choices.posterior import posterior
from palpate.analysis.choices.psychometric import fit_psychometric
from palpate.analysis.statistics.refusals import BadOption, BadValue, NoEstimate, TooFew
from tests.analysis.choices.choices_for_tests import in_r
from tests.examples import examples

SHAPE = {"logit": "logistic", "probit": "gaussian", "cloglog": "weibull"}
PLAIN = list(in_r()["plain"])
PLAIN_RATES: dict[str, Any] = {"task": "yes_no", "guess": 0, "lapse": 0}
OF_TWO: dict[str, Any] = {"task": "forced_choice", "alternatives": 2}
PSIGNIFIT = json.loads((Path(__file__).parents[1] / "data" / "psignifit" / "psignifit.json").read_text())["fits"]


def table(name: str) -> pd.DataFrame:
    return pd.DataFrame(in_r()["sets"][name])


def answers(levels: list[float], hits: list[int], n: int = 20) -> pd.DataFrame:
    return pd.DataFrame({"level": levels, "k": hits, "n": n})


@pytest.mark.parametrize("name", PLAIN)
def test_the_plain_fit_is_the_glm_of_r(name: str) -> None:
    expected = in_r()["plain"][name]
    result = fit_psychometric(
        table(expected["set"]), "level", "k", "n", function=SHAPE[expected["link"]], **PLAIN_RATES
    )
    half = np.log(result.threshold) if expected["link"] == "cloglog" else result.threshold
    assert half == pytest.approx(expected["half"], rel=1e-8)
    assert 1 / result.spread == pytest.approx(expected["slope"], rel=1e-8)
    assert -result.centre / result.spread == pytest.approx(expected["intercept"], rel=1e-8)
    assert result.log_likelihood == pytest.approx(expected["loglik"], rel=1e-10)
    assert (result.deviance, result.df) == (pytest.approx(expected["deviance"], rel=1e-9), expected["df"])


@pytest.mark.parametrize("name", PLAIN)
def test_the_profile_interval_is_where_the_deviance_of_r_says(name: str) -> None:
    expected = in_r()["plain"][name]
    result = fit_psychometric(
        table(expected["set"]), "level", "k", "n", function=SHAPE[expected["link"]], **PLAIN_RATES
    )
    ends = np.array(profile_interval(result, "threshold", draws=0)[:2])
    assert (np.log(ends) if expected["link"] == "cloglog" else ends) == pytest.approx(expected["half_ci"], rel=1e-7)
    if expected["link"] != "cloglog":
        unit = result.jnd / result.spread
        slopes = sorted(unit / end for end in profile_interval(result, "jnd", draws=0)[:2])
        assert slopes == pytest.approx(expected["slope_ci"], rel=1e-7)


@pytest.mark.parametrize(
    ("key", "function"), [("logistic", "logistic"), ("gaussian", "gaussian"), ("logistic_none", "logistic")]
)
def test_two_alternatives_give_the_optimum_of_r(key: str, function: str) -> None:
    expected = in_r()["two_choice"][key]
    result = fit_psychometric(
        table("two_choice"), "level", "k", "n", function=function, **OF_TWO, lapse=expected["lapse"]
    )
    assert result.log_likelihood == pytest.approx(expected["loglik"], abs=1e-9)
    assert (result.centre, result.spread) == (
        pytest.approx(expected["centre"], rel=1e-6),
        pytest.approx(expected["spread"], rel=1e-6),
    )


def test_threshold_and_jnd_are_what_their_names_say() -> None:
    result = fit_psychometric(table("yes_no"), "level", "k", "n", function="gaussian", **PLAIN_RATES, jnd="x84_x50")
    assert result.jnd == pytest.approx(result.spread, rel=1e-12)
    assert result.slope == pytest.approx(1 / result.spread / np.sqrt(2 * np.pi))
    weibull = fit_psychometric(table("two_choice"), "level", "k", "n", function="weibull", **OF_TWO, threshold=0.75)
    at = 0.5 + (0.5 - weibull.lapse) * -np.expm1(
        -((weibull.threshold / np.exp(weibull.centre)) ** (1 / weibull.spread))
    )
    assert at == pytest.approx(weibull.share_at)
    level = [np.exp(weibull.centre) * (-np.log1p(-p)) ** weibull.spread for p in (0.75, 0.25)]
    assert weibull.jnd == pytest.approx((level[0] - level[1]) / 2)


@settings(max_examples=examples(12), deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([(1.0, 0.0), (1024.0, 0.0), (0.001, 5.0), (1.0, 1e6), (-1.0, 0.0)]))
def test_order_counting_unit_and_direction_change_nothing(seed: int, moved: tuple[float, float]) -> None:
    scale, shift = moved
    counts = table("uneven")
    trials = pd.DataFrame(
        [(level, i < k) for level, n, k in counts[["level", "n", "k"]].itertuples(index=False) for i in range(int(n))],
        columns=["level", "hit"],
    ).sample(frac=1, random_state=seed)
    one = fit_psychometric(counts, "level", "k", "n", task="yes_no")
    moved_trials = trials.assign(level=trials["level"] * scale + shift)
    two = fit_psychometric(moved_trials, "level", "hit", task="yes_no", falling=scale < 0)
    assert (two.threshold - shift) / scale == pytest.approx(one.threshold, rel=1e-7)
    assert two.jnd / abs(scale) == pytest.approx(one.jnd, rel=1e-6)
    assert two.deviance == pytest.approx(one.deviance, rel=1e-7)


def test_answers_that_tell_no_threshold_are_refused_with_a_reason() -> None:
    levels = [1.0, 2.0, 3.0, 4.0]
    with pytest.raises(NoEstimate, match="every answer was a hit: the threshold lies below"):
        fit_psychometric(answers(levels, [20, 20, 20, 20]), "level", "k", "n", **OF_TWO)
    with pytest.raises(NoEstimate, match="no answer was a hit"):
        fit_psychometric(answers(levels, [0, 0, 0, 0]), "level", "k", "n", task="symmetric")
    with pytest.raises(NoEstimate, match="between levels 2 and 3"):
        fit_psychometric(answers(levels, [0, 0, 20, 20]), "level", "k", "n", task="symmetric")
    with pytest.raises(NoEstimate, match="between levels 1 and 3"):
        fit_psychometric(answers(levels, [0, 7, 20, 20]), "level", "k", "n", task="symmetric", lapse=0)
    with pytest.raises(NoEstimate, match="does not rise"):
        fit_psychometric(answers(levels, [10, 10, 10, 10]), "level", "k", "n", task="symmetric")
    with pytest.raises(NoEstimate, match="`falling`"):
        fit_psychometric(answers(levels, [18, 13, 8, 2]), "level", "k", "n", task="symmetric")
    with pytest.raises(NoEstimate):
        fit_psychometric(answers(levels, [10, 11, 9, 8]), "level", "k", "n", **OF_TWO)


def test_wrong_tables_and_options_are_refused() -> None:
    good = table("yes_no")
    with pytest.raises(TooFew, match="1 level"):
        fit_psychometric(answers([1.0], [3]), "level", "k", "n", task="symmetric")
    with pytest.raises(BadValue, match="50 of 40 in row 1"):
        fit_psychometric(good.assign(k=50), "level", "k", "n", task="symmetric")
    with pytest.raises(BadValue, match="above 0"):
        fit_psychometric(good.assign(level=good["level"] - 1), "level", "k", "n", task="yes_no", function="weibull")
    with pytest.raises(BadValue, match="no value in row 2"):
        fit_psychometric(good.assign(level=good["level"].mask(good["level"] == 2)), "level", "k", "n", task="symmetric")
    for options in ({"function": "probit"}, {"jnd": "sd"}, {"threshold": 1.0}, {"guess": (0.5, 0.1)}, {"guess": 0.99}):
        with pytest.raises(BadOption):
            fit_psychometric(good, "level", "k", "n", task="yes_no", **options)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"task": "2AFC"}, "'symmetric', 'forced_choice', 'yes_no'"),
        ({"task": "symmetric", "guess": 0.1}, "give `lapse`"),
        ({"task": "symmetric", "alternatives": 2}, "except with task='forced_choice'"),
        ({"task": "symmetric", "lapse": (0, 0.6)}, "no room"),
        ({"task": "forced_choice"}, "a forced choice needs their number"),
        ({"task": "forced_choice", "alternatives": 2, "guess": 0.5}, "it is 1 / alternatives"),
        ({"task": "yes_no", "alternatives": 3}, "no effect"),
    ],
)
def test_a_rate_that_the_task_decides_is_refused(options: dict, reason: str) -> None:
    for fit in (fit_psychometric, posterior):
        with pytest.raises(BadOption, match=reason):
            fit(table("yes_no"), "level", "k", "n", **options)


@pytest.mark.parametrize(
    ("options", "assumed"),
    [
        ({"task": "symmetric"}, "symmetric task, equal lapse rates on both sides, estimated between 0 and 0.25"),
        ({"task": "symmetric", "lapse": 0}, "symmetric task, no lapses"),
        (
            {"task": "forced_choice", "alternatives": 3, "lapse": 0.02},
            "forced choice, guess rate fixed at 1/3, lapse rate fixed at 0.02",
        ),
        (
            {"task": "yes_no", "guess": 0},
            "yes/no task, guess rate fixed at 0, lapse rate estimated between 0 and 0.25",
        ),
    ],
)
def test_the_result_says_what_the_task_made_of_the_rates(options: dict, assumed: str) -> None:
    result = fit_psychometric(table("two_choice"), "level", "k", "n", **options)
    assert result.assumed == assumed
    if options["task"] == "symmetric":
        assert result.guess == result.lapse
    if "alternatives" in options:
        assert (result.guess, result.lapse) == (1 / 3, 0.02)


def test_lapses_to_both_sides_are_one_rate_in_likelihood_posterior_and_step() -> None:
    """The best of all pairs of equal rates on a grid; and a mirrored observer has the mirrored threshold."""
    both = answers([1.0, 2, 3, 4, 5, 6, 7], [3, 2, 6, 21, 34, 37, 38], 40)
    result = fit_psychometric(both, "level", "k", "n", task="symmetric")
    fixed = [
        fit_psychometric(both, "level", "k", "n", task="symmetric", lapse=rate).log_likelihood
        for rate in (*np.linspace(0.02, 0.12, 11), result.lapse)
    ]
    assert max(fixed[:-1]) <= fixed[-1] == pytest.approx(result.log_likelihood, rel=1e-12)
    apart = fit_psychometric(both, "level", "k", "n", task="yes_no", guess=result.guess, lapse=result.lapse)
    assert (apart.threshold, apart.log_likelihood) == pytest.approx((result.threshold, result.log_likelihood), rel=1e-9)
    mirrored = answers([1.0, 2, 3, 4, 5, 6, 7], [2, 3, 6, 19, 34, 38, 37], 40)
    assert fit_psychometric(mirrored, "level", "k", "n", task="symmetric").threshold == pytest.approx(
        8 - result.threshold, rel=1e-7
    )
    bayes = posterior(both, "level", "k", "n", task="symmetric", overdispersed=False)
    assert bayes.guess == bayes.lapse == pytest.approx(result.lapse, abs=0.02)
    assert bayes.threshold == pytest.approx(result.threshold, abs=0.1)
    with pytest.raises(NoEstimate, match="step from one side to the other between levels 3 and 4"):
        fit_psychometric(answers([1.0, 2, 3, 4, 5, 6], [1, 1, 1, 19, 19, 19]), "level", "k", "n", task="symmetric")


def simulated(rng: np.random.Generator, guess: float, lapse: float, n: int = 40) -> pd.DataFrame:
    levels = np.linspace(2, 10, 9)
    share = guess + (1 - guess - lapse) * ndtr((levels - 6) / 1.5)
    return pd.DataFrame({"level": levels, "k": rng.binomial(n, share), "n": n})


@pytest.mark.parametrize("observer", OBSERVERS, ids=lambda observer: observer.name)
def test_a_simulated_observer_is_found_again_and_intervals_hold_the_threshold(
    observer: Observer, full_run: bool
) -> None:
    """Tolerances are 3.5 standard errors; `bench thresholds` gives the figures of 1,000 data sets."""
    count, draws = (150, 60) if full_run else (60, 25)
    sets = fitted_sets(observer.declared(), simulated_sets(observer, count, 100), 100)
    assert sets.refused <= 0.02 * count
    error = sets.thresholds.std() / np.sqrt(count)
    assert abs(sets.thresholds.mean() - THRESHOLD) < 3.5 * error
    assert abs(np.median(sets.jnds) - SD) < 3.5 * 1.2533 * sets.jnds.std() / np.sqrt(count)
    assert missed(sets.ends("threshold", draws, range(count)), THRESHOLD) < 0.05 + 3.5 * np.sqrt(0.05 * 0.95 / count)
    if observer.task == "symmetric" and observer.lapse:
        before = fitted_sets(observer.undeclared(), simulated_sets(observer, count, 100), 100)
        assert before.thresholds.mean() < THRESHOLD - 0.15


def test_the_interval_of_one_fit_is_that_of_many_and_bartletts_factor_only_widens() -> None:
    observer = OBSERVERS[3]
    sets = fitted_sets(observer.declared(), simulated_sets(observer, 3, 40), 40)
    many = sets.ends("threshold", 50, (7, 7, 7))
    for hits, ends in zip(sets.problem.hits, many, strict=True):
        data = pd.DataFrame({"level": sets.data.levels, "k": hits, "n": 40})
        fit = fit_psychometric(data, "level", "k", "n", function="gaussian", **OF_TWO)
        plain, result = (profile_interval(fit, "threshold", 0.95, *how) for how in ((0,), (50, 7)))
        assert result[:2] == pytest.approx(ends, rel=1e-6)
        assert result.low <= plain.low < plain.high <= result.high
    with pytest.raises(BadOption, match="no effect with draws=0"):
        profile_interval(fit, "threshold", draws=0, seed=3)


def test_profile_bootstrap_and_posterior_agree_where_data_are_many() -> None:
    many = simulated(np.random.default_rng(3), 0.0, 0.0, 300)
    result = fit_psychometric(many, "level", "k", "n", function="gaussian", **PLAIN_RATES)
    profile, again = profile_interval(result, "threshold"), resampled_answers(result, 500)
    bayes = posterior(many, "level", "k", "n", function="gaussian", **PLAIN_RATES, overdispersed=False)
    width = profile.high - profile.low
    assert again.threshold[:2] == pytest.approx(profile[:2], abs=0.15 * width)
    assert bayes.threshold_interval == pytest.approx(profile[:2], abs=0.1 * width)
    assert bayes.threshold == pytest.approx(result.threshold, abs=0.05 * width)
    assert again.p_deviance > 0.01
    assert again == resampled_answers(result, 500)


def test_a_misfit_shows_in_the_deviance() -> None:
    bent = answers([1, 2, 3, 4, 5, 6.0], [2, 90, 40, 45, 95, 97], 100)
    assert resampled_answers(fit_psychometric(bent, "level", "k", "n", task="symmetric"), 199).p_deviance == 1 / 200


def test_a_unit_of_1e_200_changes_nothing_and_a_step_leaves_the_jnd_open_from_below() -> None:
    small = table("uneven").assign(level=table("uneven")["level"] * 2.0**-600)
    tiny = fit_psychometric(small, "level", "k", "n", task="yes_no")
    assert tiny.threshold * 2.0**600 == fit_psychometric(table("uneven"), "level", "k", "n", task="yes_no").threshold
    few = fit_psychometric(
        answers([1, 2.0], [1, 2], 3), "level", "k", "n", task="yes_no", guess=(0, 0.2), lapse=(0, 0.06)
    )
    result = profile_interval(few, "jnd", draws=0)
    assert np.isnan(result.low)
    assert "from below" in result.note


def test_falling_answers_have_the_mirrored_interval() -> None:
    turned = table("yes_no").assign(level=-table("yes_no")["level"])
    rising = fit_psychometric(table("yes_no"), "level", "k", "n", task="yes_no")
    mirror = fit_psychometric(turned, "level", "k", "n", task="yes_no", falling=True)
    low, high, _ = profile_interval(rising, "threshold")
    assert profile_interval(mirror, "threshold")[:2] == pytest.approx((-high, -low), rel=1e-9)


def test_an_end_that_the_data_do_not_bound_is_open() -> None:
    few = answers([1, 2, 3, 4.0], [1, 2, 2, 3], 4)
    result = profile_interval(fit_psychometric(few, "level", "k", "n", **PLAIN_RATES), "jnd")
    assert np.isnan(result.high)
    assert "from above" in result.note


@pytest.mark.parametrize("expected", PSIGNIFIT, ids=lambda fit: f"{fit['set']} {fit['sigmoid']}")
def test_the_posterior_is_that_of_psignifit(expected: dict) -> None:
    """psignifit's grid has 20 to 40 steps an axis and reports its percentiles on them."""
    weibull = expected["sigmoid"] == "weibull"
    task = OF_TWO if expected["experiment"] == "2AFC" else {"task": "yes_no"}
    function = "weibull" if weibull else "gaussian"
    result = posterior(table(expected["set"]), "level", "k", "n", function=function, **task)
    mean, ends = expected["mean"], expected["ci95"]["threshold"]
    assert result.width == pytest.approx(mean["width"], rel=0.005)
    assert (result.lapse, result.eta) == (pytest.approx(mean["lambda"], abs=6e-4), pytest.approx(mean["eta"], abs=2e-3))
    ours = np.log(result.threshold_interval) if weibull else result.threshold_interval
    assert ours == pytest.approx(ends, abs=0.06 * (ends[1] - ends[0]))
    if not weibull:
        assert result.threshold == pytest.approx(mean["threshold"], rel=2e-3)
        assert result.guess == pytest.approx(mean["gamma"], abs=1e-3)


def test_a_step_has_a_posterior_though_no_slope() -> None:
    step = answers([1.0, 2.0, 3.0, 4.0, 5.0], [0, 0, 20, 20, 20])
    result = posterior(step, "level", "k", "n", task="yes_no", guess=0, overdispersed=False)
    assert 2 < result.threshold_interval[0] < result.threshold < result.threshold_interval[1] < 3
    assert expit(0) == 0.5
