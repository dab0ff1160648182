"""Calibrate accelerometers and voice coils.

An accelerometer is measured in six positions: each is requested, read at rest, and requested again if it moved. A voice
coil is identified with an accelerometer of the same rig: shaken, recorded, and its filter saved to a file. Twins use a
simulated bench: their time passes as they are read, and they sense what the bench does.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import repeat
from typing import Any, Protocol

import numpy as np

from palpate.devices.actuator.calibration import save
from palpate.devices.actuator.device import VoiceCoil
from palpate.devices.actuator.identify import Identified, PlayAndRecord, Shaking, identify, through
from palpate.devices.actuator.outputs import Felt
from palpate.devices.actuator.response import CLIPPED_SHARE, FEWEST, ResponseError
from palpate.devices.actuator.settings import Settings
from palpate.devices.daq.adxl335 import AXES, NOISY_G, POSITIONS, Accelerometer, Scaling, SixPositions, calibrate
from palpate.devices.daq.sensor import DaqSensor
from palpate.devices.device import Block, DeviceError, NowNs
from palpate.devices.health import WAIT_S, samples
from palpate.devices.rig.calibration import CalibrationJob, CalibrationResult, UnfitMeasurement
from palpate.devices.rig.file import RigFile
from palpate.devices.rig.opened import open_rig, opened_device
from palpate.devices.sound.output import Output
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.events import NS
from palpate.protocols.wording import count
from palpate.signals import GRAVITY_M_S2
from palpate.signals.arrays import Array

SECONDS_A_POSITION = 2.0
FEWEST_SAMPLES = 100
"""Least number of samples of a position; with fewer its noise would look like movement."""
PARTS, STILL_G = 10, 0.02
"""A position is still if the means of its ten parts lie within this of each other."""
FAR_G = np.array([0.65, 0.65, 1.15])
"""Greatest deviation of an axis from its value in a position before the part is calibrated: the data sheet's widest
zero (x, y 0.5 g; z 1 g) and sensitivity (10 %), and 0.05 g. Further off, another axis is up.
"""
MOST_TRIES = 5
DECIMALS = 5
Readings = dict[str, Array]
SECONDS_SHAKEN = 8
LOUDEST_V = 0.5
SLOWEST_HZ = 1000
PIECE = 512


def calibrate_accelerometer(job: CalibrationJob, seconds: float | None = None) -> CalibrationResult:
    """Calibrate an accelerometer by six positions, in which the experimenter lays it, and return the settings.

    Raises:
        DeviceError: the sensor cannot be opened.
        DeviceFault: it failed while it was read.
        UnfitMeasurement: the positions give no calibration.
    """
    with opened_device(job.file, job.name) as device:
        if not isinstance(device, DaqSensor) or not isinstance(device.transducer, Accelerometer):
            raise DeviceError(f"{job.name}: no accelerometer on a card")
        bench = Bench.of(job, device, device.transducer.scaling, seconds or SECONDS_A_POSITION)
        readings: Readings = {}
        for position in POSITIONS:
            readings[position] = bench.measured(position)
        fit = bench.fitted(readings)
        scaling = fit.scaling
        settings = {
            "sensitivity_V_per_g": [round(volts, DECIMALS) for volts in scaling.sensitivity_V.tolist()],
            "zero_g_V": [round(volts, DECIMALS) for volts in scaling.zero_V.tolist()],
            "scaled_at_V": scaling.supply_V,
            "calibrated": job.date,
        }
        residuals = {position: round(residual_g, 5) for position, residual_g in fit.residual_g.items()}
        rows = zip(AXES, scaling.sensitivity_V, scaling.zero_V, strict=True)
        lines = [f"{axis}: {volts:.4f} V per g, {zero:.4f} V at 0 g" for axis, volts, zero in rows]
        listed = ", ".join(f"{position} {residual_g:.4f}" for position, residual_g in fit.residual_g.items())
        lines.append(f"residual (RMS over the axes): {listed} g")
        return CalibrationResult(settings, tuple(lines), {"residual_g": residuals, "worst_g": round(fit.worst_g, 5)})


@dataclass
class Bench:
    """The open sensor, and the scaling that distinguishes its axes until it is calibrated.

    A twin is laid by a scene, without waiting in real time.
    """

    job: CalibrationJob
    sensor: DaqSensor
    scaling: Scaling
    needed: int
    now: NowNs = time.monotonic_ns
    tries: dict[str, int] = field(default_factory=dict)

    @staticmethod
    def of(job: CalibrationJob, sensor: DaqSensor, scaling: Scaling, seconds: float) -> Bench:
        """Return the bench of a sensor. Raises DeviceError if so few seconds hold too few samples."""
        rate_hz = sensor.signals[0].rate_hz
        if (needed := round(seconds * rate_hz)) < FEWEST_SAMPLES:
            problem = f"{seconds:g} s at {rate_hz:g} Hz are {needed} samples a position; {FEWEST_SAMPLES} are needed"
            raise DeviceError(f"{job.name}: {problem}: give --seconds {FEWEST_SAMPLES / rate_hz:.3g} or more")
        if sensor.driver != "twin":
            return Bench(job, sensor, scaling, needed)
        hastened = Hastened.of(sensor)
        return Bench(job, hastened, scaling, needed, hastened.clock.ns)

    def measured(self, position: str) -> Array:
        """Return the mean volts of a position, of shape (3,), once the sensor is in the right position and still.

        Raises UnfitMeasurement after too many tries.
        """
        while True:
            self.tries[position] = self.tries.get(position, 0) + 1
            if self.tries[position] > MOST_TRIES:
                raise UnfitMeasurement(
                    f"{position}: {MOST_TRIES} attempts and none that could be used; see the sensor and wires"
                )
            again = " again" if self.tries[position] > 1 else ""
            up = f"{position[1]} axis {'up' if position[0] == '+' else 'down'}"
            self.job.ask(f"{position}{again}: lay {self.job.name} with its {up} and let go of it.")
            self.sensor.expect(Lying(position))
            signal, blocks, count = self.sensor.signals[0], list[Block](), 0
            self.sensor.start(self.now)
            try:
                while count < self.needed:
                    came = self.sensor.read(WAIT_S).get(signal.name, ())
                    blocks += came
                    count += sum(len(block.data) for block in came) // (4 * len(AXES))
            finally:
                self.sensor.stop()
            # In g by the scaling so far, of shape (n, 3).
            g = samples(signal, blocks)[: self.needed] / GRAVITY_M_S2
            wrong = _movement(position, g) or _misplacement(position, g.mean(axis=0))
            if wrong is None:
                self.job.say(f"    {_format_g(g.mean(axis=0))}; noise {g.std(axis=0).max():.4f} g")
                volts: Array = self.scaling.zero_V + g.mean(axis=0) * self.scaling.sensitivity_V
                return volts
            self.job.say(f"    not taken: {wrong}")

    def fitted(self, readings: Readings) -> SixPositions:
        """Return the fit; if it is poor, the worst position is measured again. Raises UnfitMeasurement."""
        while True:
            try:
                return calibrate(readings, self.scaling.supply_V)
            except DeviceError as error:
                worst = _worst_position(readings)
                if worst is None:
                    raise UnfitMeasurement(f"{self.job.name}: {error}") from None
                self.job.say(f"    {error}")
            readings[worst] = self.measured(worst)


def _movement(position: str, g: Array) -> str | None:
    """Return a message if the sensor was not still, else None."""
    means = np.array([part.mean(axis=0) for part in np.array_split(g, PARTS)])
    wander, noise = np.ptp(means, axis=0), g.std(axis=0)
    if wander.max() > STILL_G:
        axis = AXES[wander.argmax()]
        return f"{position} moved while it was read: {axis} wandered by {wander.max():.3f} g, {STILL_G:g} are let pass"
    if noise.max() > NOISY_G:
        return f"{position} is noisy: {noise.max():.3f} g (SD) on {AXES[noise.argmax()]}; {NOISY_G:g} are let pass"
    return None


def _misplacement(position: str, g: Array) -> str | None:
    """Return a message if another axis is up, None if this axis may be."""
    if (np.abs(g - _expected_g(position)) <= FAR_G).all():
        return None
    nearest = min(POSITIONS, key=lambda position: float(np.abs(g - _expected_g(position)).max()))
    seems = f"{nearest} seems to be up" if nearest != position else "no axis is up"
    return f"{position} is requested and {seems}: {_format_g(g)}"


def _expected_g(position: str) -> Array:
    g = np.zeros(3)
    g[AXES.index(position[1])] = 1.0 if position[0] == "+" else -1.0
    return g


def _worst_position(readings: Mapping[str, Array]) -> str | None:
    """Return the position furthest from the fit; None if the sensitivities themselves are impossible."""
    means = np.array([readings[position] for position in POSITIONS])
    g = np.array([_expected_g(position) for position in POSITIONS])
    sensitivity = (means * g).sum(axis=0) / 2
    if not (sensitivity > 0).all():
        return None
    off = np.linalg.norm((means - means.mean(axis=0)) / sensitivity - g, axis=1)
    return POSITIONS[int(off.argmax())]


def _format_g(g: Array) -> str:
    return ", ".join(f"{axis} {value:+.3f} g" for axis, value in zip(AXES, g, strict=True))


def calibrate_coil(
    job: CalibrationJob, sensor: str | None, level_V: float | None, seconds: float | None, force: bool
) -> CalibrationResult:
    """Shake the coil, write its response beside the rig file, and return the setting that names that file.

    Raises:
        DeviceError: coil or sensor are not available for this.
        DeviceFault: one of them failed.
        UnfitMeasurement: the recording identifies nothing.
    """
    settings = job.file.devices[job.name]
    if not isinstance(settings, Settings):
        raise DeviceError(f"{job.name}: no voice coil")
    chosen = accelerometer_for(job.file, job.name, sensor)
    if level_V is not None and level_V > settings.peak_V:
        raise DeviceError(f"--level {level_V:g}: {job.name} bears {settings.peak_V:g} V (`peak_V`); give a lower level")
    whole = SECONDS_SHAKEN if seconds is None else round(seconds)
    if whole < FEWEST:
        raise DeviceError(
            f"{job.name}: --seconds {seconds:g}: {FEWEST} at least are needed to tell noise from response"
        )
    if level_V is None:  # half of the peak that the coil bears, and no more than it bears for long
        level_V = min(LOUDEST_V, settings.peak_V / 2, settings.rms_V)
    shaking = Shaking(level_V=level_V, measured=whole)
    path = job.file.path.parent / f"{job.name}-{job.date}.json"
    if path.exists() and not force:
        raise DeviceError(f"{path} exists, and records may name it; give --force to overwrite it")
    result = _identify(job, chosen, shaking)
    save(result.calibration(job.date), path)
    inverse = result.inverse
    coherence = result.response.coherence[result.response.inside(result.wish.low_Hz, result.wish.high_Hz)]
    figures: dict[str, Any] = {
        "file": str(path), "level_V": result.shaking.level_V, "band_Hz": [result.wish.low_Hz, result.wish.high_Hz],
        "gain_m_s2_V": inverse.gain, "ripple_dB": inverse.ripple_dB, "before_dB": inverse.before_dB,
        "delay_ms": inverse.delay_ms, "added_ms": inverse.added_ms, "coherence_median": float(np.median(coherence)),
        "coherence_least": float(coherence.min()), "limited_Hz": list(inverse.limited_Hz),
    }  # fmt: skip
    return CalibrationResult({"calibration": path.name, "calibrated": job.date}, tuple(_coil_lines(figures)), figures)


def accelerometer_for(file: RigFile, coil: str, sensor: str | None) -> str:
    """Return the name of the requested accelerometer, or of the rig's only one. Raises DeviceError."""
    there = [name for name in file.devices if file.kind(name) == "accelerometer"]
    if sensor is None and len(there) == 1:
        sensor = there[0]
    listed = f"{file.path} has {', '.join(there) or 'none'}"
    if sensor is None:
        raise DeviceError(f"{coil} is calibrated with an accelerometer on it: give --with NAME; {listed}")
    if sensor not in file.devices:
        raise DeviceError(f"{file.path} names no device {sensor!r}; {nearest(sensor, there)}")
    if sensor not in there:
        raise DeviceError(f"--with {sensor}: that is a {file.kind(sensor)}; an accelerometer is expected: {listed}")
    if file.is_twin(coil) != file.is_twin(sensor):
        twin, real = (coil, sensor) if file.is_twin(coil) else (sensor, coil)
        raise DeviceError(f"{twin} is a twin and {real} is not: neither feels the other; take two of one sort")
    rate_hz = float(getattr(file.devices[sensor], "rate_hz", 0.0))
    if rate_hz < SLOWEST_HZ or rate_hz != round(rate_hz):
        raise DeviceError(
            f"{sensor} samples at {rate_hz:g} Hz; to measure {coil} a whole number of Hz,"
            f" {SLOWEST_HZ} at least, is needed: raise its `rate_hz`"
        )
    return sensor


