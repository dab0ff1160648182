"""The card's driver against a stand-in whose every name and signature is that of the installed package."""

from __future__ import annotations

import inspect
import sys

import numpy as np
import pytest
from nidaqmx import constants, stream_readers, system, task
from nidaqmx.error_codes import DAQmxErrors
from nidaqmx.errors import DaqError
from nidaqmx.task import collections

from palpate.devices.daq import ni as ni_errors
from palpate.devices.daq.acquire import Pace, Wiring, channel_names, demand_channels
from palpate.devices.daq.ni import NiDaq
from palpate.devices.device import FAULTS, DeviceError, DeviceFault
from tests.devices.daq import board

pytestmark = pytest.mark.needs("nidaqmx")

SIX = tuple(f"Dev1/ai{n}" for n in range(6))
PARTS_OF_A_TASK = (board.AIChannelCollection, board.Timing, board.InStream)
WIRING = Wiring(SIX, -10.0, 10.0, 10_000.0, buffer_s=0.2, terminals="diff")


@pytest.fixture
def card(monkeypatch):
    plugged = board.Card()
    board.plug_in(monkeypatch, plugged)
    return plugged


@pytest.fixture
def daq(card):
    daq = NiDaq("force", WIRING)
    daq.open()
    yield daq
    card.broken = 0
    daq.close()


def started(daq, card):
    daq.start(Pace(card.elapsed_s, card.wait))
    return daq


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        (board.task_class(board.Card()), task.Task),
        (board.AIChannelCollection, collections.AIChannelCollection),
        (board.Timing, task.Timing),
        (board.InStream, task.InStream),
        (board.AnalogMultiChannelReader, stream_readers.AnalogMultiChannelReader),
        (board.Device, system.Device),
    ],
)
def test_the_stand_in_has_the_names_and_signatures_of_the_real_package(ours, theirs) -> None:
    checked = 0
    for name, mine in vars(ours).items():
        if name.startswith("_") and (name != "__init__" or ours in PARTS_OF_A_TASK):
            continue
        real = getattr(theirs, name)
        if isinstance(mine, property):
            assert isinstance(real, property), name
            assert mine.fset is None or real.fset is not None, name
        else:
            theirs_bare = inspect.signature(real).replace(return_annotation=inspect.Signature.empty)
            assert inspect.signature(mine) == theirs_bare, name
        checked += 1
    assert checked


def test_every_error_code_bears_the_name_that_the_package_gives_it() -> None:
    tables = (ni_errors.STOPPED, ni_errors.GONE, ni_errors.INPUTS, ni_errors.RESERVED, ni_errors.RATE, ni_errors.VALUE)
    for table in tables:
        assert {code: DAQmxErrors(code).name for code in table} == table
    assert DAQmxErrors(ni_errors.OVERWRITTEN).name == "SAMPLES_NO_LONGER_AVAILABLE"
    assert DAQmxErrors(ni_errors.NOT_YET).name == "SAMPLES_NOT_YET_AVAILABLE"
    assert {ni_errors.failed("x", code, "").what for table in tables for code in table} <= set(FAULTS)


def test_the_real_package_without_a_driver_says_what_to_do() -> None:
    with pytest.raises(DeviceError, match=r"force: the NI-DAQmx driver is not installed .* install it from ni.com"):
        NiDaq("force", WIRING).open()


def test_without_the_package_it_says_what_to_install(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "nidaqmx", None)
    with pytest.raises(DeviceError, match=r"not installed; pip install 'palpate\[rig\]', or write `driver: twin`"):
        NiDaq("force", WIRING).open()


def test_the_task_is_wired_clocked_and_buffered_as_set(daq) -> None:
    state = daq.task.state
    assert state.channels == list(SIX)
    assert state.arguments == {
        "terminals": constants.TerminalConfiguration.DIFF,
        "range": (-10.0, 10.0),
        "mode": constants.AcquisitionType.CONTINUOUS,
        "asked": 2000,
    }
    assert (state.rate_hz, state.buffer) == (10_000.0, 2000)
    assert state.overwrite is constants.OverwriteMode.OVERWRITE_UNREAD_SAMPLES
    assert daq.facts == {"card": "USB-6351", "serial": "1A2B3C4", "rate_hz": "10000"}


def test_every_sample_comes_once_in_order_however_it_is_read(daq, card) -> None:
    started(daq, card)
    blocks = []
    for timeout_s, passes_s in ((0.05, 0.0), (0.0, 0.013), (0.05, 0.1), (0.02, 0.0003), (0.0, 0.0)):
        card.wait(passes_s)
        blocks.append(daq.read(700, timeout_s).volts)
    volts = np.concatenate(blocks)
    assert np.array_equal(volts, card.volts(0, len(volts), 6).T)
    assert [len(block) for block in blocks] == [50, 130, 700, 303, 0]


def test_a_read_that_finds_nothing_waits_no_longer_than_its_timeout(daq, card) -> None:
    started(daq, card)
    card.stalled = True
    before = card.now_s
    assert not len(daq.read(100, 0.05).volts)
    assert card.now_s - before == pytest.approx(0.05, abs=0.006)


