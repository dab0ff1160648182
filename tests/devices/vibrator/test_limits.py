"""Attempts to get past the driver's limits, and the watchdog."""

import threading

import numpy as np
import pytest

from palpate.devices.device import DeviceFault
from palpate.devices.vibrator.exposure import Exposure, VoltGuard, hand_arm_weight, weighted_energy
from palpate.devices.vibrator.player import Player
from palpate.devices.vibrator.settings import Limits
from tests.devices.vibrator.benches import DESK, RATE, Window, bench, played, present, run

T = np.arange(RATE) / RATE


def sine(peak_m_s2, hz=200, seconds=1.0):
    return peak_m_s2 * np.sin(2 * np.pi * hz * np.arange(round(seconds * RATE)) / RATE)


def test_the_hand_arm_weighting_is_that_of_the_standards_table():
    """ISO 5349-1:2001, table A.2: Wh at the third octaves."""
    table = {6.3: 0.727, 8: 0.873, 12.5: 0.958, 16: 0.896, 31.5: 0.519, 63: 0.256, 125: 0.127, 250: 0.0634,
             500: 0.0314, 1000: 0.0135}  # fmt: skip
    exact = [10 ** (round(10 * np.log10(hz)) / 10) for hz in table]
    assert hand_arm_weight(np.array(exact)) == pytest.approx(list(table.values()), rel=0.01)
    weight = float(hand_arm_weight(np.array([200.0]))[0])
    assert weighted_energy(sine(2.0), RATE) == pytest.approx(2 * weight**2, rel=1e-6)


@pytest.mark.parametrize(
    ("wish", "what", "message"),
    [
        (np.r_[sine(1), np.nan], "not_a_number", "sample 8000 is nan"),
        (np.r_[np.inf, sine(1)], "not_a_number", "sample 0 is inf"),
        (sine(301), "limit", r"a peak of 301 m/s\^2; at most limits.peak_m_s2 = 300"),
        (sine(1e30), "limit", "limits.peak_m_s2"),
        (sine(60, 20), "limit", r"a displacement of 3[78]\d\d um; at most limits.peak_um = 1000"),
        (sine(1, 200, 20.1), "limit", r"20.1 s; at most limits.longest_s"),
    ],
)
def test_the_driver_called_directly_plays_nothing_beyond_a_limit(wish, what, message):
    vibrator, clock = bench()
    with pytest.raises(DeviceFault, match=message) as refused:
        vibrator.play(wish, 0.0, clock.ns)
    assert refused.value.what == what and not vibrator.player.busy
    clock.s += 1
    vibrator.check_output()
    assert not played(vibrator)[0].any()


def test_many_short_ones_are_stopped_by_the_exposure_and_a_long_day_by_the_daily_one():
    exposure = Exposure("shaker", Limits(hand_arm_m_s2=2.0, window_s=10), RATE)
    short, count = sine(100, 200, 0.1), 0
    with pytest.raises(DeviceFault, match=r"with those before it .*; at most 2: wait before the next"):
        for count in range(1000):
            exposure.take(short, 0.1 * count)
    assert 0 < count < 100 and exposure.recent <= 2.0**2 * 10
    exposure.take(short, 1000.0)  # after a rest it plays again
    tired, day = Exposure("shaker", Limits(a8_m_s2=0.1, window_s=1), RATE), 0
    with pytest.raises(DeviceFault, match="the daily exposure A.8. would be 0.1.* m/s.2; at most .*: end for today"):
        for day in range(10_000):
            tired.take(sine(30), 100.0 * day)
    assert day > 10 and tired.a8_m_s2 <= 0.1