def _identify(job: CalibrationJob, sensor: str, shaking: Shaking) -> Identified:
    bare = job.file.devices[job.name].model_copy(update={"calibration": None})
    rig = open_rig(replace(job.file, devices={**job.file.devices, job.name: bare}), [job.name, sensor])
    try:
        job.ask(
            f"{job.name} will shake at up to {shaking.level_V:g} V for some {1.5 * shaking.measured:.0f} s."
            f" Fasten {sensor} to it, let nobody hold it."
        )
        moving, feeling = rig.devices[job.name], rig.devices[sensor]
        if not isinstance(moving, VoiceCoil) or not isinstance(feeling, DaqSensor):
            raise DeviceError(f"{job.name} and {sensor}: no voice coil and accelerometer")
        if not rig.file.is_twin(job.name):
            return identify(_refuse_clipped(through(moving, feeling, time.monotonic_ns), feeling), shaking)
        bench = fastened(moving, feeling)
        return identify(_refuse_clipped(through(moving, bench, bench.clock.ns), feeling), shaking)
    except ResponseError as error:
        raise UnfitMeasurement(f"{job.name}: {error}") from None
    finally:
        rig.close()


def _refuse_clipped(play_and_record: PlayAndRecord, sensor: DaqSensor) -> PlayAndRecord:
    """Wrap the measurement to refuse clipped recordings, because noise hides flat tops from a later check."""

    def checked(volts: Array) -> tuple[Array, int]:
        recorded, rate_hz = play_and_record(volts)
        clipped = sensor.transducer.clipped if isinstance(sensor.transducer, Accelerometer) else 0
        if clipped > CLIPPED_SHARE * len(recorded):
            problem = f"{100 * clipped / len(recorded):.1f} % of the samples of {sensor.name} are clipped"
            raise ResponseError(f"{problem}: give a lower --level, or see that no axis is near its end at rest")
        return recorded, rate_hz

    return checked


