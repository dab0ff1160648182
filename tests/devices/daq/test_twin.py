"""The twin of a card: the rate, the bits, the noise and the overruns of a real one, and nothing that chance decides."""

from __future__ import annotations

from itertools import repeat

import numpy as np
import pytest

from palpate.devices.daq.acquire import Pace, Wiring
from palpate.devices.daq.twin import TwinDaq, gaussians, quantised
from palpate.devices.device import DeviceError
from palpate.devices.noise import gaussians as plain_gaussians
from tests.devices.daq.scenes import Clock

WIRING = Wiring(("Dev1/ai0", "Dev1/ai1"), -5.0, 5.0, 1000.0, buffer_s=0.5)


def counting(scene, rate_hz):
    """Sample n is n mV on one wire, minus that on the other."""
    first = 0
    while True:
        n = np.arange(first, first + 64) / 1000
        yield np.column_stack([n, -n])
        first += 64


def started(clock, ideal=counting, noise_V=0.0, key=(1,)):
    daq = TwinDaq("force", WIRING, ideal, noise_V, key)
    daq.open()
    daq.start(Pace.by_clock(clock))
    return daq


def test_samples_fall_due_at_the_rate_and_each_comes_once() -> None:
    clock = Clock()
    daq = started(clock)
    blocks = []
    for passes_s in (0.0, 0.0105, 0.2, 0.0, 0.4):
        clock.now_s += passes_s
        blocks.append(daq.read(150, 0.0).volts)
    assert [len(block) for block in blocks] == [0, 10, 150, 50, 150]
    assert np.concatenate(blocks)[:, 0] == pytest.approx(np.arange(360) / 1000, abs=1e-4)


def test_what_is_not_read_in_time_is_overwritten_and_counted() -> None:
    clock = Clock()
    daq = started(clock)
    clock.now_s = 0.1
    daq.read(1000, 0.0)
    clock.now_s = 3.1
    taken = daq.read(1000, 0.0)
    assert (taken.lost, len(taken.volts)) == (2500, 500)
    assert taken.volts[0, 0] == pytest.approx(2.6, abs=1e-3)
    clock.now_s = 3.2
    again = daq.read(1000, 0.0)
    assert (again.lost, again.volts[0, 0]) == (0, pytest.approx(3.1, abs=1e-3))


def test_hours_that_nobody_reads_are_lost_in_small_pieces() -> None:
    clock = Clock()
    daq = started(clock, lambda scene, rate_hz: repeat(np.zeros((512, 2))))
    clock.now_s = 3600.0
    taken = daq.read(10_000, 0.0)
    assert (taken.lost, len(taken.volts)) == (3_600_000 - 500, 500)


def test_real_time_is_waited_for_and_no_longer_than_the_timeout() -> None:
    clock, waits = Clock(), []

    def wait(seconds):
        waits.append(seconds)
        clock.now_s += seconds

    daq = started(clock)
    daq.start(Pace(clock, wait))
    assert len(daq.read(1000, 0.02).volts) == 5
    assert len(daq.read(1000, 0.001).volts) == 1
    assert sum(waits) == pytest.approx(0.006)


def test_sixteen_bits_round_to_a_step_and_cut_at_the_range() -> None:
    step = 10 / 2**16
    volts = quantised(np.array([[0.4 * step, 0.6 * step], [-7.0, 7.0]]), WIRING)
    assert volts.tolist() == [[0.0, step], [-5.0, 5.0 - step]]


def test_the_noise_depends_on_its_key_and_not_on_how_it_is_read() -> None:
    def read(steps, key):
        clock = Clock()
        daq = started(clock, lambda scene, rate_hz: repeat(np.zeros((100, 2))), 0.01, key)
        parts = []
        for step in steps:
            clock.now_s += step
            parts.append(daq.read(10_000, 0.0).volts)
        return np.concatenate(parts)[:400]

    once, often = read([0.45], (1,)), read([0.0333] * 13, (1,))
    assert np.array_equal(once, often)
    assert once.std(axis=0) == pytest.approx([0.01, 0.01], rel=0.15)
    assert not np.array_equal(once, read([0.45], (2,)))


def test_no_two_acts_share_their_noise() -> None:
    clock = Clock()
    daq = started(clock, lambda scene, rate_hz: repeat(np.zeros((100, 2))), 0.01)
    clock.now_s = 0.4
    first = daq.read(400, 0.0).volts
    daq.start(Pace.by_clock(clock))
    clock.now_s = 0.8
    assert abs(np.corrcoef(first[:, 0], daq.read(400, 0.0).volts[:, 0])[0, 1]) < 0.2


def test_its_gaussians_are_those_of_the_other_twins() -> None:
    assert gaussians((5, 2), "a", 1).ravel().tolist() == plain_gaussians(10, "a", 1)


def test_a_card_that_is_not_open_does_not_start_and_one_that_is_not_started_gives_nothing() -> None:
    daq = TwinDaq("force", WIRING, counting, 0.0)
    with pytest.raises(DeviceError, match="not open"):
        daq.start(Pace.by_clock(Clock()))
    daq.open()
    assert daq.read(10, 0.1).volts.shape == (0, 2)
