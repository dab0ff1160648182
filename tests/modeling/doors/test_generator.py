"""The generator that is trained in the loop: from a wish to a door that is felt as wished, or to the nearest one."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from palpate.modeling.doors.generator import (
    GENERATOR,
    MOST_FOREIGN,
    Recipe,
    Teacher,
    code_of,
    fit_by,
    foreign_to,
    open_fully,
    plausible_profiles,
)
from palpate.modeling.doors.generator_networks import Generator, Size, random_wishes
from palpate.modeling.doors.plausibility import corners, extremes, singles, unplayable
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.modeling.training.seeding import seeded
from tests.modeling.doors.network_learning import SEEN, data_of, felt, learning, run_by_numpy

pytestmark = pytest.mark.needs("torch")

TINY = Recipe(
    components=6, profiles=150, own=60, rounds=1,
    size=Size(student=24, generator=16, student_epochs=12, generator_epochs=12, wishes=768, batch=64),
)  # fmt: skip


class Knows:
    """A forward model that is right: the rules by which the small data set was rated."""

    def __init__(self, scaling):
        self.scaling = scaling

    def predict(self, given):
        return self.scaling.rating_up(felt(given))


def given(data=None, seed=5, **settings):
    plain = learning(train=data, seed=seed, **settings)
    return replace(plain, forward=Knows(plain.scaling))


@pytest.fixture(scope="module")
def learned():
    return given()


@pytest.fixture(scope="module")
def fitted(learned):
    return fit_by(TINY, learned)


def test_wishes_that_can_be_had_come_nearer_than_by_any_measured_door(learned, fitted):
    """The mean of all ratings is what a model gives that has learned nothing of wishes."""
    wish = learned.scaling.rating_up(learned.measured.rating)
    off = np.abs(learned.forward.predict(fitted.predict(wish)) - wish).mean()
    assert off < 0.5 * np.abs(wish.mean(axis=0) - wish).mean()


def test_every_corner_and_every_single_end_plays(learned, fitted):
    wishes = np.r_[corners(7), singles(7)]
    answers_at_ends = extremes(fitted, wishes, learned.forward, learned.measured.force_N)
    assert unplayable(answers_at_ends) == 0
    assert all(
        end.plausibility.greatest_N <= 60 and end.plausibility.steepest_N_deg <= 60 + 1e-9 for end in answers_at_ends
    )


def test_beyond_the_scale_a_wish_counts_as_its_end_and_far_off_it_is_refused(fitted):
    ends = np.array([[0.0, 100, 50, 50, 50, 50, 50]])
    assert np.array_equal(fitted.predict(ends), fitted.predict(ends + np.array([-9, 9, 0, 0, 0, 0, 0])))
    for bad, words in ((np.full((1, 7), 500.0), "500"), (np.full((1, 6), 5.0), "7 numbers"), (ends * np.nan, "nan")):
        with pytest.raises(ModelDataError, match=words):
            fitted.predict(bad)


def test_a_small_move_of_a_slider_is_a_small_change_of_the_door(fitted):
    wishes = np.tile(np.full(7, 50.0), (101, 1))
    wishes[:, 3] = np.arange(101)
    steps = np.abs(np.diff(fitted.predict(wishes), axis=0)).max(axis=1)
    assert 0 < steps.max() < 2.0


def test_its_steps_answer_as_it_does(fitted):
    wish = np.random.default_rng(2).uniform(0, 100, (9, 7))
    wish[0] = 0
    assert run_by_numpy(fitted.exported(), 7, 621).run(wish) == pytest.approx(fitted.predict(wish), abs=1e-9)


def test_equal_seeds_are_bit_equal_whatever_the_order_of_the_rows_and_others_are_not(learned, fitted):
    brief = replace(TINY, profiles=40, own=20, size=replace(TINY.size, student_epochs=2, generator_epochs=2))
    wish = learned.scaling.rating_up(learned.measured.rating)
    mixed = data_of(SEEN).rows(np.random.default_rng(1).permutation(len(SEEN)))
    first, again, other = (fit_by(brief, one).predict(wish) for one in (learned, given(mixed), given(seed=6)))
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    assert not np.array_equal(fitted.predict(wish), first)


def test_a_training_that_was_cut_off_and_resumed_comes_to_the_same_result(tmp_path):
    brief = replace(TINY, profiles=40, own=20, size=replace(TINY.size, student_epochs=3, generator_epochs=3))
    wish = np.full((1, 7), 30.0)
    whole = fit_by(brief, given()).predict(wish)
    lines = []

    def cut(line):
        lines.append(line)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fit_by(brief, replace(given(checkpoint=tmp_path), report=cut))
    assert len(lines) == 1 and np.array_equal(fit_by(brief, given(checkpoint=tmp_path)).predict(wish), whole)


def test_a_quick_trial_takes_the_small_recipe(learned, monkeypatch):
    from palpate.modeling.doors import generator

    taken = []
    monkeypatch.setattr(generator, "fit_by", lambda recipe, _learning: taken.append(recipe))
    for settings in ({}, {"quick": True}):
        GENERATOR.fit(replace(learned, settings=settings))
    assert taken == [Recipe(), generator.QUICK] and GENERATOR.needs_forward is not None


def test_without_a_forward_model_or_with_equal_doors_it_is_refused(learned):
    with pytest.raises(ModelDataError, match="learns from a forward model"):
        GENERATOR.fit(replace(learned, forward=None))
    still = data_of(SEEN[:2], force_N=np.zeros((2, 621)), rating=np.arange(14.0).reshape(2, 7))
    with pytest.raises(ModelDataError, match="all profiles to learn from are equal"):
        fit_by(TINY, replace(learned, measured=still, train=still))


def test_two_doors_are_enough_to_make_playable_ones(learned):
    two = learned.measured.rows(np.array([0, 5]))
    generated = fit_by(replace(TINY, profiles=30, rounds=0), replace(learned, measured=two)).predict(corners(7))
    assert np.isfinite(generated).all() and np.abs(generated).max() <= 60


def test_plausible_doors_are_like_measured_ones_and_the_code_holds_them():
    doors = open_fully(data_of(SEEN).force_N)
    generated = plausible_profiles(doors, 80, np.random.default_rng(3))
    assert (
        generated.shape == (80, 621) and generated.max() <= 1.4 * doors.max() and generated.min() >= 1.4 * doors.min()
    )
    codes = [code_of(generated, components) for components in (4, 12, 40)]
    code = codes[1]
    assert np.std(code.encoded(generated), axis=0) == pytest.approx(np.ones(12))
    assert code.decoded(code.encoded(code.decoded(np.eye(12)))) == pytest.approx(code.decoded(np.eye(12)))
    error = [np.abs(code.decoded(code.encoded(generated)) - generated).mean() for code in codes]
    assert error[0] > error[1] > error[2] and error[1] < 2.0


def test_zeros_behind_a_motion_that_ended_do_not_become_a_step():
    short = np.r_[np.full(500, 20.0), np.zeros(121)]
    smooth = open_fully(np.array([short, np.zeros(621)]))
    assert np.array_equal(smooth, [np.full(621, 20.0), np.zeros(621)])


def test_what_lies_outside_the_measured_doors_is_foreign():
    doors = data_of(SEEN).force_N
    foreign = foreign_to(doors)
    assert np.median(foreign(doors)) == pytest.approx(1)
    saw = 8 * (np.arange(621) % 20 < 10) + doors[0]
    assert foreign(np.array([saw]))[0] > 2 * foreign(doors).max() or foreign(np.array([saw]))[0] == MOST_FOREIGN
    code = code_of(open_fully(doors), 3)
    ratings = Teacher(Knows(given().scaling), foreign, code).rate(np.zeros((2, 3)))
    assert ratings.shape == (2, 8) and np.array_equal(ratings[0], ratings[1])


def test_the_random_wishes_fill_the_range_and_its_corners():
    wishes = random_wishes(np.full((3, 7), 50.0), 4000, 1)
    assert wishes.min() == 0 and wishes.max() == 100
    assert 0.05 < np.mean((wishes == 0) | (wishes == 100)) < 0.2
    near = np.all(np.abs(wishes - 50) < 30, axis=1)
    assert 0.4 < near.mean() < 0.6


def test_torch_and_the_numbers_taken_out_of_it_agree():
    network = seeded(lambda: Generator(7, 5, 8, 2.0), 3)
    wish = np.random.default_rng(0).uniform(0, 100, (4, 7))
    with torch.no_grad():
        expected = network(torch.from_numpy(wish.astype(np.float32))).numpy()
    assert network.numbers().code(wish) == pytest.approx(expected, abs=1e-5)
    assert np.abs(network.numbers().code(wish)).max() <= 2