def _coil_lines(figures: dict[str, Any]) -> Iterator[str]:
    low, high = figures["band_Hz"]
    yield f"gain: {figures['gain_m_s2_V']:.3g} m/s^2 per volt, median from {low:g} to {high:g} Hz"
    yield f"ripple: {figures['ripple_dB']:.2f} dB with the filter, {figures['before_dB']:.1f} dB without"
    yield f"delay: {figures['delay_ms']:.1f} ms from wish to movement, {figures['added_ms']:+.1f} ms of it the filter's"
    yield f"coherence: {figures['coherence_median']:.4f} (median), {figures['coherence_least']:.3f} (least)"
    if weak := figures["limited_Hz"]:
        lines = count(len(weak), "line")
        yield f"left weak, since the filter's gain is limited: {lines}, {weak[0]:g} to {weak[-1]:g} Hz"
    yield f"wrote {figures['file']}"


@dataclass
class Passing:
    """A clock whose seconds pass only when it is advanced."""

    s: float = 0.0

    def __call__(self) -> float:
        """Return the seconds so far."""
        return self.s

    def ns(self) -> int:
        """Return the nanoseconds so far."""
        return round(self.s * NS)


@dataclass
class Hastened(DaqSensor):
    """A twin on whose clock a read of 50 ms takes 50 ms, without waiting in real time."""

    clock: Passing = field(default_factory=Passing)

    def __post_init__(self) -> None:
        self.elapsed_s = self.clock

    @staticmethod
    def of(twin: DaqSensor) -> Hastened:
        """Return the same twin, on the same card, with a clock that only reading advances."""
        return Hastened(twin.name, twin.kind, twin.driver, twin.daq, twin.transducer)

    def read(self, timeout_s: float) -> Mapping[str, Sequence[Block]]:
        """Let the time pass and return the samples of it."""
        self.clock.s += timeout_s
        return super().read(timeout_s)


