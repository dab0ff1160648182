"""The DAQ card's output: fed in time, without regeneration, led to zero however it ends, and every refusal in words."""

import threading

import nidaqmx.error_codes
import numpy as np
import pytest

from palpate.devices.actuator import analog_out
from palpate.devices.actuator.analog_out import AnalogOut
from palpate.devices.actuator.device import make
from palpate.devices.actuator.queue import Queue
from palpate.devices.actuator.settings import Settings
from palpate.devices.device import DeviceError
from tests.devices.actuator.ni_card import Card

pytestmark = pytest.mark.needs("nidaqmx")


class Still(AnalogOut):
    """Fed by the test and not by its thread."""

    def _go_on(self):
        pass


def output(card, **changes):
    return Still("coil", "Dev1/ao0", 10.0, 20, package=lambda: card, pause=lambda _s: None, **changes)


def test_the_card_is_asked_for_a_clocked_output_without_regeneration():
    card = Card()
    out = output(card)
    out.open()
    assert card.tasks[0].closed
    out.start(np.zeros)
    task = card.tasks[1]
    assert task.settings == {"channel": "Dev1/ao0", "range": (-10.0, 10.0), "rate": 1000, "mode": "CONTINUOUS"}
    assert task.out_stream.regen_mode.name == "DONT_ALLOW_REGENERATION" and task.out_stream.output_buf_size == 20
    out.stop()
    assert all(task.closed for task in card.tasks)


def test_what_waits_in_the_queue_reaches_the_output_to_the_sample_and_the_buffer_stays_full():
    card, queue = Card(), Queue(100)
    out = output(card)
    out.start(queue.take)
    sent = np.sin(np.arange(300.0) / 9)
    for place in range(0, 300, 5):
        queue.write(sent[place : place + 5])
        card.pass_ms(5)
        assert out.feed()
        assert len(card.tasks[-1].buffer) - card.tasks[-1].generated == 20
    queue.rest()
    assert np.allclose(card.voltages[20:300], sent[:280])
    out.stop()


@pytest.mark.parametrize("code", sorted(analog_out.EMPTY))
def test_a_card_that_ran_empty_is_a_fault_and_its_held_voltage_is_led_to_zero(code):
    card = Card()
    out = output(card)
    out.start(lambda count: np.full(count, 0.8))
    card.pass_ms(12)
    card.fails = {"ask": code}
    assert not out.feed()
    card.fails = {}
    assert card.voltages[-5] == 0.8 and card.voltages[-1] == pytest.approx(0.0)
    fault = out.fault()
    assert fault.what == "underrun" and "raise `ahead_ms`" in str(fault) and str(code) in str(fault)
    assert not out.feed()


def test_an_underrun_of_the_card_itself_is_noticed_at_the_next_look():
    card = Card()
    out = output(card)
    out.start(np.ones)
    card.pass_ms(25)
    assert not out.feed()
    assert out.fault().what == "underrun"
    ramp = card.voltages[-4:]
    assert card.voltages[-5] == 1.0 and ramp[-1] == pytest.approx(0.0) and np.all(np.diff([1.0, *ramp]) < 0)


def test_cutting_drops_the_buffer_and_ramps_from_the_voltage_that_is_out_now():
    card = Card()
    out = output(card)
    out.start(lambda count: np.linspace(0.1, 2.0, count))
    card.pass_ms(10)
    held = card.voltages[-1]
    out.cut()
    card.pass_ms(10)
    after = card.voltages[10:]
    assert len(after) == 4 and after[-1] == pytest.approx(0.0)
    assert after[0] == pytest.approx(held * 0.8535533905932737)
    assert not out.feed()
    out.start(np.zeros)
    assert out.feed()
    out.stop()


def test_a_card_that_is_pulled_is_link_lost_and_stopping_it_stays_quiet():
    card = Card()
    out = output(card)
    out.start(np.ones)
    card.fails = {"ask": -200045, "task": -200220}
    assert not out.feed()
    assert out.fault().what == "link_lost" and "see its cable" in str(out.fault())
    out.stop()


def test_the_thread_feeds_the_card_until_it_is_stopped():
    card, fed = Card(), threading.Event()
    out = AnalogOut("coil", "Dev1/ao0", 10.0, 20, package=lambda: card, pause=lambda _s: None)
    waits = []

    def fill(count):
        waits.append(count)
        if len(waits) > 2:
            fed.set()
        return np.zeros(count)

    out.start(fill)
    card.pass_ms(5)
    for _ in range(50):
        if fed.wait(0.1):
            break
        card.pass_ms(1)
    assert fed.is_set()
    thread = out._thread
    out.stop()
    assert not thread.is_alive()


@pytest.mark.parametrize(
    ("act", "code", "message"),
    [
        ("channel", -200170, "no such output: correct `channel`"),
        ("channel", -200220, "its name in NI MAX"),
        ("reserve", -50103, "another program uses this output"),
        ("reserve", -200077, "see the NI-DAQmx message. NI-DAQmx -200077: The reserve failed."),
    ],
)
def test_a_card_that_cannot_be_had_says_why(act, code, message):
    with pytest.raises(DeviceError, match=message):
        output(Card({act: code})).open()


def test_without_the_driver_the_real_package_is_refused_in_words(tmp_path):
    device = make("coil", Settings(kind="voice_coil", driver="nidaqmx"), tmp_path)
    with pytest.raises(DeviceError, match="coil: the NI-DAQmx driver is not installed on this machine"):
        device.open()
    device.close()


def test_the_codes_are_those_of_the_package():
    for code, name in (analog_out.EMPTY | analog_out.PULLED).items():
        assert int(getattr(nidaqmx.error_codes.DAQmxErrors, name)) == code
