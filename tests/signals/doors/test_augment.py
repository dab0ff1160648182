"""The fourteen variants, verified on all six doors, and their refusals."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices.door.stimuli import originals
from palpate.signals.doors.augment import VARIANTS, add_cycles, augment, move_knots, raise_span, set_peak
from palpate.signals.doors.features import describe, landmarks, peaks_of, plateau_after_second_peak
from palpate.signals.doors.grid import POINTS, DoorDataError
from tests.examples import examples

MOST_EXTRA_STEP_N = 4.0
"""No variant of the study steps from one grid point to the next by more than its base at most does, plus this."""
LABELS = ("BC3", "FORD", "G90", "K3", "K8", "MQ4")
for_every_door = pytest.mark.parametrize("label", LABELS)
for_every_variant = pytest.mark.parametrize("variant", VARIANTS)


@cache
def base(label: str) -> np.ndarray:
    return next(augment(force_N, "g0") for name, _, force_N in originals() if name == label)


def variant_of(label: str, variant: str) -> np.ndarray:
    return augment(base(label), variant, door=label)


def highest_before(force_N: np.ndarray, index: int) -> tuple[int, float]:
    return int(np.argmax(force_N[:index])), float(force_N[:index].max())


@for_every_door
@for_every_variant
def test_every_variant_is_a_profile_without_new_jumps(label, variant) -> None:
    force_N, original = variant_of(label, variant), base(label)
    assert force_N.shape == (POINTS,)
    assert np.isfinite(force_N).all()
    assert force_N[0] == original[0]
    end = landmarks(original).end
    assert np.array_equal(force_N[end + 1 :], original[end + 1 :])
    step, step_before = (np.abs(np.diff(profile[: end + 1])).max() for profile in (force_N, original))
    assert step <= step_before + MOST_EXTRA_STEP_N
    assert np.array_equal(force_N, np.round(force_N, 4))


@for_every_door
@pytest.mark.parametrize(("variant", "peak_N"), [("g1", 20), ("g2", 30), ("g3", 40)])
def test_g1_to_g3_set_the_first_peak_and_leave_the_rest(label, variant, peak_N) -> None:
    peaks, force_N = landmarks(base(label)), variant_of(label, variant)
    assert highest_before(force_N, peaks.valleys[0]) == (peaks.peaks[0], pytest.approx(peak_N, abs=1e-3))
    assert np.array_equal(force_N[peaks.valleys[0] :], base(label)[peaks.valleys[0] :])
    assert landmarks(force_N).peaks[0] == peaks.peaks[0]


@for_every_door
@pytest.mark.parametrize(("variant", "cycle", "before_deg"), [("g4", 1, 15), ("g5", 2, 30), ("g6", 3, 30)])
def test_g4_to_g6_complete_their_cycle_before_15_or_30_degrees(label, variant, cycle, before_deg) -> None:
    was, now = landmarks(base(label)), landmarks(variant_of(label, variant))
    assert was.valleys[cycle - 1] > before_deg * 10 > now.valleys[cycle - 1]
    assert now.valleys[cycle - 1] == pytest.approx(before_deg * 10 - 5, abs=1)
    assert len(now.peaks) == len(was.peaks)
    assert variant_of(label, variant)[list(now.peaks)] == pytest.approx(base(label)[list(was.peaks)], abs=0.5)


@for_every_door
def test_g6_has_all_major_peaks_before_30_degrees_and_rises_rapidly_to_the_end(label) -> None:
    force_N = variant_of(label, "g6")
    peaks = landmarks(force_N)
    assert max(peaks.peaks) < 300
    tail = force_N[295 : peaks.end + 1]
    assert (np.diff(tail) >= 0).all()
    assert tail[-1] == pytest.approx(force_N[list(peaks.peaks)].max(), abs=0.5)
    assert describe(force_N)["end_slope_N_deg"] > 1


@for_every_door
def test_g7_has_its_first_peak_at_10_degrees_and_keeps_its_height(label) -> None:
    was, now = landmarks(base(label)), landmarks(variant_of(label, "g7"))
    assert now.peaks[0] == 100
    assert variant_of(label, "g7")[100] == base(label)[was.peaks[0]]
    assert now.valleys == was.valleys


@for_every_door
def test_g8_is_straight_up_to_between_18_and_20_degrees(label) -> None:
    changed = np.flatnonzero(variant_of(label, "g8") != base(label))
    assert 30 <= changed[0] <= 61
    assert 175 <= changed[-1] <= 200
    bends = np.abs(np.diff(variant_of(label, "g8"), 2))[changed[0] : changed[-1] - 1]
    assert bends.max() < 3e-4  # rounding to four decimals only


@for_every_door
def test_g9_adds_small_cycles_before_the_second_peak_only(label) -> None:
    peaks, difference = landmarks(base(label)), variant_of(label, "g9") - base(label)
    assert not difference[peaks.peaks[1] :].any()
    assert 1.5 < np.abs(difference).max() <= 5
    assert 3 <= len(peaks_of(difference, 0.2)) <= 4
    if difference[: peaks.peaks[0]].any():
        assert not difference[peaks.peaks[0] :].any()


def test_both_places_of_g9_occur_among_the_six_doors() -> None:
    before = [(variant_of(label, "g9") - base(label))[: landmarks(base(label)).peaks[0]].any() for label in LABELS]
    assert set(before) == {True, False}


@for_every_door
def test_g10_is_the_hidden_repeat_of_g0(label) -> None:
    assert np.array_equal(variant_of(label, "g10"), base(label))


@for_every_door
def test_g11_lengthens_the_plateau_and_changes_nothing_before_it(label) -> None:
    was, now = (plateau_after_second_peak(force, "g11") for force in (base(label), variant_of(label, "g11")))
    assert np.array_equal(variant_of(label, "g11")[: was[0] + 1], base(label)[: was[0] + 1])
    assert now[1] - now[0] >= was[1] - was[0] + 50
    assert len(landmarks(variant_of(label, "g11")).peaks) == len(landmarks(base(label)).peaks)


@for_every_door
def test_g12_lies_above_g11_on_the_plateau_and_equals_it_elsewhere(label) -> None:
    stretched, raised = variant_of(label, "g11"), variant_of(label, "g12")
    peaks = landmarks(stretched)
    first, last = peaks.peaks[1], peaks.valleys[1]
    assert np.array_equal(raised[: first + 1], stretched[: first + 1])
    assert np.array_equal(raised[last:], stretched[last:])
    assert (raised[first + 1 : last] >= stretched[first + 1 : last]).all()
    middle = (plateau_after_second_peak(stretched, "g12")[0] + plateau_after_second_peak(stretched, "g12")[1]) // 2
    assert raised[middle] - stretched[middle] == pytest.approx(0.3 * (stretched[first] - stretched[middle]), rel=0.15)
    assert raised[first:last].max() == stretched[first]


@for_every_door
@pytest.mark.parametrize(("variant", "on", "peak_N"), [("g13", "g2", 30), ("g14", "g3", 40)])
def test_g13_and_g14_add_bumps_before_the_peak_of_g2_and_g3(label, variant, on, peak_N) -> None:
    peak = landmarks(base(label)).peaks[0]
    difference = variant_of(label, variant) - variant_of(label, on)
    assert not difference[peak:].any()
    assert 1 < np.abs(difference).max() <= 2
    assert len(peaks_of(difference, 0.2)) == 3
    assert highest_before(variant_of(label, variant), landmarks(base(label)).valleys[0]) == (
        peak,
        pytest.approx(peak_N),
    )


def test_the_seed_decides_g8_and_g9_and_nothing_else() -> None:
    different = {
        variant
        for variant in VARIANTS
        if not np.array_equal(variant_of("K8", variant), augment(base("K8"), variant, door="K8", seed=1))
    }
    assert different == {"g8", "g9"}


def test_the_same_seed_gives_the_same_variant_in_any_order() -> None:
    forward = [variant_of("K3", variant) for variant in VARIANTS]
    backward = [variant_of("K3", variant) for variant in reversed(VARIANTS)]
    assert all(np.array_equal(a, b) for a, b in zip(forward, reversed(backward), strict=True))


def hills(*tops: tuple[float, float], end: float = 62) -> np.ndarray:
    """A smooth profile with a hill of each angle and height."""
    angle = np.arange(POINTS) / 10
    force = 5 + sum(height * np.exp(-(((angle - at) / 2.5) ** 2)) for at, height in tops)
    return np.where(angle <= end, force, 0.0)


@pytest.mark.parametrize(
    ("force_N", "variant", "message"),
    [
        (hills(), "g1", r"g1 .first peak amplitude. needs 1 major peaks; this profile has 0 .at none deg"),
        (hills((14, 20)), "g5", r"g5 .cycle 2 complete before 30 degrees. needs 2 major peaks.* has 1 .at 14\.0 deg"),
        (hills((14, 20), (30, 20)), "g6", "g6 .* needs 3 major peaks"),
        (hills((5, 20), (15, 20)), "g4", r"complete at 10\.0 degrees, nothing to compress"),
        (hills((10, 20), (30, 20)), "g7", r"g7 moves the first peak to 10 degrees; here it is at 10\.0"),
        (hills((14, 20), end=19), "g8", r"motion ends at 19\.0 degrees"),
        (hills((14, 20)), "g9", "g9 .small cycles. needs 2 major peaks"),
        (hills((14, 20), (30, 20), (45, 20)), "g10", "g10 .plateau. needs a plateau after the second peak"),
        (hills((14, 20), (30, 20), (45, 20)), "g12", "needs a plateau after the second peak"),
        (np.zeros(POINTS), "g13", "needs 1 major peaks"),
        (hills((14, 20)), "g15", "no variant 'g15'"),
        (np.zeros(620), "g1", "621 points expected"),
        (np.full(POINTS, np.nan), "g1", r"the force at 0\.0 deg is nan"),
    ],
)
def test_a_profile_without_the_needed_feature_is_refused_by_name(force_N, variant, message) -> None:
    with pytest.raises(DoorDataError, match=message):
        augment(force_N, variant)


@given(
    st.lists(st.floats(-50, 50), min_size=1, max_size=40),
    st.sampled_from([0, 7, 300]),
    st.sampled_from(sorted(VARIANTS)),
)
@settings(max_examples=examples(200), deadline=None)
def test_any_621_numbers_give_a_finite_profile_or_a_refusal(values, padding, variant) -> None:
    knots = np.linspace(0, 620 - padding, len(values))
    rough = np.where(np.arange(POINTS) <= 620 - padding, np.interp(np.arange(POINTS), knots, values), 0.0)
    try:
        force_N = augment(rough, variant)
    except DoorDataError:
        return
    assert force_N.shape == (POINTS,)
    assert np.isfinite(force_N).all()


@given(st.integers(2, 300), st.integers(301, 600), st.floats(-15, 60))
@settings(max_examples=examples(40), deadline=None)
def test_set_peak_keeps_the_order_of_forces_on_both_flanks(peak, valley, to_N) -> None:
    force = np.r_[np.linspace(0, 30, peak + 1), np.linspace(30, -20, valley - peak + 1)[1:], np.zeros(620 - valley)]
    changed = set_peak(force, 0, peak, valley, to_N)
    assert changed[peak] == to_N
    assert (np.diff(changed[: peak + 1]) * np.sign(to_N) >= -1e-9).all()
    assert (np.diff(changed[peak : valley + 1]) <= 1e-9).all()
    assert np.array_equal(changed[valley:], force[valley:])


def test_move_knots_moves_a_feature_and_leaves_ends_and_padding() -> None:
    force = hills((14, 20), end=60)
    moved = move_knots(force, [(140, 100)], 600)
    assert np.argmax(moved) == 100
    assert (moved[0], moved[600]) == (force[0], force[600])
    assert np.array_equal(moved[601:], force[601:])


def test_add_cycles_is_zero_outside_and_leaves_no_kink() -> None:
    bump = add_cycles(np.zeros(POINTS), 100, 200, 3, 2.0)
    assert not bump[:101].any()
    assert not bump[200:].any()
    assert np.abs(np.diff(bump, 2)).max() < 0.12


def test_raise_span_lifts_the_middle_and_keeps_the_feet() -> None:
    force = np.interp(np.arange(POINTS), [0, 100, 200, 300, 620], [40, 20, 18, 0, 0])
    lifted = raise_span(force, (0, 300), (100, 200), 5.0)
    assert lifted[100:201] == pytest.approx(force[100:201] + 5)
    assert (lifted[0], lifted[300]) == (40, 0)
    assert (np.diff(lifted[:301]) < 0).all()
