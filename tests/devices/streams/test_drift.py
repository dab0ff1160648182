"""A clock's rate from arrivals that are late and never early: its error on clocks that are known."""

import math
import random

import pytest

from palpate.devices.streams.drift import BINS, ClockFit
from palpate.protocols.clocks import fit_clock
from palpate.protocols.events import NS

DELAYS = {
    "exponential": lambda chance: chance.expovariate(500.0),
    "uniform": lambda chance: chance.uniform(0.0, 0.004),
    "lognormal": lambda chance: 0.002 * chance.lognormvariate(0.0, 1.0),
    "one in five very late": lambda chance: abs(chance.gauss(0.0, 0.001)) + 0.05 * (chance.random() < 0.2),
}


def arrivals(ppm, seconds, delay, seed, every_s=0.01, stall=None):
    """(device's seconds, host's ns); within the stall nothing is let through."""
    chance, pairs, last_s = random.Random(seed), [], 0.0
    for n in range(1, round(seconds / every_s) + 1):
        t_s = n * every_s / (1 + ppm * 1e-6) + delay(chance)
        if stall is not None and stall[0] < t_s < stall[1]:
            t_s = stall[1]
        last_s = max(last_s, t_s)
        pairs.append((n * every_s, round((100 + last_s) * NS)))
    return pairs


def fitted(pairs):
    clock = ClockFit()
    for device_s, t_ns in pairs:
        clock.add(device_s, t_ns)
    return clock.fit()


def least_squares_ppm(pairs):
    x = [device_s for device_s, _ in pairs]
    t = [t_ns / NS for _, t_ns in pairs]
    x0, t0 = math.fsum(x) / len(x), math.fsum(t) / len(t)
    slope = math.fsum((a - x0) * (b - t0) for a, b in zip(x, t, strict=True)) / math.fsum((a - x0) ** 2 for a in x)
    return (1 / slope - 1) * 1e6


@pytest.mark.parametrize(
    ("law", "ppm"), [*((law, 50.0) for law in DELAYS), ("exponential", -180.0), ("exponential", 0.0)]
)
def test_a_known_drift_is_found_within_its_stated_error(law, ppm):
    """Over twenty recordings of 20 s with delays of about 2 ms: the error is small, and no larger than is stated.

    Few bins tell the error of the line less surely than all arrivals would: it is stated up to three times too large.
    """
    fits = [fitted(arrivals(ppm, 20.0, DELAYS[law], seed)) for seed in range(20)]
    off = [fit.ppm - ppm for fit in fits]
    rms = math.sqrt(math.fsum(error**2 for error in off) / len(off))
    assert rms < (6.0 if law == "lognormal" else 1.5)
    stated = math.sqrt(math.fsum(fit.se_ppm**2 for fit in fits) / len(fits))
    assert 0.33 < rms / stated < 1.2
    assert sum(abs(error) < 3 * fit.se_ppm for error, fit in zip(off, fits, strict=True)) >= 18


@pytest.mark.parametrize(
    ("law", "seconds", "every_s"),
    [*((law, 8.0, 1 / 80) for law in DELAYS), ("lognormal", 30.0, 0.01), ("one in five very late", 60.0, 1 / 120)],
)
def test_the_bins_lose_nothing_against_the_fit_to_all_arrivals(law, seconds, every_s):
    """What the record says of a clock is what an export says of it, which sees every arrival."""
    recorded = [arrivals(50.0, seconds, DELAYS[law], seed, every_s) for seed in range(10)]
    fits = [(fitted(recording), fit_clock([(x, t_ns / NS) for x, t_ns in recording], 1.0)) for recording in recorded]
    assert sum(on_line.ppm == pytest.approx(after.drift_ppm, abs=1e-3) for on_line, after in fits) >= 7
    apart = [abs(on_line.ppm - after.drift_ppm) / on_line.se_ppm for on_line, after in fits]
    assert max(apart) < 1