@dataclass(frozen=True)
class _Still:
    """A scene of which only the acceleration is used."""

    def wrench(self, rate_hz: float) -> Iterator[Array]:  # noqa: ARG002 - a scene is asked so
        """Yield zeros, because nothing pulls."""
        return repeat(np.zeros((PIECE, 6)))

    def position_mm(self, rate_hz: float) -> Iterator[Array]:  # noqa: ARG002 - a scene is asked so
        """Yield zeros, because nothing moves away."""
        return repeat(np.zeros((PIECE, 3)))


@dataclass(frozen=True)
class Lying(_Still):
    """A scene at rest with one axis up (`+x` to `-z`), where the sensor measures one g along that axis."""

    up: str

    def acceleration_m_s2(self, rate_hz: float) -> Iterator[Array]:  # noqa: ARG002 - a scene is asked so
        """Yield gravity, without end."""
        g = np.zeros((PIECE, 3))
        g[:, "xyz".index(self.up[1])] = GRAVITY_M_S2 if self.up[0] == "+" else -GRAVITY_M_S2
        return repeat(g)


@dataclass(frozen=True)
class Fastened(_Still):
    """A scene on the twin of an actuator, which moves along the sensor's x; z is up."""

    coil: Felt
    fresh: list[Array] = field(default_factory=list)

    def acceleration_m_s2(self, rate_hz: float) -> Iterator[Array]:
        """Yield the coil's acceleration from now on, holding each value until the next and the last one."""
        self.fresh.clear()
        coil_hz = self.coil.rate_hz
        g, passed, number = np.zeros(1), -1, 0  # felt[0] was felt in the coil's sample `passed`; before, rest.
        while True:
            self.coil.advance()
            g = np.concatenate([g, *self.fresh])
            self.fresh.clear()
            ready = max(number + 1, int(np.ceil((passed + len(g)) * rate_hz / coil_hz)))
            at = np.minimum(np.arange(number, ready) * coil_hz // rate_hz - passed, len(g) - 1).astype(int)
            yield np.stack([g[at], np.zeros(len(at)), np.full(len(at), GRAVITY_M_S2)], axis=1)
            g, passed, number = g[at[-1] :], passed + int(at[-1]), ready


class Actuator(Protocol):
    """What moves a sensor: a voice coil or a vibrator."""

    name: str

    @property
    def output(self) -> Output:
        """Return the output that drives it."""


def fastened(coil: Actuator, sensor: DaqSensor) -> Hastened:
    """Return the sensor's twin on the actuator's twin, on one clock. Raises DeviceError if only one is a twin."""
    output = coil.output
    if not isinstance(output, Felt) or sensor.driver != "twin":
        twin, real = (coil.name, sensor.name) if isinstance(output, Felt) else (sensor.name, coil.name)
        raise DeviceError(f"{twin} is a twin and {real} is not: neither feels the other; give both a real driver")
    hastened = Hastened.of(sensor)
    scene = Fastened(output)

    def shaken(volts: Array) -> None:
        output.shake(volts)
        scene.fresh.append(output.felt[-1])

    output.elapsed_s, output.heard = hastened.clock, shaken
    sensor.expect(scene)
    return hastened
