import math

import numpy as np
import pytest

from palpate.protocols.procedures import procedures_from
from palpate.protocols.study import Stimulus
from palpate.protocols.tracks import Track
from palpate.studies.procedures.adviser import End
from palpate.studies.procedures.model_grid import PARAMETERS, quantiles, rise
from palpate.studies.procedures.questplus import make
from tests.studies.procedures.tracks_for_tests import GRID, MODEL, QUESTPLUS, ran, share, track


@pytest.mark.needs("questplus")
def test_the_choices_are_those_of_questplus_on_the_same_past(full_run):
    """questplus 2023.1: the same levels, and posterior means within 1e-12."""
    from questplus import QuestPlus

    trials = 240 if full_run else 24
    of = track(QUESTPLUS, stop={"trials": trials})
    adviser = make(of)
    reference = QuestPlus(
        stim_domain={"intensity": np.array(of.levels)},
        param_domain={
            "threshold": np.array(of.levels),
            "slope": np.linspace(0.5, 10, 20),
            "lower_asymptote": [0.5],
            "lapse_rate": [0, 0.02, 0.04],
        },
        outcome_domain={"response": ["Correct", "Incorrect"]},
        func="weibull",
        stim_scale="dB",
        stim_selection_method="min_entropy",
        param_estimation_method="mean",
    )
    past = ran(adviser, of)
    assert len(past) == trials
    for index, hit in past:
        assert float(reference.next_stim["intensity"]) == of.levels[index]
        reference.update(stim={"intensity": of.levels[index]}, outcome={"response": "Correct" if hit else "Incorrect"})
    for name in ("threshold", "slope"):
        values, weights = adviser.marginal(past, name)
        assert values @ weights == pytest.approx(reference.param_estimate[name], abs=1e-12)


def test_nuisance_parameters_are_averaged_out_before_the_entropy_is_taken():
    """Against the definition: the entropy of the marginal before, less its expectation after each answer."""
    of = track(QUESTPLUS, interest=["threshold"])
    adviser = make(of)
    past = ran(adviser, of, most=6)
    weights, shape = adviser.posterior(past), adviser.table.shape
    axes = tuple(n for n, name in enumerate(PARAMETERS) if name != "threshold")

    def entropy(masses):
        marginal = masses.reshape(shape).sum(axis=axes)
        return -sum(p * math.log(p) for p in marginal.tolist() if p > 0)

    given = adviser.information(weights)
    for level in (0, 20, 40):
        hit = adviser.table.share[level]
        expected = sum((weights @ p) * entropy(weights * p / (weights @ p)) for p in (hit, 1 - hit))
        assert given[level] == pytest.approx(entropy(weights) - expected, abs=1e-12)


@pytest.mark.parametrize(
    ("shape", "scale", "level", "threshold", "slope", "expected"),
    [
        ("weibull", "db", -18.0, -18.0, 3.0, 1 - math.exp(-1)),
        ("weibull", "db", -12.0, -18.0, 2.0, 1 - math.exp(-(10**0.6))),
        ("weibull", "log10", 0.5, 0.2, 2.0, 1 - math.exp(-(10**0.6))),
        ("weibull", "linear", 3.0, 2.0, 2.0, 1 - math.exp(-((3 / 2) ** 2))),
        ("logistic", "linear", 3.0, 2.0, 2.0, 1 / (1 + math.exp(-2.0))),
        ("gaussian", "linear", 3.0, 2.0, 2.0, 0.5 * math.erfc(-2.0 / math.sqrt(2))),
    ],
)
def test_the_shapes_are_those_of_their_equations(shape, scale, level, threshold, slope, expected):
    value = rise(shape, scale, np.array([level]), np.array([threshold]), np.array([slope]))
    assert value[0] == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("shape", ["logistic", "gaussian"])
def test_hits_may_fall_with_the_level(shape):
    model = {"shape": shape, "threshold": {"from": -40, "to": 0, "points": 41}, "slope": [0.5, 1], "guess": 0.5}
    of = track(QUESTPLUS, model=model, easier="lower")
    adviser = make(of)
    past = ran(adviser, of, most=60, answers=lambda level: level < -25.3)
    assert adviser.estimate(past).threshold == pytest.approx(-25.3, abs=1.0)