def test_the_earliest_arrivals_tell_more_than_all_of_them():
    recorded = [arrivals(50.0, 20.0, DELAYS["exponential"], seed) for seed in range(20)]
    ours = math.fsum((fitted(recording).ppm - 50) ** 2 for recording in recorded)
    plain = math.fsum((least_squares_ppm(recording) - 50) ** 2 for recording in recorded)
    assert ours * 25 < plain


def test_two_seconds_in_which_nothing_came_through_move_it_little():
    """The disk of the recording computer stood still: all that was due then came at once, and late."""
    recorded = arrivals(50.0, 60.0, DELAYS["exponential"], 3, stall=(20.0, 22.0))
    assert abs(fitted(recorded).ppm - 50) < 1.0
    assert abs(least_squares_ppm(recorded) - 50) > 20


def test_memory_stays_bounded_and_the_error_falls_with_time():
    clock, errors = ClockFit(), []
    for n, (device_s, t_ns) in enumerate(arrivals(50.0, 3600.0, DELAYS["uniform"], 1, every_s=0.1), start=1):
        clock.add(device_s, t_ns)
        assert len(clock.bins) <= BINS
        if n in (300, 3000, 36_000):
            errors.append(abs(clock.fit().ppm - 50))
    assert errors[2] < 0.01 and errors[2] < errors[1] < errors[0]


def test_a_recording_that_ran_twenty_times_too_fast_is_measured_too():
    pairs = [(20.0 * device_s, t_ns) for device_s, t_ns in arrivals(0.0, 20.0, DELAYS["uniform"], 1)]
    assert fitted(pairs).pace == pytest.approx(20.0, rel=1e-5)


def test_a_device_that_counts_from_long_ago_loses_no_digits():
    """But those that a float has not got: 0.5 us after 68 years, over 10 s or so."""
    recorded = arrivals(50.0, 20.0, DELAYS["exponential"], 1)
    shifted = [(device_s + 2.0**31, t_ns) for device_s, t_ns in recorded]
    assert fitted(shifted).ppm == pytest.approx(fitted(recorded).ppm, abs=0.1)


@pytest.mark.parametrize(
    ("seconds", "ppm"), [(10.0, 0.0), (10.0, 5.0), (10.0, 20.0), (10.0, 180.0), (60.0, 0.0), (60.0, 20.0)]
)
def test_arrivals_that_are_only_noticed_every_millisecond_are_not_believed_further(ppm, seconds):
    """All of them lie on one line then, whatever the clock does: the stated error must not be that line's scatter."""
    off = []
    for seed in range(10):
        exact = arrivals(ppm, seconds, DELAYS["exponential"], seed)
        fit = fitted([(device_s, -(-t_ns // 1_000_000) * 1_000_000) for device_s, t_ns in exact])
        off.append(0.0 if fit is None else abs(fit.ppm - ppm) / fit.se_ppm)
    assert sum(error < 3 for error in off) >= 9


@pytest.mark.parametrize(
    "pairs",
    [
        [],
        [(0.01, 5)],
        [(n / 100, 5) for n in range(3)],
        [(n / 10, 7) for n in range(200)],  # everything at once
        [(n / 10, n * 100_000_000) for n in range(200)],  # never late: nobody looked
        [(1.0, n) for n in range(200)],  # the device's clock stands
        [(n / 10, 10**12 - n * 10**8) for n in range(200)],  # the host's clock runs backwards
        [(math.nan, n) for n in range(200)],
    ],
)
def test_unusable_arrivals_give_no_drift(pairs):
    assert fitted(pairs) is None


@pytest.mark.parametrize("took_s", [0.0005, 0.02, 0.2])
def test_samples_that_were_held_back_and_came_in_one_burst_tell_no_pace(took_s):
    chance = random.Random(1)
    came_s = sorted(10 + took_s * n / 200 + chance.expovariate(1e4) for n in range(200))
    assert fitted([(n * 0.1, round(t_s * NS)) for n, t_s in enumerate(came_s)]) is None
