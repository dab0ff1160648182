"""An accelerometer in six positions: each is asked for, read at rest, and asked for again where it moved."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from palpate.devices.daq.adxl335 import AXES, NOISY_G, POSITIONS, Accelerometer, Scaling, SixPositions, calibrate
from palpate.devices.daq.sensor import DaqSensor
from palpate.devices.health import WAIT_S, samples
from palpate.devices.rig.calibrating import Found, Job, Unfit
from palpate.devices.rig.calibrating_bench import Hastened, Lying
from palpate.devices.rig.opened import one_opened
from palpate.devices.signals import Block, DeviceError, NowNs
from palpate.signals import GRAVITY_M_S2
from palpate.signals.arrays import Array

SECONDS = 2.0
FEWEST = 100
"""Samples of a position, below which its noise would pass for movement."""
PARTS, STILL_G = 10, 0.02
"""A position is still where the means of its ten parts lie within so much of each other."""
FAR_G = np.array([0.65, 0.65, 1.15])
"""How far an axis may lie from what a position should give before the part is calibrated: the data sheet's widest zero
(x, y 0.5 g; z 1 g) and sensitivity (10 %), and 0.05 g. Further off, another axis is up."""
MOST_TRIES = 5
DECIMALS = 5

Readings = dict[str, Array]


def calibrated(job: Job, seconds: float) -> Found:
    """The settings of the six positions that the experimenter lays the sensor in.

    Raises DeviceError where it cannot be had, DeviceFault where it fails, Unfit where the positions come to nothing.
    """
    with one_opened(job.file, job.name) as device:
        if not isinstance(device, DaqSensor) or not isinstance(device.transducer, Accelerometer):
            raise DeviceError(f"{job.name}: no accelerometer on a card")
        bench = Bench.of(job, device, device.transducer.scaling, seconds)
        readings: Readings = {}
        for position in POSITIONS:
            readings[position] = bench.measured(position)
        return _found(bench.fitted(readings), job.date)


@dataclass
class Bench:
    """The open sensor, and the scaling that tells its axes apart until it is calibrated.

    A twin is laid by a scene, and its time is not waited for.
    """

    job: Job
    sensor: DaqSensor
    scaling: Scaling
    wanted: int
    now: NowNs = time.monotonic_ns
    tries: dict[str, int] = field(default_factory=dict)

    @staticmethod
    def of(job: Job, sensor: DaqSensor, scaling: Scaling, seconds: float) -> Bench:
        """The bench of a sensor. Raises DeviceError where so few seconds hold too few samples."""
        rate_hz = sensor.signals[0].rate_hz
        if (wanted := round(seconds * rate_hz)) < FEWEST:
            told = f"{seconds:g} s at {rate_hz:g} Hz are {wanted} samples a position; {FEWEST} are needed"
            raise DeviceError(f"{job.name}: {told}: give --seconds {FEWEST / rate_hz:.3g} or more")
        if sensor.driver != "twin":
            return Bench(job, sensor, scaling, wanted)
        hastened = Hastened.of(sensor)
        return Bench(job, hastened, scaling, wanted, hastened.clock.ns)

    def measured(self, position: str) -> Array:
        """Mean volts of a position, of shape (3,), asked for until it is the right one and still. Raises Unfit."""
        while True:
            self.tries[position] = self.tries.get(position, 0) + 1
            if self.tries[position] > MOST_TRIES:
                raise Unfit(f"{position}: {MOST_TRIES} attempts and none that could be used; see the sensor and wires")
            self._ask(position)
            g = self._read(position)
            wrong = _moved(position, g) or _misplaced(position, g.mean(axis=0))
            if wrong is None:
                self.job.say(f"    {_spelled(g.mean(axis=0))}; noise {g.std(axis=0).max():.4f} g")
                volts: Array = self.scaling.zero_V + g.mean(axis=0) * self.scaling.sensitivity_V
                return volts
            self.job.say(f"    not taken: {wrong}")

    def fitted(self, readings: Readings) -> SixPositions:
        """The fit; the worst position is asked for again where it fits badly. Raises Unfit."""
        while True:
            try:
                return calibrate(readings, self.scaling.supply_V)
            except DeviceError as error:
                worst = _ill_fitting(readings)
                if worst is None:
                    raise Unfit(f"{self.job.name}: {error}") from None
                self.job.say(f"    {error}")
            readings[worst] = self.measured(worst)

    def _ask(self, position: str) -> None:
        again = " again" if self.tries[position] > 1 else ""
        up = f"{position[1]} axis {'up' if position[0] == '+' else 'down'}"
        self.job.ask(f"{position}{again}: lay {self.job.name} with its {up} and let go of it.")

    def _read(self, position: str) -> Array:
        """The samples of a position in g by the scaling so far, of shape (n, 3)."""
        self.sensor.expect(Lying(position))
        signal, blocks, count = self.sensor.signals[0], list[Block](), 0
        self.sensor.start(self.now)
        try:
            while count < self.wanted:
                came = self.sensor.read(WAIT_S).get(signal.name, ())
                blocks += came
                count += sum(len(block.data) for block in came) // (4 * len(AXES))
        finally:
            self.sensor.stop()
        return samples(signal, blocks)[: self.wanted] / GRAVITY_M_S2


def _moved(position: str, g: Array) -> str | None:
    """What says that it did not lie still; None where it did."""
    means = np.array([part.mean(axis=0) for part in np.array_split(g, PARTS)])
    wander, noise = np.ptp(means, axis=0), g.std(axis=0)
    if wander.max() > STILL_G:
        axis = AXES[wander.argmax()]
        return f"{position} moved while it was read: {axis} wandered by {wander.max():.3f} g, {STILL_G:g} are let pass"
    if noise.max() > NOISY_G:
        return f"{position} is noisy: {noise.max():.3f} g (SD) on {AXES[noise.argmax()]}; {NOISY_G:g} are let pass"
    return None


def _misplaced(position: str, g: Array) -> str | None:
    """What says that another axis is up; None where this one may be."""
    if (np.abs(g - _felt(position)) <= FAR_G).all():
        return None
    nearest = min(POSITIONS, key=lambda each: float(np.abs(g - _felt(each)).max()))
    seems = f"{nearest} seems to be up" if nearest != position else "no axis is up"
    return f"{position} is asked for and {seems}: {_spelled(g)}"


def _felt(position: str) -> Array:
    felt = np.zeros(3)
    felt[AXES.index(position[1])] = 1.0 if position[0] == "+" else -1.0
    return felt


def _ill_fitting(readings: Mapping[str, Array]) -> str | None:
    """The position that lies furthest from the fit; None where the sensitivities themselves cannot be."""
    means = np.array([readings[position] for position in POSITIONS])
    felt = np.array([_felt(position) for position in POSITIONS])
    sensitivity = (means * felt).sum(axis=0) / 2
    if not (sensitivity > 0).all():
        return None
    off = np.linalg.norm((means - means.mean(axis=0)) / sensitivity - felt, axis=1)
    return POSITIONS[int(off.argmax())]


def _spelled(g: Array) -> str:
    return ", ".join(f"{axis} {value:+.3f} g" for axis, value in zip(AXES, g, strict=True))


def _found(fit: SixPositions, date: str) -> Found:
    scaling = fit.scaling
    settings = {
        "sensitivity_V_per_g": [round(each, DECIMALS) for each in scaling.sensitivity_V.tolist()],
        "zero_g_V": [round(each, DECIMALS) for each in scaling.zero_V.tolist()],
        "scaled_at_V": scaling.supply_V,
        "calibrated": date,
    }
    residuals = {position: round(each, 5) for position, each in fit.residual_g.items()}
    return Found(settings, tuple(_told(fit)), {"residual_g": residuals, "worst_g": round(fit.worst_g, 5)})


def _told(fit: SixPositions) -> Iterator[str]:
    for axis, volts, zero in zip(AXES, fit.scaling.sensitivity_V, fit.scaling.zero_V, strict=True):
        yield f"{axis}: {volts:.4f} V per g, {zero:.4f} V at 0 g"
    yield f"residual (RMS over the axes): {', '.join(f'{p} {each:.4f}' for p, each in fit.residual_g.items())} g"
