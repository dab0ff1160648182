"""Two sensors on one card: one task, and each starts, stops, loses and fails for itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from palpate.devices.daq import accelerometer, force_torque
from palpate.devices.daq.acquire import Pace
from palpate.devices.daq.shared import share_cards
from palpate.devices.device import DeviceError, DeviceFault
from tests.devices.daq import board

pytestmark = pytest.mark.needs("nidaqmx")


def wired(force_hz=9000.0, other_hz=3000.0, channels="Dev1/ai8:10", buffer_s=0.5):
    force = force_torque.make(
        "force",
        force_torque.Settings(
            kind="force_torque", driver="nidaqmx", rate_hz=force_hz, calibration=str(force_torque.SAMPLE), zero_s=0,
            buffer_s=buffer_s,
        ),
        Path(),
    )  # fmt: skip
    vibration = accelerometer.make(
        "vibration",
        accelerometer.Settings(
            kind="accelerometer", driver="nidaqmx", rate_hz=other_hz, channels=channels, buffer_s=buffer_s
        ),
        Path(),
    )
    share_cards([force, object(), vibration])
    return force.daq, vibration.daq


@pytest.fixture
def card(monkeypatch):
    plugged = board.Card()
    board.plug_in(monkeypatch, plugged)
    return plugged


def everything(daq) -> tuple[np.ndarray, int]:
    parts, lost = [], 0
    while len((taken := daq.read(100, 0.0)).volts):
        parts.append(taken.volts)
        lost += taken.lost
    return np.concatenate(parts), lost


def test_each_sensor_takes_its_own_inputs_in_its_own_range_at_its_own_rate(card) -> None:
    force, vibration = wired()
    pace = Pace(card.elapsed_s, card.wait)
    force.open(), vibration.open()
    state = card.holder.state
    assert state.channels == [*(f"Dev1/ai{n}" for n in range(6)), "Dev1/ai8", "Dev1/ai9", "Dev1/ai10"]
    assert state.arguments["range"] == (-5.0, 5.0)  # of those added last
    force.start(pace), vibration.start(pace)
    card.wait(0.2)
    fast, slow = everything(force), everything(vibration)
    assert (fast[1], slow[1]) == (0, 0)
    assert np.array_equal(fast[0], card.volts(0, 1800, 9).T[:, :6])
    assert np.array_equal(slow[0], card.volts(0, 1800, 9).T[::3, 6:])
    force.close()
    assert card.holder is not None
    vibration.close(), vibration.close()
    assert card.holder is None


def test_one_that_starts_later_begins_with_the_next_sample_and_disturbs_nobody(card) -> None:
    force, vibration = wired()
    pace = Pace(card.elapsed_s, card.wait)
    force.open(), vibration.open()
    force.start(pace)
    card.wait(0.1)
    vibration.start(pace)
    card.wait(0.1)
    assert everything(vibration)[0][0, 0] == pytest.approx(0.9 + 6)
    assert len(everything(force)[0]) == 1800
    force.stop()
    card.wait(0.1)
    assert (len(everything(vibration)[0]), force.read(10, 0.0).lost) == (300, 0)
    vibration.stop()
    assert card.holder.state.started_s is None


def test_what_the_card_loses_each_sensor_counts_in_its_own_samples(card) -> None:
    force, vibration = wired()
    pace = Pace(card.elapsed_s, card.wait)
    force.open(), vibration.open()
    force.start(pace), vibration.start(pace)
    card.wait(0.1001)
    everything(force), everything(vibration)
    card.wait(2.0)
    (fast, fast_lost), (slow, slow_lost) = everything(force), everything(vibration)
    assert fast[0, 0] == pytest.approx((900 + fast_lost) / 1000)
    assert (slow[0, 0] - 6) * 1000 == pytest.approx(3 * (300 + slow_lost))
    assert 900 + fast_lost + len(fast) == pytest.approx(2.1001 * 9000, abs=1)
    assert 300 + slow_lost + len(slow) == pytest.approx(2.1001 * 3000, abs=1)


def test_one_that_nobody_reads_loses_its_own_samples_and_no_others(card) -> None:
    force, vibration = wired()
    pace = Pace(card.elapsed_s, card.wait)
    force.open(), vibration.open()
    force.start(pace), vibration.start(pace)
    total = 0
    for _ in range(40):
        card.wait(0.05)
        volts, lost = everything(force)
        total += len(volts)
        assert lost == 0
    assert total == 18_000
    volts, lost = everything(vibration)
    assert len(volts) == vibration.wiring.buffer
    assert (lost + len(volts), (volts[0, 0] - 6) * 1000) == (6000, pytest.approx(3 * lost))


def test_a_card_that_fails_is_a_fault_of_each_sensor_by_its_own_name(card) -> None:
    force, vibration = wired()
    pace = Pace(card.elapsed_s, card.wait)
    force.open(), vibration.open()
    force.start(pace), vibration.start(pace)
    card.broken = -88705
    for daq in (force, vibration):
        with pytest.raises(DeviceFault, match="the card is gone") as caught:
            daq.read(10, 0.0)
        assert (caught.value.device, caught.value.what) == (daq.name, "link_lost")
    force.close(), vibration.close()


def test_rates_without_a_common_clock_and_inputs_wired_twice_are_refused() -> None:
    with pytest.raises(DeviceError, match="vibration: Dev1 has one clock .* 10000 Hz, .* write `rate_hz: 3333.33333`"):
        wired(force_hz=10_000.0)
    with pytest.raises(DeviceError, match="force and vibration: an input of Dev1 is wired to both"):
        wired(channels="Dev1/ai5:7")


def test_sensors_on_cards_of_their_own_are_left_alone_and_a_closed_one_does_not_start(card) -> None:
    force, vibration = wired(force_hz=10_000.0, channels="Dev2/ai0:2")
    assert not hasattr(force, "card")
    assert not hasattr(vibration, "card")
    force, vibration = wired()
    with pytest.raises(DeviceError, match="force: the card is not open"):
        force.start(Pace(card.elapsed_s, card.wait))
    assert vibration.read(10, 0.0).volts.shape == (0, 3)
