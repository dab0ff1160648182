"""A real playback through PortAudio, and every way in which a card goes wrong."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.sound import card as card_module
from palpate.devices.sound.card import Card
from palpate.devices.sound.device import MaskingNoise, Settings
from palpate.devices.sound.noise import loop, rms_of
from tests.devices.sound.tapes import played

SCRIPT = """
import time
from pathlib import Path
from palpate.devices.sound.device import Settings, make
noise = make("noise", Settings(kind="masking_noise", driver="sound", device="tape", ramp_s=0.1), Path("."))
noise.open()
fill, frames = noise.output._fill, [0]
def paced(count):  # the null card would swallow hours in a second
    frames[0] += count
    time.sleep(count / 48000 / 10)
    return fill(count)
noise.output._fill = paced
def wait(seconds):
    end = frames[0] + seconds * 48000
    while frames[0] < end:
        time.sleep(0.001)
noise.check()
noise.start()
wait(1.0)
noise.check()
noise.safe()
wait(0.2)
noise.close()
print(noise.output.facts())
"""


def begins_at(whole, part):
    """Where a part of the loop begins; PortAudio plays some silence of its own first."""
    return int(np.fft.irfft(np.fft.rfft(whole) * np.conj(np.fft.rfft(part, len(whole)))).argmax())


def is_the_noise(sound, meant):
    """Whether a channel holds the loop from some place on, ramped on and off, and silence around it."""
    first, last = np.flatnonzero(sound)[[0, -1]]
    if last - first <= 48_000 or sound[last + 1 :].any():
        return False
    whole = meant[(begins_at(meant, sound[first + 5000 :][:4096]) - 5000 + np.arange(last - first + 1)) % len(meant)]
    gain = np.minimum(np.arange(1, last - first + 2) / 4800, 1.0)
    gain[-959:] = 1 - np.arange(1, 960) / 960
    return np.allclose(sound[first : last + 1], whole * gain, atol=3e-8)


@pytest.mark.needs("sounddevice", "portaudio")
def test_what_portaudio_writes_is_the_noise_sample_by_sample_with_its_ramps(tmp_path):
    """A machine that is busy may leave a hole in what its sound library plays: one undisturbed playback is enough."""
    meant = (loop("white", 48_000, 1) * rms_of(-35.0)).astype("f4")
    for attempt in range(4):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        tape, notes = played(folder, SCRIPT, channels=2)
        assert np.array_equal(tape[:, 0], tape[:, 1]) and "'output': 'tape'" in notes
        if is_the_noise(tape[:, 0], meant):
            return
    raise AssertionError("four playbacks, and none is the noise that was meant")


class PortAudioError(Exception):
    pass


@dataclass
class Sound:
    """What sounddevice looks like to a card; `goes_wrong` by the name of the call."""

    goes_wrong: dict = field(default_factory=dict)
    streams: list = field(default_factory=list)
    PortAudioError = PortAudioError

    def query_devices(self, device=None, kind=None):
        if kind is None:
            return [{"name": "Speakers", "max_output_channels": 2}, {"name": "Microphone", "max_output_channels": 0}]
        if device not in (None, "Speakers"):
            raise ValueError(f"No output device matching {device!r}")
        return {"name": "Speakers"}

    def check_output_settings(self, **_):
        if "rate" in self.goes_wrong:
            raise PortAudioError("Invalid sample rate [PaErrorCode -9997]")

    def OutputStream(self, **given):
        if "open" in self.goes_wrong:
            raise PortAudioError("Device unavailable [PaErrorCode -9985]")
        self.streams.append(
            SimpleNamespace(**{**given, "latency": 0.01}, active=True, start=lambda: None, closed=False)
        )
        stream = self.streams[-1]
        stream.stop = lambda ignore_errors: stream.finished_callback()
        stream.close = lambda ignore_errors: setattr(stream, "closed", True)
        return stream

    def ask_for_samples(self, frames=64, late=False):
        out = np.full((frames, 2), np.nan, dtype="f4")
        self.streams[-1].callback(out, frames, None, SimpleNamespace(output_underflow=late))
        return out


def card(sound, **given):
    return Card("noise", given.pop("device", None), 48_000, 2, library=lambda: sound, **given)


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (ImportError("No module named 'sounddevice'"), "needs the package sounddevice: pip install"),
        (OSError("PortAudio library not found"), "PortAudio library not found.: apt-get install libportaudio2"),
    ],
)
def test_without_the_package_or_the_library_the_refusal_says_what_to_install(monkeypatch, error, message):
    def missing(_name):
        raise error

    monkeypatch.setattr(card_module.importlib, "import_module", missing)
    with pytest.raises(DeviceError, match=message):
        Card("noise", None, 48_000).open()


def test_an_output_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(DeviceError, match=r"No output device matching 'Headset'. Outputs here: 0: Speakers$"):
        card(Sound(), device="Headset").open()
    with pytest.raises(DeviceError, match="Invalid sample rate"):
        card(Sound({"rate": True})).open()


def test_an_output_that_is_taken_is_refused_when_it_is_to_start():
    taken = card(Sound({"open": True}))
    taken.open()
    with pytest.raises(DeviceError, match="'Speakers' does not start: Device unavailable"):
        taken.start(np.zeros)
    taken.stop()


def test_a_card_that_ends_by_itself_is_a_fault_and_one_that_is_stopped_is_none():
    sound = Sound()
    used = card(sound)
    used.open()
    used.start(np.zeros)
    used.stop()
    assert used.fault() is None and sound.streams[0].closed
    used.start(np.zeros)
    sound.streams[1].finished_callback()
    fault = used.fault()
    assert isinstance(fault, DeviceFault) and fault.what == "link_lost"
    assert "ended by itself (unplugged?)" in str(fault)


def test_a_card_that_asks_for_nothing_is_silent_after_a_second():
    now = [0.0]
    used = card(Sound(), clock_s=lambda: now[0])
    used.open()
    used.start(np.zeros)
    now[0] = 0.9
    assert used.fault() is None
    now[0] = 1.1
    assert used.fault().what == "silent"


def test_samples_that_cannot_be_had_are_silence_and_a_fault():
    sound = Sound()
    used = card(sound)
    used.open()
    used.start(lambda count: {}[count])
    assert not sound.ask_for_samples().any()
    assert "its samples could not be read: 64" in str(used.fault())


def test_late_buffers_are_counted():
    sound = Sound()
    used = card(sound)
    used.open()
    used.start(np.ones)
    assert sound.ask_for_samples(late=True).all()
    sound.ask_for_samples()
    assert used.facts()["late buffers"] == "1"


def test_the_noise_player_says_that_its_headphones_went():
    sound = Sound()
    noise = MaskingNoise("noise", Settings(kind="masking_noise", driver="sound"), card(sound))
    noise.open()
    noise.start()
    assert sound.ask_for_samples(48_000).any()
    sound.streams[0].finished_callback()
    with pytest.raises(DeviceFault, match="unplugged"):
        noise.check()
    assert not noise.health(0.0).ok
    noise.close()
    noise.close()
