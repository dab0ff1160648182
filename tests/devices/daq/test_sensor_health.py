"""Health: what a sensor at rest gave, measured; and how starting, reading and stopping from two threads goes."""

from __future__ import annotations

import re
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from palpate.devices.daq import accelerometer, force_torque
from palpate.devices.device import Block, DeviceFault, Signal
from palpate.devices.health import measured_hz, reading, sensed
from tests.devices.daq.scenes import Bent, Clock, Steady

TWO = Signal("position", ("x", "y"), ("mm", "mm"), 100.0)


def block(first, rows, at_s, lost=0):
    return Block(first, np.asarray(rows, "<f4").tobytes(), round(at_s * 1e9), None, lost)


@dataclass
class Scripted:
    """A sensor that gives these blocks, one read each, and lets time pass."""

    blocks: list
    clock: Clock
    step_s: float = 0.1
    name: str = "tracker"
    calls: list = field(default_factory=list)
    signals = (TWO,)

    def start(self, now_ns):
        self.calls.append("start")

    def read(self, timeout_s):
        self.clock.now_s += self.step_s
        if not self.blocks:
            return {"position": ()}
        scripted_block = self.blocks.pop(0)
        if isinstance(scripted_block, Exception):
            raise scripted_block
        return {"position": (scripted_block,)}

    def stop(self):
        self.calls.append("stop")


def test_rate_mean_noise_and_losses_are_those_of_the_samples() -> None:
    rng = np.random.default_rng(1)
    data = rng.normal([3, -2], [0.5, 0.1], (1000, 2)).astype("<f4")
    clock = Clock()
    sensor = Scripted(
        [block(10 * n + 5, data[10 * n : 10 * n + 10], 0.1 * (n + 1), 5 * (n == 0)) for n in range(100)],
        clock,
        0.125,
    )
    (measured,) = sensed(sensor, 5.0, clock.ns)
    used = data[:400].astype(float)
    assert sensor.calls == ["start", "stop"]
    assert measured.rate_hz == pytest.approx(100.0)
    assert measured.mean == pytest.approx(used.mean(axis=0))
    assert measured.noise == pytest.approx(used.std(axis=0, ddof=1))
    assert measured.lost == 5


def test_the_rate_is_a_slope_that_one_late_block_hardly_moves() -> None:
    blocks = [block(10 * n, np.zeros((10, 2)), 0.1 * (n + 1)) for n in range(50)]
    blocks[-1] = block(490, np.zeros((10, 2)), 5.02)
    assert measured_hz(TWO, blocks) == pytest.approx(100.0, rel=1e-3)
    assert measured_hz(TWO, blocks[:1]) == 0.0
    assert measured_hz(TWO, [blocks[0], block(10, np.zeros((10, 2)), 0.1)]) == 0.0


def test_a_silent_signal_is_a_fault_and_a_frozen_clock_ends_it_too() -> None:
    clock = Clock()
    sensor = Scripted([], clock, step_s=0.0)
    with pytest.raises(DeviceFault, match="tracker: no sample of position came") as caught:
        sensed(sensor, 1.0, clock.ns)
    assert caught.value.what == "silent"
    assert sensor.calls == ["start", "stop"]


def test_a_fault_stops_the_sensor_and_goes_on_up() -> None:
    clock = Clock()
    sensor = Scripted([block(0, np.zeros((10, 2)), 0.1), DeviceFault("tracker", "link_lost", "gone")], clock)
    with pytest.raises(DeviceFault, match="gone"):
        sensed(sensor, 1.0, clock.ns)
    assert sensor.calls == ["start", "stop"]


def test_what_is_no_number_counts_neither_into_mean_nor_noise() -> None:
    result = reading("tracker", TWO, [block(0, [[1, np.nan], [2, np.nan], [3, np.nan], [np.inf, np.nan]], 0.1)])
    assert (result.mean[0], result.noise[0]) == (2.0, 1.0)
    assert np.isnan(result.mean[1])