def test_what_was_overwritten_is_counted_and_sampling_goes_on(daq, card) -> None:
    started(daq, card)
    card.wait(0.05)
    assert len(daq.read(5000, 0.0).volts) == 500
    card.wait(1.0)
    after = daq.read(5000, 0.0)
    assert len(after.volts) == 1000
    assert after.lost == 10_500 - 500 - 1000
    assert after.volts[0, 0] == pytest.approx((500 + after.lost) / 1000)
    card.wait(0.01)
    then = daq.read(5000, 0.0)
    assert (then.lost, then.volts[0, 0]) == (0, pytest.approx(10.5))


@pytest.mark.parametrize(
    ("code", "what"),
    [(-200361, "overrun"), (-200222, "overrun"), (-200278, "overrun"), (-88705, "link_lost"), (-200324, "link_lost"),
     (-200989, "refused")],
)  # fmt: skip
def test_a_card_that_fails_while_it_samples_is_a_fault_by_name(daq, card, code, what) -> None:
    started(daq, card)
    card.wait(0.1)
    card.broken = code
    with pytest.raises(DeviceFault, match=f"force: .* NI-DAQmx {code}: The card said") as caught:
        daq.read(100, 0.0)
    assert (caught.value.device, caught.value.what) == ("force", what)
    daq.close()


def test_a_loss_that_cannot_be_counted_is_a_fault_not_a_guess(daq, card, monkeypatch) -> None:
    started(daq, card)
    card.wait(1.0)
    monkeypatch.setattr(board.InStream, "curr_read_pos", property(lambda self: 3))
    with pytest.raises(DeviceFault, match="how many are missing is unknown") as caught:
        daq.read(100, 0.0)
    assert caught.value.what == "overrun"


@pytest.mark.parametrize(
    ("wiring", "words"),
    [
        (Wiring(("Dev7/ai0",), -5, 5, 1000), "the card is not there; see its cable .* -200220"),
        (Wiring(("Dev1/ai99",), -5, 5, 1000), "the card has no such input; correct `channels`"),
        (Wiring(SIX, -5, 5, 190_000), "the card cannot sample this many inputs at this rate; lower `rate_hz`"),
        (Wiring(SIX[:1], -5, 5, 970_000), "can sample at 970874 Hz, not at 970000; write `rate_hz: 970874`"),
    ],
)
def test_a_card_that_cannot_be_had_as_wired_says_what_to_change(card, wiring, words) -> None:
    with pytest.raises(DeviceError, match=words):
        NiDaq("force", wiring).open()
    assert (card.holder, card.closed) == (None, ["closed"])


def test_a_card_that_another_sensor_holds_is_not_shared_and_is_free_again_after_it(card, daq) -> None:
    other = NiDaq("vibration", Wiring(("Dev1/ai6",), -5, 5, 3000))
    with pytest.raises(DeviceError, match="vibration: another program samples on this card, which has one converter"):
        other.open()
    daq.close()
    other.open()
    other.close()
    other.close()
    assert card.holder is None


def test_a_bug_of_ours_is_not_reported_as_a_fault_of_the_card(card, monkeypatch) -> None:
    monkeypatch.setattr(board.Timing, "cfg_samp_clk_timing", lambda *_a, **_k: {}["bug"])
    with pytest.raises(KeyError):
        NiDaq("force", WIRING).open()
    assert card.closed == ["closed"]


def test_reading_before_the_start_gives_nothing_and_starting_after_the_end_is_refused(card) -> None:
    daq = NiDaq("force", WIRING)
    assert daq.read(10, 0.1).volts.shape == (0, 6)
    with pytest.raises(DeviceError, match="the card is not open"):
        daq.start(Pace(card.elapsed_s, card.wait))


def test_only_the_first_line_of_a_driver_error_is_shown() -> None:
    error = DaqError("Device is gone.\nProperty: x\nValue: y", -200324, "task")
    assert str(ni_errors.refused("force", error.error_code, str(error))).endswith("NI-DAQmx -200324: Device is gone.")


@pytest.mark.parametrize(
    ("spelled", "names"),
    [
        ("Dev1/ai0:2", ("Dev1/ai0", "Dev1/ai1", "Dev1/ai2")),
        ("Dev1/ai2:0", ("Dev1/ai2", "Dev1/ai1", "Dev1/ai0")),
        ("cDAQ1Mod2/ai4, ai7", ("cDAQ1Mod2/ai4", "cDAQ1Mod2/ai7")),
        ("Dev1/ai0:ai1,Dev2/ai3", ("Dev1/ai0", "Dev1/ai1", "Dev2/ai3")),
    ],
)
def test_inputs_are_spelled_as_the_driver_spells_them(spelled, names) -> None:
    assert channel_names(spelled, "force") == names


@pytest.mark.parametrize("spelled", ["", "ai0", "Dev1", "Dev1/ai", "Dev1/ai0:", "Dev1/ai0:1,Dev1/ai1", "Dev1/ai0;ai1"])
def test_inputs_that_cannot_be_meant_are_refused(spelled) -> None:
    with pytest.raises(DeviceError, match="force: channels"):
        channel_names(spelled, "force")


def test_a_sensor_with_too_few_wires_is_refused() -> None:
    with pytest.raises(DeviceError, match="are 5 inputs; 6 are expected: one for each gauge"):
        demand_channels("Dev1/ai0:4", 6, "force", "one for each gauge")
