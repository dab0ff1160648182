import statistics

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.protocols.events import Ask
from palpate.protocols.plan import compile_plan
from palpate.protocols.simulated_participants.perceiver import Perceiver, z_scores
from palpate.protocols.study import Scale
from palpate.protocols.trial import ParticipantRow
from tests.examples import examples
from tests.protocols.studies_for_tests import toy

QUIET = {"latents": {"Soft": {"size": 2.0, "intercept": 1.0}}, "gain_sd": 0, "bias_sd": 0, "noise_sd": 0}


def perceiver(participant="P001", seed=0, scale=None, **simulation):
    study = toy(simulation={**QUIET, **simulation}, **({"scale": scale} if scale else {}))
    return Perceiver(compile_plan(study, ParticipantRow(participant), seed))


def answers(person):
    replies = [person.answer(Ask(trial.form, trial))[0].value for trial in person.plan.trials]
    return {t.stimulus.id: r["answers"] for t, r in zip(person.plan.trials, replies, strict=True)}


def test_without_noise_the_answer_is_the_latent_on_the_scale():
    """z of 0..3 is (i - 1.5) / sqrt(1.25), so the latent is 1 + 2 z, rounded to steps of 1."""
    by_stimulus = answers(perceiver())
    assert [by_stimulus[name]["Soft"] for name in "ABCD"] == [-2, 0, 2, 4]
    assert {value["Cold"] for value in by_stimulus.values()} == {0}
    assert all(type(value["Soft"]) is int for value in by_stimulus.values())


def test_answers_do_not_depend_on_what_was_answered_before():
    person = perceiver(noise_sd=3.0, lapse_rate=0.3)
    last = Ask(person.plan.trials[-1].form, person.plan.trials[-1])
    alone = person.answer(last)
    answers(person)
    assert person.answer(last) == alone == perceiver(noise_sd=3.0, lapse_rate=0.3).answer(last)


def test_people_and_seeds_differ():
    def noisy(**who):
        return answers(perceiver(**who, bias_sd=3.0, noise_sd=3.0))

    assert noisy() != noisy(participant="P002") != noisy(participant="P002", seed=1)


def spread(draw):
    values = [draw(perceiver(f"P{n}", gain_sd=0.2, bias_sd=2.0)) for n in range(600)]
    return statistics.fmean(values), statistics.stdev(values)


def test_gain_and_bias_spread_as_declared():
    soft = perceiver().plan.study.attributes[0]
    assert spread(lambda p: p.gain(soft)) == pytest.approx((1.0, 0.2), abs=0.03)
    assert spread(lambda p: p.bias(soft)) == pytest.approx((0.0, 2.0), abs=0.3)


def test_gain_never_turns_the_scale_round():
    soft = perceiver().plan.study.attributes[0]
    assert min(perceiver(f"P{n}", gain_sd=5).gain(soft) for n in range(50)) == 0.1


def test_lapses_come_at_their_rate_and_fill_the_scale():
    values, lapsed = [], 0
    for number in range(400):
        person = perceiver(f"P{number}", lapse_rate=0.25)
        ask = Ask(person.plan.trials[0].form, person.plan.trials[0])
        lapsed += person.lapses(ask, person.plan.study.attributes[1])
        values.append(person.answer(ask)[0].value["answers"]["Cold"])
    assert lapsed == pytest.approx(100, abs=30)
    assert sum(value != 0 for value in values) <= lapsed
    assert min(values) < -8 and max(values) > 8 and set(values) <= set(range(-10, 11))


def test_second_thoughts_only_where_they_are_allowed():
    person = perceiver(revise_rate=1.0)
    first, second = (person.answer(Ask(trial.form, trial))[0].value for trial in person.plan.trials[:2])
    assert "answers" in first and second["go"] == "back"


def test_a_continuous_scale_is_answered_to_four_decimals():
    by_stimulus = answers(perceiver(scale={"from": 0, "to": 100}))
    assert by_stimulus["A"]["Soft"] == round(50 + 1 + 2 * -1.5 / 1.25**0.5, 4)


