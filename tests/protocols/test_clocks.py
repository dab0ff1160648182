"""A device's clock from when its samples came: late by chance, never early."""

from __future__ import annotations

import math
import random
from itertools import accumulate

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.protocols.clocks import TOLERANCE_PPM, ClockError, fit_clock, nominal_clock
from tests.examples import examples


def arrivals(rate_hz, drift_ppm, seconds, block, delay, t0_s=5.0):
    """(n, t_s) of blocks of a clock that runs drift_ppm fast, each late by delay()."""
    true_hz, arrival_s, blocks = rate_hz * (1 + drift_ppm * 1e-6), -math.inf, []
    for n in range(block - 1, int(rate_hz * seconds), block):
        arrival_s = max(arrival_s, t0_s + n / true_hz + delay())
        blocks.append((n, arrival_s))
    return blocks


@given(st.floats(-500, 500), st.sampled_from([80.0, 3000.0, 8000.0]), st.floats(0, 0.05), st.integers(0, 10**6))
@settings(max_examples=examples(60), deadline=None)
def test_arrivals_that_are_all_equally_late_give_the_clock_exactly(drift_ppm, rate_hz, late_s, t0_s):
    clock = fit_clock(arrivals(rate_hz, drift_ppm, 20, int(rate_hz / 20), lambda: late_s, t0_s), rate_hz)
    assert clock.measured and clock.drift_ppm == pytest.approx(drift_ppm, abs=1e-9 + 2e-9 * (t0_s + 1))
    assert clock.time_s(0) == pytest.approx(t0_s + late_s, abs=1e-9 + 1e-15 * t0_s)
    assert clock.wander_s is not None and clock.wander_s <= 1e-9 + 1e-15 * t0_s


@pytest.mark.long
@pytest.mark.untraced
@pytest.mark.parametrize(
    ("rate_hz", "block", "seconds"), [(8000, 80, 60), (3000, 30, 10), (120, 1, 60), (80, 1, 20), (1000, 500, 60)]
)
@pytest.mark.parametrize("shape", ["exponential", "uniform", "bursts"])
def test_the_stated_error_is_the_actual_error(rate_hz, block, seconds, shape):
    """Over 40 recordings: RMS of error over stated error at most about 1; no time is off by over 5 stated errors."""
    rng = random.Random(f"{rate_hz}{shape}")
    delay = {
        "exponential": lambda: rng.expovariate(1000),
        "uniform": lambda: rng.uniform(0, 0.002),
        "bursts": lambda: rng.choice([rng.expovariate(5000), 0.02 + rng.expovariate(100)]),
    }[shape]
    ratios = []
    for _ in range(40):
        clock = fit_clock(arrivals(rate_hz, 50, seconds, block, delay), rate_hz)
        ratios.append((clock.drift_ppm - 50) / clock.drift_error_ppm)
        middle = rate_hz * seconds / 2
        off_s = clock.time_s(middle) - (5 + middle / (rate_hz * (1 + 50e-6)))
        assert abs(off_s) < 5 * clock.offset_error_s + 1e-9
    assert math.sqrt(sum(ratio**2 for ratio in ratios) / 40) < 1.3


def test_a_stall_of_seconds_and_a_slow_start_do_not_move_the_clock():
    rng = random.Random(3)
    blocks = arrivals(1000, 30, 60, 10, lambda: rng.expovariate(2000))
    stalled = [(n, t + 3.0 if 20 < t < 23 else t + max(0.0, 6 - t)) for n, t in blocks]
    latest = list(zip((n for n, _ in stalled), accumulate((t for _, t in stalled), max), strict=True))
    clock = fit_clock(latest, 1000)
    assert clock.drift_ppm == pytest.approx(30, abs=3 * clock.drift_error_ppm)
    assert clock.drift_error_ppm < 0.5


def test_an_uncertain_rate_stays_nominal_unless_it_is_plainly_another():
    """Ten arrivals in a second, 20 ms late by chance, cannot show 50 ppm; they do show 100 Hz in place of 120."""
    rng = random.Random(5)
    few = arrivals(120, 50, 1, 12, lambda: rng.expovariate(50))
    clock = fit_clock(few, 120)
    assert not clock.measured and clock.rate_hz == 120 and clock.drift_error_ppm > TOLERANCE_PPM
    assert all(clock.time_s(n) <= t + 1e-12 for n, t in few)
    assert fit_clock(arrivals(100, 0, 60, 12, lambda: rng.expovariate(50)), 120).rate_hz == pytest.approx(100, rel=1e-3)


def test_a_clock_that_changes_its_pace_is_reported_as_wandering():
    rng = random.Random(6)
    even = fit_clock(arrivals(1000, 0, 60, 10, lambda: rng.expovariate(1000)), 1000)
    bent = [(n, t + 40e-6 * max(0.0, t - 35)) for n, t in arrivals(1000, 0, 60, 10, lambda: rng.expovariate(1000))]
    assert even.wander_s < 50e-6
    assert fit_clock(bent, 1000).wander_s > 200e-6


def test_one_arrival_places_the_nominal_clock_without_an_error():
    clock = fit_clock([(79, 6.0)], 80)
    assert clock.time_s(79) == 6.0 and not clock.measured and clock.drift_error_ppm is None
    assert nominal_clock(80, 40, 2.0).time_s(0) == 1.5
    assert fit_clock([(0, 1.0), (10, 1.2)], 80).drift_error_ppm is None


@pytest.mark.parametrize(
    ("blocks", "rate_hz", "says"),
    [
        ([], 100, "no arrivals"),
        ([(0, 1.0), (0, 1.1)], 100, "sample 0, after sample 0: they must rise"),
        ([(5, 1.0), (4, 1.1)], 100, "arrival 2 is sample 4, after sample 5"),
        ([(0, 1.0), (9, 0.9)], 100, "before the one before it"),
        ([(0, 1.0), (9, math.nan)], 100, "arrival 2 is sample 9 at nan s"),
        ([(0, math.inf)], 100, "finite numbers"),
        ([(n, 7.0) for n in range(0, 2000, 100)], 100, "20 arrivals, most of them at one moment"),
        ([(n, 7.0 + n * 1e-6) for n in range(0, 2001, 100)], 100, "2000 samples came within 0.002 s, not 20 s as at"),
        ([(n, 7.0 + n * 1e-4) for n in range(0, 2001, 100)], 100, "a burst does not tell how fast samples come"),
        ([(0, 1.0)], 0, "the nominal rate is 0 Hz"),
        ([(0, 1.0)], math.nan, "the nominal rate is nan Hz"),
    ],
)
def test_arrivals_that_no_clock_can_have_made_are_refused(blocks, rate_hz, says):
    with pytest.raises(ClockError, match=says):
        fit_clock(blocks, rate_hz)
