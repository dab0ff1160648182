"""Read a sensor at rest for a while: statistics of its signals, for the health of any sensor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from palpate.devices.device import Block, DeviceFault, NowNs, Reading, Sensor, Signal
from palpate.protocols.events import NS

WAIT_S = 0.05
"""Longest wait of a read, and so the longest overrun of the given time."""

Blocks = Mapping[str, list[Block]]


def sensed(sensor: Sensor, seconds: float, now: NowNs) -> tuple[Reading, ...]:
    """Start the sensor, read it for `seconds` by that clock, stop it, and return the reading of each signal in order.

    The reading ends early if every signal has given all samples that its rate promises, as a twin may at once. Rates
    are measured by the blocks' times. Values that are not finite are left out of mean and noise; a channel without any
    other has nan for both, which its device's health has to explain.

    Raises:
        DeviceError: it cannot be started.
        DeviceFault: it failed while it was read, or a signal gave nothing (`silent`). The sensor is stopped.
    """
    sensor.start(now)
    try:
        # All blocks by signal; a clock that stands still ends it as well, once nothing has come for the whole time.
        blocks: dict[str, list[Block]] = {signal.name: [] for signal in sensor.signals}
        end, patience = now() + round(seconds * NS), math.ceil(seconds / WAIT_S) + 1
        while patience and now() < end and not _enough(sensor.signals, blocks, seconds):
            came = sensor.read(WAIT_S)
            for name, some in came.items():
                blocks[name].extend(some)
            patience -= not any(came.values())
    finally:
        sensor.stop()
    return tuple(reading(sensor.name, signal, blocks[signal.name]) for signal in sensor.signals)


def reading(device: str, signal: Signal, blocks: Sequence[Block]) -> Reading:
    """Return the statistics of these blocks of a signal. Raises DeviceFault (`silent`) if there are no samples."""
    rows = samples(signal, blocks)
    if not len(rows):
        raise DeviceFault(device, "silent", f"{device}: no sample of {signal.name} came; see its cable and power.")
    finite = [column[np.isfinite(column)] for column in rows.T]
    means = tuple(float(values.mean()) if values.size else math.nan for values in finite)
    noises = tuple(
        float(values.std(ddof=1)) if values.size > 1 else 0.0 if values.size else math.nan for values in finite
    )
    return Reading(signal, measured_hz(signal, blocks), means, noises, sum(block.lost for block in blocks))


def samples(signal: Signal, blocks: Sequence[Block]) -> NDArray[np.float64]:
    """Return the rows of all blocks, of shape (n, channels), without lost samples."""
    joined = b"".join(block.data for block in blocks)
    return np.frombuffer(joined, "<f4").reshape(-1, len(signal.channels)).astype(np.float64)


def measured_hz(signal: Signal, blocks: Sequence[Block]) -> float:
    """Return the samples per second including lost ones: their number over the host's time; 0 where no time passed."""
    filled = [block for block in blocks if block.data]
    if len(filled) < 2:
        return 0.0
    at_s = np.array([(block.at_ns - filled[0].at_ns) / NS for block in filled])
    number = np.array([block.first + len(block.data) // (4 * len(signal.channels)) for block in filled], float)
    late = at_s - at_s.mean()
    spread = float(late @ late)
    return float(late @ (number - number.mean())) / spread if spread > 0 else 0.0


def _enough(signals: Sequence[Signal], blocks: Blocks, seconds: float) -> bool:
    def rows(signal: Signal) -> int:
        return sum(len(block.data) for block in blocks[signal.name]) // (4 * len(signal.channels))

    return all(rows(signal) >= signal.rate_hz * seconds for signal in signals)
