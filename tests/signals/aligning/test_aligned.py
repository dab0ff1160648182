"""Holes, edges and samples that cannot be aligned: bridged and marked, left empty, or refused by name."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.signals.aligning.aligned import LONGEST_GAP_S, align, grid_points
from palpate.signals.aligning.methods import METHODS
from palpate.signals.aligning.refusals import AlignError
from tests.examples import examples

RATE_HZ = 120.0


def onto_1_khz(times_s, values, method="bandlimited", grid_s=None, **more):
    grid_s = grid_points(times_s[0], times_s[-1], 1000.0) if grid_s is None else grid_s
    return grid_s, align(times_s, values, grid_s, METHODS[method], rate_hz=RATE_HZ, grid_hz=1000.0, **more)


def walk(count=600):
    times_s = 10 + np.arange(count) / RATE_HZ
    return times_s, np.stack([np.sin(times_s), np.cos(3 * times_s)], axis=1)


@pytest.mark.parametrize("name", METHODS)
def test_nothing_is_extrapolated(name):
    times_s, values = walk()
    grid_s, result = onto_1_khz(times_s, values, name, np.arange(9000, 16000) / 1000)
    known = np.isfinite(result.values).all(axis=1)
    assert (known == ((grid_s >= times_s[0] - 1e-9) & (grid_s <= times_s[-1] + 1e-9))).all()
    assert result.empty == int((~known).sum()) > 0 and not result.bridged.any()


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize(("lost", "bridged"), [(1, True), (2, True), (3, False), (200, False)])
def test_short_holes_are_bridged_and_marked_and_long_ones_stay_empty(name, lost, bridged):
    """At 120 Hz two samples are 17 ms, three 25 ms; 20 ms are bridged."""
    times_s, values = walk()
    keep = np.r_[0:300, 300 + lost : 600]
    grid_s, result = onto_1_khz(times_s[keep], values[keep], name)
    inside = (grid_s > times_s[299] + 1e-9) & (grid_s < times_s[300 + lost] - 1e-9)
    assert (hole := result.holes[0]).bridged is bridged and len(result.holes) == 1
    assert hole.seconds == pytest.approx(lost / RATE_HZ)
    assert (result.bridged == (inside & bridged)).all()
    assert (np.isnan(result.values[:, 0]) == (inside & (not bridged))).all()
    if name in {"cubic", "pchip", "bandlimited"}:
        truth = np.stack([np.sin(grid_s), np.cos(3 * grid_s)], axis=1)
        assert np.nanmax(np.abs(result.values - truth)[300:-300]) < 4e-3


def test_an_occluded_marker_is_a_hole_like_any_other():
    times_s, values = walk()
    hidden = values.copy()
    hidden[200:202, 1] = np.nan
    hidden[400:440] = np.nan
    hidden[450, 0] = np.inf
    _, bridged = onto_1_khz(times_s, hidden)
    assert bridged.not_finite == 43 and [hole.bridged for hole in bridged.holes] == [True, False, True]
    assert np.isfinite(bridged.values[np.flatnonzero(bridged.bridged)]).all()


def test_a_sample_between_two_long_holes_is_known_only_where_it_stands():
    times_s, values = walk(60)
    keep = np.r_[0:20, 30, 40:60]
    _, bridged = onto_1_khz(times_s[keep], values[keep])
    assert len(bridged.holes) == 2 and np.isnan(bridged.values[180:320]).all()


@given(st.lists(st.integers(0, 399), max_size=200), st.sampled_from(sorted(METHODS)), st.floats(0, 0.2))
@settings(max_examples=examples(60), deadline=None)
def test_whatever_is_lost_every_grid_point_is_known_marked_or_in_a_long_hole(lost, name, longest_s):
    times_s, values = walk(400)
    keep = np.setdiff1d(np.arange(400), [place for place in lost if 0 < place < 399])
    grid_s, bridged = onto_1_khz(times_s[keep], values[keep], name, longest_gap_s=longest_s)
    known = np.isfinite(bridged.values).all(axis=1)
    within = np.zeros(len(grid_s), dtype=bool)
    for hole in bridged.holes:
        inside = (grid_s > hole.after_s + 1e-9) & (grid_s < hole.before_s - 1e-9)
        within |= inside
        assert hole.bridged == (hole.seconds <= longest_s + 1e-9)
        assert known[inside].all() if hole.bridged else not known[inside].any()
        assert (bridged.bridged[inside] == hole.bridged).all()
    alone = np.isin(grid_s.round(6), times_s.round(6))  # the one point of a stretch of one sample
    assert (known | within | alone).all() and not (bridged.bridged & ~within).any()
    assert np.nanmax(np.abs(bridged.values), initial=0) < 3


@pytest.mark.parametrize(
    ("times_s", "says"),
    [
        ([], "there are no samples"),
        ([1.0], "there is one sample"),
        ([2.0, 2.0, 2.0], "all 3 samples are timed 2 s: a clock that has stopped"),
        ([1.0, 1.1, 1.1, 1.2], "samples 2 and 3 are timed 1.1 s and 1.1 s: the same time twice"),
        ([1.0, 1.2, 1.1], "samples 2 and 3 are timed 1.2 s and 1.1 s: out of order"),
        ([1.0, np.nan, 1.2], "sample 2 is timed nan"),
        ([1.0, 1.1, np.inf], "sample 3 is timed inf"),
    ],
)
@pytest.mark.parametrize("name", METHODS)
def test_times_that_tell_nothing_are_refused(name, times_s, says):
    times_s = np.array(times_s)
    with pytest.raises(AlignError, match=says):
        onto_1_khz(times_s, np.ones((len(times_s), 1)), name, np.arange(1000, 1200) / 1000)


def test_samples_grids_and_rates_of_no_use_are_refused():
    times_s, values = walk(10)
    grid_s = grid_points(10, 10.05, 1000.0)
    with pytest.raises(AlignError, match="0 of 10 samples are finite numbers"):
        onto_1_khz(times_s, np.full((10, 1), np.nan))
    with pytest.raises(AlignError, match=r"values of shape \(9, 2\) for 10 times"):
        onto_1_khz(times_s, values[:9])
    with pytest.raises(AlignError, match=r"grid of nan Hz"):
        align(times_s, values, grid_s, METHODS["linear"], rate_hz=RATE_HZ, grid_hz=np.nan)
    with pytest.raises(AlignError, match="finite and rise"):
        onto_1_khz(times_s, values, grid_s=grid_s[::-1])
    with pytest.raises(AlignError, match="longest gap of -1"):
        onto_1_khz(times_s, values, longest_gap_s=-1)
    for span in ((5.0, 5.0004), (5.0, 4.0)):
        with pytest.raises(AlignError, match="less than two points at 1000 Hz"):
            grid_points(*span, 1000.0)
    with pytest.raises(AlignError, match="finite numbers are needed"):
        grid_points(0, np.inf, 1000.0)
    with pytest.raises(AlignError, match="points: at most"):
        grid_points(0, 1e6, 1e6)


def test_uneven_times_are_refused_by_the_band_limited_way_only():
    times_s, values = walk()
    uneven = times_s + np.random.default_rng(1).uniform(-1e-3, 1e-3, 600)
    with pytest.raises(AlignError, match=r"steps off an even grid of 120.* Hz.*use pchip or cubic"):
        onto_1_khz(uneven, values)
    assert onto_1_khz(uneven, values, "cubic")[1].empty == 0


def test_the_longest_gap_is_half_a_period_of_the_hands_fastest_motion():
    assert pytest.approx(1 / 25 / 2) == LONGEST_GAP_S


def test_the_kernels_memory_does_not_grow_with_the_recording():
    """Twice the recording needs twice the arrays (80 bytes a sample at most), not a longer piece of kernel."""
    import tracemalloc

    peaks = []
    for count in (100_000, 200_000):
        times_s = np.arange(count) / 1e4
        values, grid_s = np.sin(times_s)[:, None], grid_points(0, times_s[-1], 1000.0)
        tracemalloc.start()
        align(times_s, values, grid_s, METHODS["bandlimited"], rate_hz=1e4, grid_hz=1000.0)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] - peaks[0] < 80 * 100_000 and peaks[0] < 40e6
