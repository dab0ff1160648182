"""Figures to reach for sensors on a card: conversion of 0.1 s of samples, which must be far faster than they come."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.protocols.bench import Case

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from palpate.devices.daq.sensor import DaqSensor

    Array = NDArray[np.float64]

BLOCK_S = 0.1
FORCE_HZ, ACCELERATION_HZ = 10_000.0, 3000.0
"""The rates of thesis 3.4.1 and 4.3.3."""


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of volts to units, and of the twin's volts; the error is the largest against long double."""
    repeats = 50 if quick else 500
    yield from _conversions("6 gauges at 10 kHz", _force(), repeats)
    yield from _conversions("3 axes at 3 kHz", _accelerometer(), repeats)
    for name, sensor in (("6 gauges at 10 kHz", _force()), ("3 axes at 3 kHz", _accelerometer())):
        yield _making(name, sensor, repeats)


def _force() -> DaqSensor:
    import numpy as np

    from palpate.devices.daq.force_torque import Settings, make

    sensor = make("force", Settings(kind="force_torque", driver="twin", rate_hz=FORCE_HZ, stuck_s=0), Path())
    vars(sensor.transducer)["bias_V"] = np.linspace(-0.5, 0.5, 6)
    return sensor


def _accelerometer() -> DaqSensor:
    from palpate.devices.daq.accelerometer import Settings, make

    return make("vibration", Settings(kind="accelerometer", driver="twin", rate_hz=ACCELERATION_HZ, stuck_s=0), Path())


def _volts(sensor: DaqSensor) -> Array:
    from palpate.devices.daq.acquire import Pace

    times = iter((0.0, BLOCK_S, BLOCK_S, BLOCK_S))
    sensor.daq.open()
    sensor.daq.start(Pace(lambda: next(times), lambda _s: None))
    return sensor.daq.read(1 << 20, 0.0).volts


def _conversions(input_name: str, sensor: DaqSensor, repeats: int) -> Iterator[Case]:
    """Yield the cases of the sensor's own conversion (checks, conversion, float32), and of a loop over the samples."""
    volts = _volts(sensor)
    offset, matrix = _linear(sensor)
    exact = ((volts.astype("g") - offset.astype("g"))[:, None, :] * matrix.astype("g")).sum(axis=2)
    sensor.transducer.begin()
    plain = [offset.tolist(), matrix.tolist(), volts.tolist()]

    def error(rows: Any) -> float:
        return float(abs(rows - exact).max() / abs(matrix).max())

    def whole() -> Array:
        return sensor.transducer.rows(volts).astype("<f4")

    yield _case("0.1 s to units", "checked, in blocks, float32", input_name, len(volts), whole, error, repeats)
    by_sample = partial(_by_sample, *plain)
    yield _case("0.1 s to units", "plain Python", input_name, len(volts), by_sample, error, repeats // 10)


def _linear(sensor: DaqSensor) -> tuple[Array, Array]:
    """Return offset and matrix, which describe both sensors."""
    import numpy as np

    from palpate.signals import GRAVITY_M_S2

    description = sensor.describe()
    if "matrix" in description:
        return np.array(description["bias_V"]), np.array(description["matrix"])
    return np.array(description["zero_g_V"]), np.diag(GRAVITY_M_S2 / np.array(description["sensitivity_V_per_g"]))


def _by_sample(offset: list[float], matrix: list[list[float]], volts: list[list[float]]) -> list[list[float]]:
    rows = []
    for sample in volts:
        free = [volt - zero for volt, zero in zip(sample, offset, strict=True)]
        rows.append([sum(a * b for a, b in zip(row, free, strict=True)) for row in matrix])
    return rows


def _making(input_name: str, sensor: DaqSensor, repeats: int) -> Case:
    """Return the case of a twin's cost; its error is the mean against the true load: nothing, or one g."""
    from palpate.devices.daq.acquire import Pace

    times = [0.0]
    sensor.daq.open()
    sensor.daq.start(Pace(lambda: times[0], lambda _s: None))

    def read_twin() -> Array:
        times[0] += BLOCK_S
        return sensor.daq.read(1 << 20, 0.0).volts

    def error(volts: Array) -> float:
        import numpy as np

        offset, matrix = _linear(sensor)
        mean = ((volts - offset) @ matrix.T).mean(axis=0)
        truth = np.array([0.0, 0.0, 9.80665]) if len(mean) == 3 else np.zeros(6)
        return float(abs(mean - truth).max() / abs(matrix).max())

    count = round(BLOCK_S * sensor.daq.wiring.rate_hz)
    return _case("0.1 s by the twin", "noise and 16 bits", input_name, count, read_twin, error, repeats)


def _case(
    case: str, method: str, input_name: str, n: int, run: Callable[[], Any], error: Callable[[Any], float], repeats: int
) -> Case:
    return Case("sensors", case, method, input_name, n, "largest error (V at the input)", run, error, repeats)