def test_all_that_a_rate_promises_is_enough() -> None:
    clock = Clock()
    sensor = Scripted([block(100 * n, np.zeros((100, 2)), 0.0) for n in range(9)], clock, step_s=0.0)
    assert sensed(sensor, 2.0, clock.ns)[0].rate_hz == 0.0
    assert len(sensor.blocks) == 7


def twin(kind=force_torque, bend=None, **settings):
    clock = Clock()

    def ticking():
        clock.now_s += 0.002
        return clock.now_s

    name = kind.__name__.rpartition(".")[2]
    device = kind.make("it", kind.Settings(kind=name, driver="twin", **settings), Path())
    device.elapsed_s = ticking
    device.open()
    if bend is not None:
        device.daq = Bent(device.daq, bend)
    return device


@pytest.mark.parametrize("kind", [force_torque, accelerometer])
def test_a_twin_at_rest_is_well_and_its_noise_floor_is_the_one_set(kind) -> None:
    device = twin(kind)
    device.expect(Steady((50.0,) * 6, (99.0, 0.0, 0.0)))
    health = device.health(1.0)
    device.close()
    (result,) = health.readings
    assert health.ok, health.summary
    assert result.rate_hz == pytest.approx(result.signal.rate_hz, rel=0.01)
    volts = 0.002 if kind is force_torque else 0.0023
    scale = np.sqrt((device.transducer.matrix**2).sum(axis=1)) if kind is force_torque else np.full(3, 9.80665 / 0.3)
    assert result.noise == pytest.approx(volts * scale, rel=0.08)


@pytest.mark.parametrize(
    ("kind", "bend", "words"),
    [
        (force_torque, lambda v, first: v + 2.0 * (first >= 0), "reads .* at rest; take its zero again"),
        (force_torque, lambda v, first: v + 0.5 * np.resize([1, -1], (len(v), 1)), "is noisy"),
        (accelerometer, lambda v, first: v * 1.1, "it feels 1.* g at rest; 1 is expected"),
        (accelerometer, lambda v, first: v + 0.05 * np.resize([1, -1], (len(v), 1)), "it is noisy: 0.1.* g"),
        (force_torque, lambda v, first: np.full_like(v, np.nan), "gave nan V"),
    ],
)
def test_health_says_what_is_wrong(kind, bend, words) -> None:
    device = twin(kind, bend)
    health = device.health(0.5)
    device.close()
    assert not health.ok
    assert np.isfinite(sum(sum(reading.mean) for reading in health.readings))
    assert re.search(words, health.summary), health.summary


def test_a_wrong_rate_and_lost_samples_are_reported() -> None:
    clock = Clock()
    device = twin(accelerometer, buffer_s=0.1)
    slow = device.daq.read

    def every_second_one(most, timeout_s):
        taken = slow(most, timeout_s)
        return type(taken)(taken.volts[::2], taken.lost)

    device.daq.read = every_second_one
    assert re.search(r"it runs at 1[45]\d\d.* Hz; 3000 are set", device.health(0.5).summary)
    device.daq.read = slow
    device.elapsed_s = clock

    def late(most, timeout_s):
        clock.now_s += 0.3
        return slow(most, timeout_s)

    device.daq.read = late
    assert re.search(r"[\d,]+ samples? lost", device.health(1.0).summary)
    device.close()


def test_reading_in_one_thread_while_another_stops_and_closes_gives_blocks_or_nothing() -> None:
    device = force_torque.make("it", force_torque.Settings(kind="force_torque", driver="twin", zero_s=0), Path())
    device.open()
    wrong: list[BaseException] = []
    first_block = threading.Event()

    def read_on() -> None:
        try:
            while not done.is_set():
                if device.read(0.002)["wrench"]:
                    first_block.set()
        except BaseException as error:
            wrong.append(error)

    done = threading.Event()
    thread = threading.Thread(target=read_on)
    device.start(time.monotonic_ns)
    thread.start()
    assert first_block.wait(10)
    device.safe()
    device.stop()
    device.start(time.monotonic_ns)
    device.close()
    device.close()
    done.set()
    thread.join(10)
    assert not wrong
    assert not thread.is_alive()
