"""A vibrator's samples reach a DAQ card and a sound card as they are, in volts and in shares of full scale."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.devices.actuator.analog_out import AnalogOut
from palpate.devices.device import DeviceFault
from palpate.devices.vibrator.device import make
from palpate.devices.vibrator.exposure import VoltGuard
from palpate.devices.vibrator.outputs import ScaledCard, output_of
from palpate.devices.vibrator.player import Player
from palpate.devices.vibrator.settings import Limits, Settings

RATE = 48_000


def settings(**changes):
    return Settings(**{"kind": "vibrator", "driver": "twin", **changes})


@pytest.mark.needs("nidaqmx")
def test_a_daq_card_plays_the_volts_at_its_own_rate_and_says_how_long_they_wait():
    from tests.devices.actuator.ni_card import Card

    class Still(AnalogOut):
        def _go_on(self):
            pass

    card = Card()
    out = Still("shaker", "Dev1/ao0", 10.0, 960, package=lambda: card, pause=lambda _s: None, rate_hz=RATE)
    player = Player("shaker", RATE, VoltGuard(Limits(), RATE), 0.5, out.wait_s)
    out.start(player.fill)
    assert card.tasks[0].settings["rate"] == RATE and out.wait_s() == pytest.approx(0.02)
    card.pass_ms(100)
    out.feed()
    sent = 0.5 * np.sin(np.arange(2000) / 40)
    player.play(sent, 0.0, lambda: 1_000_000_000)
    for _ in range(400):
        card.pass_ms(10)
        out.feed()
        player.feed()
    assert player.onset_ns == pytest.approx(1_000_000_000 + (960 - 10) / RATE * 1e9, abs=1)
    assert card.voltages[960 + 100 : 960 + 100 + 2000] == pytest.approx(sent.tolist())
    out.stop()
    assert card.voltages[-1] == 0.0


def test_a_sound_card_gets_shares_of_its_full_scale_in_its_callback_and_silence_where_nobody_feeds():
    sound, streams = SimpleNamespace(PortAudioError=OSError), []
    sound.query_devices = lambda *_given: {"name": "Speakers"}
    sound.check_output_settings = lambda **_given: None

    def stream(**given):
        streams.append(SimpleNamespace(**given, active=True, start=lambda: None, close=lambda **_: None))
        streams[-1].latency, streams[-1].stop = 0.01, lambda **_: None
        return streams[-1]

    sound.OutputStream = stream
    card = output_of("shaker", settings(driver="sound", full_scale_V=2.0), lambda: 0.0)
    assert isinstance(card, ScaledCard)
    card.library = lambda: sound
    player = Player("shaker", RATE, VoltGuard(Limits(rms_V=1.0), RATE), 0.1, card.wait_s)
    card.open()
    card.start(player.fill)

    def requested(frames):
        out = np.full((frames, 1), np.nan, dtype="f4")
        streams[-1].callback(out, frames, None, SimpleNamespace(output_underflow=False))
        return out[:, 0]

    assert not requested(64).any()
    player.play(np.full(RATE, 0.5), 0.0, lambda: 5_000_000_000)
    assert requested(64) == pytest.approx(np.full(64, 0.25)) and player.onset_ns == 5_010_000_000
    out = np.concatenate([requested(64) for _ in range(200)])
    last = int(np.flatnonzero(out)[-1]) + 64
    assert 0.1 * RATE <= last <= 0.105 * RATE, "0.1 s and a ramp of 4 ms"
    assert player.fault().what == "heartbeat_lost"


def test_an_uncalibrated_vibrator_plays_no_level():
    vibrator = make("shaker", settings(driver="sound"), Path())
    with pytest.raises(
        ValueError, match="it is not calibrated, so no level can be played: palpate rig calibrate shaker"
    ):
        vibrator.play(np.zeros(100))
    with pytest.raises(DeviceFault, match="sample 1 is nan"):
        vibrator.play(np.array([0.0, np.nan]))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"limits": {"rms_V": 1, "peak_V": 0.5}}, r"limits.rms_V \(1\) must not be above limits.peak_V"),
        ({"driver": "sound", "full_scale_V": 0.5}, r"limits.peak_V \(1\) must not be above full_scale_V \(0.5\)"),
        ({"limits": {"a8_m_s2": float("inf")}}, "a8_m_s2"),
        ({"limits": {"peak_m_s2": float("nan")}}, "peak_m_s2"),
        ({"feed_s": 60}, "feed_s"),
    ],
)
def test_limits_that_limit_nothing_are_refused_in_the_rig_file(changes, message):
    with pytest.raises(ValueError, match=message):
        settings(**changes)