def test_a_threshold_that_shifts_with_a_second_dimension_is_measured_in_two():
    second = {"column": "log_frequency", "values": [1.0, 1.5, 2.0]}
    [procedure] = procedures_from(
        {**QUESTPLUS, "level": [GRID, second], "model": {**MODEL, "slope": 3, "lapse": 0.02, "gradient": [-10, -5, 0]}}
    )
    levels = tuple((a, b) for a in procedure.grids[0].levels for b in procedure.grids[1].levels)
    of = Track("t", procedure, levels, (Stimulus(id="t"),), ())
    adviser = make(of)
    past = ran(adviser, of, most=80, answers=lambda level: level[0] + 5 * level[1] > -15)
    values, weights = adviser.marginal(past, "gradient")
    assert weights[values == -5.0][0] > 0.9
    assert len({of.levels[index][1] for index, _ in past}) > 1
    stimulus = of.stimulus_at(4)
    assert stimulus.columns == {"level_db": "-39", "log_frequency": "1.5"}


@pytest.mark.parametrize(
    ("observer", "outside"),
    [
        ({"answers": lambda _level: True}, "below"),
        ({"answers": lambda _level: False}, "above"),
        ({"threshold": -60.0}, "below"),
        ({"threshold": 10.0}, "above"),
    ],
)
@pytest.mark.parametrize("seed", range(5))
def test_an_extreme_observer_gets_an_inequality_and_never_a_number(observer, outside, seed):
    of = track(QUESTPLUS)
    adviser = make(of)
    past = ran(adviser, of, most=64, seed=seed, **observer)
    for n in (1, 8, 32, 64) if "answers" in observer else (64,):
        estimate = adviser.estimate(past[:n])
        assert estimate.threshold is None and estimate.outside in (outside, "unknown")
    assert estimate.outside == outside and str(estimate).startswith(f"threshold {outside} ")
    assert estimate.bound < -30 if outside == "below" else estimate.bound > -10


def test_it_ends_when_sure_enough_and_not_before_the_least_number():
    of = track(QUESTPLUS, stop={"trials": 100, "threshold_sd": 1.5, "at_least": 20})
    adviser = make(of)
    past = ran(adviser, of)
    assert 20 <= len(past) < 100
    assert adviser.estimate(past).sd <= 1.5 < adviser.estimate(past[:-1]).sd or len(past) == 20
    assert adviser.advise(past).why.startswith("SD of the threshold")
    never = make(track(QUESTPLUS, stop={"trials": 30, "threshold_sd": 0.001}))
    assert never.advise(ran(never, of)) == End("30 trials")


def test_the_same_past_gets_the_same_advice_whatever_was_asked_before():
    of = track(QUESTPLUS)
    fresh, used = make(of), make(of)
    past = ran(used, of, most=30)
    for n in (30, 3, 17, 0, 29):
        assert used.advise(past[:n]) == make(of).advise(past[:n])
    assert fresh.estimate(past) == used.estimate(past)


def test_an_answer_that_the_model_excludes_is_not_the_end():
    model = {"shape": "gaussian", "threshold": {"from": -40, "to": 0, "points": 5}, "slope": 10, "guess": 0, "lapse": 0}
    of = track(QUESTPLUS, model=model, stop={"trials": 40})
    adviser = make(of)
    past = tuple((index, index < 20) for index in range(0, 41, 2))
    weights = adviser.posterior(past)
    assert np.isfinite(weights).all() and weights.sum() == pytest.approx(1.0)
    assert adviser.estimate(past).to_dict() and 0 <= adviser.advise(past).index <= 40


def test_quantiles_spread_each_point_over_its_cell():
    values, weights = np.array([0.0, 1.0, 2.0]), np.array([0.25, 0.5, 0.25])
    assert quantiles(values, weights, (0.0, 0.25, 0.5, 1.0)) == pytest.approx((-0.5, 0.5, 1.0, 2.5))


@pytest.mark.long
def test_thresholds_are_unbiased_and_their_intervals_hold():
    """100 observers of 64 trials: the bounds are four standard errors about those of 500 (`bench choices`)."""
    of = track(QUESTPLUS)
    adviser = make(of)
    estimates = [adviser.estimate(ran(adviser, of, most=64, seed=seed)) for seed in range(100)]
    errors = np.array([estimate.threshold for estimate in estimates]) + 18.0
    assert abs(errors.mean()) < 0.3 + 4 * 1.2 / 10 and errors.std() < 1.3 * (1 + 4 / math.sqrt(200))
    covered = sum(low <= -18.0 <= high for low, high in (estimate.interval for estimate in estimates))
    assert covered >= 86
    assert share(-18.0) == pytest.approx(0.5 + 0.48 * (1 - math.exp(-1)))
