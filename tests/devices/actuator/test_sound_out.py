"""The voice coil on a sound card: raised from 1 kHz by a filter that does what it states, and really played."""

import numpy as np
import pytest

from palpate.devices.actuator.outputs import REACH, SoundOut, Upsampler, bank
from tests.devices.sound.tapes import played

SCRIPT = """
import time
from pathlib import Path
import numpy as np
from palpate.devices.actuator.device import make
from palpate.devices.actuator.settings import Settings
chosen = Settings(kind="voice_coil", driver="sound", device="tape", ahead_ms=500, full_scale_V=2.0)
coil = make("coil", chosen, Path("."))
coil.open()
ahead = 0.9 * np.sin(2 * np.pi * 50 * np.arange(500) / 1000)
take, taken = coil.queue.take, [0]
def paced(count):
    taken[0] += count
    time.sleep(count / 1000 / 10)
    return take(count)
coil.queue.take = paced
coil.start()
coil.write(0.4 * ahead)
def wait(count):
    end = taken[0] + count
    while taken[0] < end:
        time.sleep(0.001)
wait(300)
coil.check()
coil.safe()
wait(60)
coil.close()
print(coil.record())
"""


def source(samples):
    rest = [samples]

    def take(count):
        part, rest[0] = rest[0][:count], rest[0][count:]
        return np.concatenate([part, np.zeros(count - len(part))])

    return take


@pytest.mark.parametrize("rate", [44_100, 48_000, 96_000])
def test_the_filter_is_flat_to_400_hz_and_its_images_are_54_db_down(rate):
    up = rate // np.gcd(rate, 1000)
    weights = bank(int(up))
    hz = np.array([*np.arange(0, 401, 5), *np.arange(600, 3000, 7)])
    times = (np.arange(up * REACH)) / (1000 * up)
    gain = np.abs(np.exp(-2j * np.pi * np.outer(hz, times)) @ weights.T.reshape(-1)) / up
    assert np.abs(20 * np.log10(gain[hz <= 400])).max() < 0.02
    assert 20 * np.log10(gain[hz >= 600].max()) < -54
    assert np.allclose(weights.sum(axis=1), 1.0)


def test_no_swing_between_two_samples_passes_the_peak():
    edges = np.repeat([0.8, -0.8, 0.8], [40, 3, 40])
    assert np.abs(Upsampler(48_000, source(edges)).fill(4_000)).max() > 0.85
    out = SoundOut("coil", None, 48_000, full_scale_V=2.0, peak_V=0.8)
    assert np.abs(out.raised(source(edges))(4_000)).max() == pytest.approx(0.4)


@pytest.mark.parametrize("rate", [44_100, 48_000])
def test_a_sine_arrives_10_ms_later_as_the_same_sine(rate):
    x = np.sin(2 * np.pi * 250 * np.arange(1000) / 1000 + 0.3)
    upsampled = Upsampler(rate, source(x)).fill(rate)
    meant = np.sin(2 * np.pi * 250 * (np.arange(rate) / rate - 0.010) + 0.3)
    assert np.abs(upsampled - meant)[rate // 10 : rate * 9 // 10].max() < 0.002


def test_parts_of_any_length_make_the_same_samples_as_one():
    x, rng, parts = np.random.default_rng(1).normal(size=2000), np.random.default_rng(2), []
    whole = Upsampler(44_100, source(x)).fill(44_100)
    pieces = Upsampler(44_100, source(x))
    while (left := 44_100 - sum(map(len, parts))) > 0:
        parts.append(pieces.fill(min(left, int(rng.integers(0, 900)))))
    assert np.array_equal(np.concatenate(parts), whole)


@pytest.mark.needs("sounddevice", "portaudio")
def test_portaudio_plays_what_was_written_then_falls_silent_within_5_ms_and_the_filters_length(tmp_path):
    tape, notes = played(tmp_path, SCRIPT, channels=1)
    sound = tape[:, 0] * 2.0
    assert "'underruns': 0" in notes and "'faults': []" in notes
    sent = 0.36 * np.sin(2 * np.pi * 50 * np.arange(500) / 1000)
    meant = Upsampler(48_000, source(sent)).fill(24_000)
    first = int(np.flatnonzero(np.abs(sound) > 1e-6)[0])
    start = int(np.flatnonzero(np.abs(meant) > 1e-6)[0])
    count = 250 * 48
    assert np.allclose(sound[first : first + count], meant[start : start + count], atol=1e-6)
    last = int(np.flatnonzero(np.abs(sound) > 1e-6)[-1])
    assert 300 * 48 <= last - first <= (500 + 5 + REACH) * 48
    assert np.abs(np.diff(sound)).max() < 0.36 * 2 * np.pi * 50 / 48_000 * 8
