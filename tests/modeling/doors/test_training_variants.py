"""Five training variants of each stimulus: small, drawn by name and seed, with ratings that stay on the scale."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from palpate.modeling.doors import training_variants
from palpate.modeling.doors.training_variants import KINDS, is_variant, with_variants
from palpate.modeling.evaluate.rows import ModelDataError
from tests.modeling.doors.data_for_tests import crossed

NAMES = ("noise", "shift", "smoothing", "amplitude", "spike")
ANGLE = np.arange(621) / 10


def drawing():
    return np.random.default_rng(1)


def bell(at_deg, end=620):
    """A bump at an angle, zeros behind the end of the motion."""
    force = 1 + 20 * np.exp(-(((ANGLE - at_deg) / 3) ** 2))
    force[end + 1 :] = 0.0
    return force


def test_90_stimuli_become_540_rows_of_the_same_sources():
    data = crossed(6, 15)
    more = with_variants(data, seed=1)
    assert len(more) == 540
    assert more.ids[:90] == data.ids
    assert more.ids[90:95] == tuple(f"{data.ids[0]}~{name}" for name in NAMES)
    assert sum(map(is_variant, more.ids)) == 450
    for row in (90, 317, 539):
        stimulus = data.ids.index(more.ids[row].split("~")[0])
        for column in ("source", "doors", "variants", "groups"):
            assert getattr(more, column)[row] == getattr(data, column)[stimulus]
    assert np.array_equal(more.force_N[:90], data.force_N) and np.array_equal(more.rating[:90], data.rating)


def test_what_is_drawn_depends_on_seed_and_name_and_not_on_the_other_rows():
    data = crossed(2, 3)
    whole, alone = with_variants(data, seed=1), with_variants(data.rows(np.array([4, 1])), seed=1)
    for row, name in enumerate(alone.ids):
        same = whole.ids.index(name)
        assert np.array_equal(alone.force_N[row], whole.force_N[same])
        assert np.array_equal(alone.rating[row], whole.rating[same])
    assert not np.array_equal(with_variants(data, seed=2).force_N[6:], whole.force_N[6:])


def test_every_variant_differs_a_little_and_its_ratings_by_at_most_3_percent_of_the_scale():
    data = crossed(6, 15)
    data = replace(data, rating=data.rating * 0.9)  # none so near an end that clipping would hide a shift
    more = with_variants(data, seed=1)
    for row in range(90, 540):
        stimulus = data.ids.index(more.ids[row].split("~")[0])
        assert not np.array_equal(more.force_N[row], data.force_N[stimulus])
        assert 0 < np.abs(more.rating[row] - data.rating[stimulus]).max() <= 0.03 * 20


@pytest.mark.parametrize("kind", KINDS, ids=NAMES)
def test_a_greater_amount_moves_the_ratings_farther_and_the_way_the_table_says(kind):
    data = replace(crossed(2, 5), rating=np.zeros((10, 7)))
    more = with_variants(data, seed=3)
    rows = [row for row, name in enumerate(more.ids) if name.endswith(f"~{kind.name}")]
    moved = more.rating[rows]
    per_unit = np.array([kind.effect.get(name, 0.0) for name in data.attributes]) / 100 * 20
    amount = moved[:, np.argmax(np.abs(per_unit))] / per_unit[np.argmax(np.abs(per_unit))]
    assert ((kind.least <= amount) & (amount <= kind.most)).all() and np.ptp(amount) > 0
    assert moved == pytest.approx(np.outer(amount, per_unit), abs=1e-12)


def test_every_effect_names_an_attribute_of_the_study():
    from palpate.modeling.doors.reading_tables import shipped_attributes

    assert {name for kind in KINDS for name in kind.effect} <= set(shipped_attributes())


def test_ratings_at_the_end_of_the_scale_stay_on_it():
    data = crossed(2, 2)
    low, high = (with_variants(replace(data, rating=np.full((4, 7), end)), seed=1).rating for end in (-10.0, 10.0))
    assert low.min() == -10 and low.max() > -10
    assert high.max() == 10 and high.min() < 10


def test_an_attribute_that_no_effect_names_keeps_its_rating():
    data = replace(crossed(1, 2), attributes=("Sweet", *crossed(1, 2).attributes[1:]))
    more = with_variants(data, seed=1)
    assert np.array_equal(more.rating[:, 0], data.rating[[0, 1, *[0] * 5, *[1] * 5], 0])


def test_variants_of_variants_are_refused():
    with pytest.raises(ModelDataError, match="D0_g0#0~noise is a training variant already"):
        with_variants(with_variants(crossed(1, 2)))


@pytest.mark.parametrize("end", [620, 605, 300])
@pytest.mark.parametrize(
    "change", [training_variants.noise, training_variants.shift, training_variants.smoothing, training_variants.spike]
)
def test_a_change_keeps_the_force_at_0_degrees_and_the_zeros_behind_the_motion(change, end):
    force = bell(15, end)
    force[1 : end + 1 : 2] += 0.5
    given = force.copy()
    changed = change(force, 1.0, drawing())
    assert changed[0] == force[0]
    assert not changed[end + 1 :].any()
    assert np.abs(changed - force).max() > 0.1
    assert np.array_equal(force, given), "the profile given is not touched"


def test_a_shift_moves_the_peak_by_its_degrees_either_way():
    for degrees in (-1.0, 0.5):
        assert ANGLE[np.argmax(training_variants.shift(bell(20), degrees, drawing()))] == pytest.approx(20 + degrees)


def test_noise_has_the_sd_that_was_requested():
    assert np.std(training_variants.noise(bell(20), 0.1, drawing()) - bell(20)) == pytest.approx(0.1, rel=0.1)


def test_smoothing_takes_roughness_away_along_a_stretch_and_leaves_the_rest_as_it_was():
    rough = bell(20) + np.where(np.arange(621) % 2, 0.5, -0.5)
    smoothed = training_variants.smoothing(rough, 1.0, drawing())
    touched = np.flatnonzero(smoothed != rough)
    assert 50 < len(touched) <= 201 and np.ptp(touched) <= 200
    assert np.abs(np.diff(smoothed))[touched[80:120]].max() < 0.25


def test_a_spike_has_the_requested_height_and_is_one_degree_wide():
    added = training_variants.spike(bell(20), 1.5, drawing()) - bell(20)
    assert 1.4 < added.max() <= 1.5 and added.min() > -1e-12
    assert 8 <= (added > 1e-9).sum() <= 10


def test_amplitude_is_in_percent():
    assert training_variants.amplitude(bell(20), -5.0, drawing()) == pytest.approx(0.95 * bell(20))


@pytest.mark.parametrize("force", [np.zeros(621), np.full(621, 7.0), 1e6 * (ANGLE == 30), bell(0.1, 1), bell(0, 0)])
def test_profiles_that_are_flat_short_or_one_huge_spike_give_finite_variants(force):
    data = crossed(1, 2)
    more = with_variants(replace(data, force_N=np.array([force, data.force_N[1]])), seed=1)
    assert np.isfinite(more.force_N).all() and np.isfinite(more.rating).all()
