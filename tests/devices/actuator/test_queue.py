"""What is played when samples run out, when everything ends at once, and what the coil bears."""

import numpy as np
import pytest

from palpate.devices.actuator.compensation import Limiter
from palpate.devices.actuator.queue import Queue


def test_samples_come_out_in_order_in_parts_of_any_length():
    queue, sent, got = Queue(50), np.arange(1.0, 201.0), []
    rng = np.random.default_rng(1)
    while sum(map(len, got)) < 200:
        part = sent[: queue.room][: int(rng.integers(1, 30))]
        sent = sent[len(part) :]
        assert queue.write(part) == queue.room
        got.append(queue.take(min(50 - queue.room, int(rng.integers(1, 30)))))
    assert np.array_equal(np.concatenate(got), np.arange(1.0, 201.0))
    assert queue.underruns == queue.missing == 0


def test_an_underrun_dies_away_is_counted_once_and_what_comes_later_is_played():
    queue = Queue(50)
    assert not queue.take(10).any() and queue.underruns == 0
    queue.write(np.full(5, 2.0))
    out = np.concatenate([queue.take(8), queue.take(40)])
    assert np.array_equal(out[:5], np.full(5, 2.0))
    assert out[5] == pytest.approx(2.0 * np.exp(-0.5)) and np.all(np.diff(out[4:25]) <= 0)
    assert out[-1] == 0.0 and (queue.underruns, queue.missing) == (1, 43)
    queue.write(np.ones(3))
    assert queue.take(3).all() and queue.underruns == 1
    queue.take(1)
    assert queue.underruns == 2


def test_silence_after_rest_is_no_underrun():
    queue = Queue(50)
    queue.write(np.ones(5))
    queue.rest()
    queue.take(30)
    assert queue.underruns == queue.missing == 0
    assert queue.silent.is_set()


@pytest.mark.parametrize("last", [1.0, -0.7])
def test_a_halt_is_silent_within_five_samples_and_drops_what_waits(last):
    queue = Queue(100)
    queue.write(np.full(60, last))
    queue.take(10)
    queue.halt()
    queue.halt()
    out = queue.take(60)
    assert not out[4:].any() and queue.silent.is_set()
    assert np.abs(np.diff(out, prepend=last)).max() < 0.36 * abs(last)
    queue.write(np.ones(5))
    assert not queue.take(5).any()
    queue.resume()
    queue.write(np.ones(5))
    assert queue.take(5).all()


def test_a_halt_in_an_underrun_goes_on_from_where_the_decay_was():
    queue = Queue(100)
    queue.write(np.ones(1))
    decayed = queue.take(3)[-1]
    queue.halt()
    assert queue.take(1)[0] == pytest.approx(decayed * 0.8535533905932737)


@pytest.mark.parametrize("kind", ["steady", "square", "bursts", "spikes"])
def test_the_heat_never_passes_its_limit_whatever_is_sent(kind):
    t = np.arange(20_000)
    sent = {
        "steady": np.full(20_000, 5.0),
        "square": np.sign(np.sin(t / 3)) * 1.0,
        "bursts": (t % 3000 < 700) * np.sin(t / 2) * 3.0,
        "spikes": (t % 400 == 0) * 1e300,
    }[kind]
    limiter, keep, heat, hottest = Limiter(1.0, 0.3, 1.0), np.exp(-1 / 1000), 0.0, 0.0
    out = np.concatenate([limiter.limit(part) for part in np.array_split(sent, 77)])
    for sample in out:
        heat = keep * heat + (1 - keep) * sample * sample
        hottest = max(hottest, heat)
    assert np.abs(out).max() <= 1.0 and hottest <= 0.3**2 * (1 + 1e-12)


def test_a_signal_within_the_limits_is_left_as_it_is():
    sent = 0.35 * np.sin(np.arange(10_000) / 5)
    limiter = Limiter(1.0, 0.3, 1.0)
    assert np.array_equal(limiter.limit(sent), sent)
    assert limiter.limited == 0


def test_a_signal_that_is_too_loud_settles_just_below_the_limit_without_distortion():
    sent = np.sin(2 * np.pi * 100 * np.arange(20_000) / 1000)
    limiter = Limiter(1.0, 0.3, 1.0)
    settled = limiter.limit(sent)[10_000:]
    assert 0.87 * 0.3 <= np.sqrt(np.mean(settled**2)) <= 0.3
    lines = np.abs(np.fft.rfft(settled)) ** 2
    assert lines[999:1002].sum() / lines.sum() > 0.999