@pytest.mark.parametrize(
    ("volts", "what"), [([0.1, np.nan], "not_a_number"), ([0.1, -np.inf], "not_a_number"), ([0.2, 0.5, 1.01], "limit")]
)
def test_volts_that_are_put_into_the_player_itself_are_checked_in_the_callback(volts, what):
    player = Player("shaker", RATE, VoltGuard(Limits(), RATE), 0.5)
    player.play(np.array([*volts, *[0.3] * 4000]), 0.0, lambda: 0)
    out = np.concatenate([player.fill(7) for _ in range(20)])
    assert np.isfinite(out).all() and np.abs(out).max() <= 0.5 and not out[40:].any()
    assert np.array_equal(out[: len(volts) - 1], volts[:-1]) and player.fault().what == what
    assert np.abs(np.diff(out[len(volts) - 2 :])).max() < 0.1 and player.silent.is_set()


def test_an_rms_beyond_the_thermal_limit_is_switched_off_before_it_is_reached():
    limits = Limits(rms_V=0.3, thermal_s=0.5)
    player = Player("shaker", RATE, VoltGuard(limits, RATE), 100.0)
    player.play(np.full(4 * RATE, 0.9), 0.0, lambda: 0)
    out = np.concatenate([player.fill(64) for _ in range(10)])
    sounding = np.count_nonzero(out == 0.9)
    expected = -0.5 * RATE * np.log(1 - (0.3 / 0.9) ** 2)
    assert sounding == pytest.approx(expected, abs=2) and player.fault().what == "limit"
    player.play(np.full(100, 0.9), 0.0, lambda: 0)
    player.fill(300)
    assert player.fault() is not None, "it has not cooled yet"
    for _ in range(500):
        player.fill(64)
    player.play(np.full(100, 0.9), 0.0, lambda: 0)
    player.fill(300)
    assert player.fault() is None


def test_a_procedure_that_hangs_is_silenced_by_the_callback_after_half_a_second():
    vibrator, clock = bench()
    vibrator.play(sine(3, seconds=3), 0.0, clock.ns)
    run(vibrator, clock, 1.0)
    clock.s += 2.0
    vibrator.check_output()
    volts, _ = played(vibrator)
    last = int(np.flatnonzero(volts)[-1])
    assert round(1.49 * RATE) - 1 <= last <= round(1.49 * RATE) + 32, "half a second after the last feed"
    assert np.abs(np.diff(volts[last - 60 : last + 2])).max() < 2 * np.abs(np.diff(volts[:RATE])).max()
    with pytest.raises(DeviceFault, match="nobody fed it for 0.5 s") as hung:
        vibrator.feed()
    assert hung.value.what == "heartbeat_lost"


def test_a_window_that_stands_still_makes_the_trial_a_fault():
    vibrator, clock = bench()
    columns = {"waveform": "sine", "frequency_hz": "200", "level_db": "0", "seconds": "2"}
    fault = vibrator.perform(present(columns), Window(clock, frame_s=0.7), DESK, clock.ns)
    assert fault.value["what"] == "heartbeat_lost" and "shaker" in fault.value["message"]


def test_two_threads_cannot_play_at_once_and_what_plays_is_not_changed_afterwards():
    vibrator, clock = bench()
    begin, results, wish = threading.Barrier(8), [], sine(3)

    def attack():
        begin.wait()
        try:
            vibrator.play(wish, 0.0, clock.ns)
            results.append("played")
        except DeviceFault as fault:
            results.append(fault.what)

    threads = [threading.Thread(target=attack) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(results) == ["played", *["refused"] * 7]
    energy = weighted_energy(wish, RATE)
    assert vibrator.exposure.total == pytest.approx(energy, rel=1e-12)
    volts = np.full(100, 0.5)
    player = Player("shaker", RATE, VoltGuard(Limits(), RATE), 1.0)
    player.play(volts, 0.0, lambda: 0)
    volts[:] = 1e9
    assert player.fill(100).max() == 0.5


def test_safe_ends_it_in_four_ms_and_close_leaves_silence():
    vibrator, clock = bench()
    vibrator.play(sine(3, seconds=3), 0.0, clock.ns)
    run(vibrator, clock, 0.2)
    vibrator.safe()
    vibrator.safe()
    clock.s += 0.5
    vibrator.check_output()
    volts, _ = played(vibrator)
    assert int(np.flatnonzero(volts)[-1]) <= round(0.204 * RATE)
    vibrator.close()
    vibrator.close()