def test_answers_are_clipped_to_the_scale():
    by_stimulus = answers(perceiver(latents={"Soft": {"size": 100.0}}))
    assert by_stimulus["A"]["Soft"] == -10 and by_stimulus["D"]["Soft"] == 10


def test_a_study_without_simulation_is_answered_by_noise():
    person = Perceiver(compile_plan(toy(simulation=None), ParticipantRow("P001")))
    assert len(answers(person)) == 4


def test_a_constant_column_says_nothing():
    study = toy(stimuli=[{"id": n, "columns": {"size": "3"}} for n in "AB"], simulation=None)
    assert z_scores(study.stimuli, "size") == {"A": 0.0, "B": 0.0}


@pytest.mark.parametrize(
    ("scale", "value", "nearest", "holds"),
    [
        ({"from": -10, "to": 10, "step": 1}, 3.4, 3, False),
        ({"from": -10, "to": 10, "step": 1}, -10, -10, True),
        ({"from": 0, "to": 1, "step": 0.1}, 0.1 + 0.2, 0.3, True),
        ({"from": 0, "to": 100}, 33.33333, 33.3333, True),
        ({"from": 0, "to": 100}, 100.01, 100.0, False),
    ],
)
def test_a_scale_knows_its_answers(scale, value, nearest, holds):
    parsed = Scale.model_validate(scale)
    assert parsed.nearest(value) == nearest
    assert parsed.holds(value) is holds
    assert parsed.holds(parsed.nearest(value))


@pytest.mark.parametrize("value", [None, "1", True, float("nan"), float("inf"), [1]])
def test_a_scale_refuses_what_is_no_number(value):
    assert not Scale.model_validate({"from": 0, "to": 1}).holds(value)


@settings(max_examples=examples(300))
@given(
    low=st.integers(-500, 500).map(lambda n: n / 10) | st.integers(-100, 100),
    steps=st.integers(1, 200),
    step=st.sampled_from([1, 2, 0.1, 0.25, 0.5, 0.01, 1e-6, 3]),
    share=st.floats(0, 1),
    continuous=st.booleans(),
)
def test_the_nearest_answer_of_any_scale_is_an_answer(low, steps, step, share, continuous):
    high = low + steps * step
    scale = Scale.model_validate({"from": low, "to": high, **({} if continuous else {"step": step})})
    nearest = scale.nearest(low + share * (high - low))
    assert scale.holds(nearest) and low <= nearest <= high
    assert abs(nearest - (low + share * (high - low))) <= (1e-4 * max(1, high - low) if continuous else 0.51 * step)


def test_tenths_are_answered_as_they_are_written():
    scale = Scale.model_validate({"from": 0.1, "to": 0.7, "step": 0.1})
    assert [scale.nearest(n / 10) for n in range(8)] == [0.1, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]


def test_a_stimulus_outside_the_study_is_felt_on_the_scale_of_its_stimuli():
    """Sizes 0..3 have mean 1.5 and SD sqrt(1.25); 5.5 is (5.5 - 1.5) / SD away, and the study's own size 2 stays it."""
    person = perceiver()
    assert person.latent_of("Soft", {"size": 5.5, "other": 9.0}) == pytest.approx(1 + 2 * 4 / 1.25**0.5)
    assert person.latent_of("Soft", {"size": 2.0}) == person.latent("Soft", person.plan.study.stimuli[2])
    with pytest.raises(ValueError, match="Soft is felt by size, which this stimulus does not have"):
        person.latent_of("Soft", {"other": 1.0})


def test_a_rating_outside_a_session_is_keyed_by_its_moment():
    person = perceiver(noise_sd=3.0)
    soft, scale = person.plan.study.attributes[0], person.plan.study.scale
    once = [person.rating(0.0, soft, scale, ("felt", name)) for name in "abcdefgh"]
    assert once == [person.rating(0.0, soft, scale, ("felt", name)) for name in "abcdefgh"]
    assert len(set(once)) > 2
