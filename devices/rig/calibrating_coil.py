"""A voice coil identified with an accelerometer of the same rig: shaken, recorded, made flat, kept as a file."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.devices.actuator.calibration import save
from palpate.devices.actuator.device import VoiceCoil
from palpate.devices.actuator.identify import Identified, PlayAndRecord, Shaking, identify, through
from palpate.devices.actuator.response import CLIPPED_SHARE, FEWEST, ResponseError
from palpate.devices.actuator.settings import Settings
from palpate.devices.daq.adxl335 import Accelerometer
from palpate.devices.daq.sensor import DaqSensor
from palpate.devices.rig.calibrating import Found, Job, Unfit
from palpate.devices.rig.calibrating_bench import fastened
from palpate.devices.rig.file import RigFile
from palpate.devices.rig.opened import OpenRig, open_rig
from palpate.devices.signals import DeviceError
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count
from palpate.signals.arrays import Array

SECONDS = 8
LOUDEST_V = 0.5
SLOWEST_HZ = 1000


def calibrated(job: Job, sensor: str | None, level_V: float | None, seconds: float | None, force: bool) -> Found:
    """Shake the coil, write what was found beside the rig file, and give the setting that names it.

    Raises DeviceError where one of the two cannot be had as asked, DeviceFault where one fails, Unfit where what was
    recorded identifies nothing.
    """
    settings = job.file.devices[job.name]
    if not isinstance(settings, Settings):
        raise DeviceError(f"{job.name}: no voice coil")
    chosen = _sensor(job.file, job.name, sensor)
    shaking = Shaking(level_V=_level_V(job.name, settings, level_V), measured=_measured(job.name, seconds))
    path = job.file.path.parent / f"{job.name}-{job.date}.json"
    if path.exists() and not force:
        raise DeviceError(f"{path} is there already, and records may name it; give --force to write over it")
    found = _identified(job, chosen, shaking)
    save(found.calibration(job.date), path)
    return _found(found, path, job.date)


def _sensor(file: RigFile, coil: str, asked: str | None) -> str:
    """The accelerometer that is asked for, or the rig's only one. Raises DeviceError."""
    there = [name for name in file.devices if file.kind(name) == "accelerometer"]
    if asked is None and len(there) == 1:
        asked = there[0]
    listed = f"{file.path} has {', '.join(there) or 'none'}"
    if asked is None:
        raise DeviceError(f"{coil} is calibrated with an accelerometer on it: give --with NAME; {listed}")
    if asked not in file.devices:
        raise DeviceError(f"{file.path} names no device {asked!r}; {nearest(asked, there)}")
    if asked not in there:
        raise DeviceError(f"--with {asked}: that is a {file.kind(asked)}; an accelerometer is expected: {listed}")
    _demand_pair(file, coil, asked)
    return asked


def _demand_pair(file: RigFile, coil: str, sensor: str) -> None:
    if file.is_twin(coil) != file.is_twin(sensor):
        twin, real = (coil, sensor) if file.is_twin(coil) else (sensor, coil)
        raise DeviceError(f"{twin} is a twin and {real} is not: neither feels the other; take two of one sort")
    rate_hz = float(getattr(file.devices[sensor], "rate_hz", 0.0))
    if rate_hz < SLOWEST_HZ or rate_hz != round(rate_hz):
        raise DeviceError(
            f"{sensor} samples at {rate_hz:g} Hz; to identify a voice coil up to 490 Hz a whole number of Hz,"
            f" {SLOWEST_HZ} at least, is needed: raise its `rate_hz`"
        )


def _level_V(name: str, settings: Settings, asked: float | None) -> float:
    """Half of what the coil bears, 0.5 V at most, unless another level is asked for. Raises DeviceError above it."""
    most = min(settings.peak_V, settings.rms_V)
    if asked is not None and asked > settings.peak_V:
        raise DeviceError(f"--level {asked:g}: {name} bears {settings.peak_V:g} V (`peak_V`); give a lower level")
    return min(LOUDEST_V, settings.peak_V / 2, most) if asked is None else asked


def _measured(name: str, seconds: float | None) -> int:
    whole = SECONDS if seconds is None else round(seconds)
    if whole < FEWEST:
        raise DeviceError(f"{name}: --seconds {seconds:g}: {FEWEST} at least are needed to tell noise from response")
    return whole


def _unfiltered(file: RigFile, coil: str) -> RigFile:
    """The rig with the coil as it is without its calibration, whose file need not be there yet."""
    bare = file.devices[coil].model_copy(update={"calibration": None})
    return replace(file, devices={**file.devices, coil: bare})


def _identified(job: Job, sensor: str, shaking: Shaking) -> Identified:
    rig = open_rig(_unfiltered(job.file, job.name), [job.name, sensor])
    try:
        job.ask(
            f"{job.name} will shake at up to {shaking.level_V:g} V for some {1.5 * shaking.measured:.0f} s."
            f" Fasten {sensor} to it, let nobody hold it."
        )
        return _shaken(rig, job.name, sensor, shaking)
    except ResponseError as error:
        raise Unfit(f"{job.name}: {error}") from None
    finally:
        rig.close()


def _shaken(rig: OpenRig, coil: str, sensor: str, shaking: Shaking) -> Identified:
    moving, feeling = rig.devices[coil], rig.devices[sensor]
    if not isinstance(moving, VoiceCoil) or not isinstance(feeling, DaqSensor):
        raise DeviceError(f"{coil} and {sensor}: no voice coil and accelerometer")
    if not rig.file.is_twin(coil):
        return identify(_within_range(through(moving, feeling, time.monotonic_ns), feeling), shaking)
    bench = fastened(moving, feeling)
    return identify(_within_range(through(moving, bench, bench.clock.ns), feeling), shaking)


def _within_range(play_and_record: PlayAndRecord, sensor: DaqSensor) -> PlayAndRecord:
    """The same, refused where the sensor was shaken beyond its range: noise hides flat tops from a later look."""

    def checked(volts: Array) -> tuple[Array, int]:
        recorded, rate_hz = play_and_record(volts)
        clipped = sensor.transducer.clipped if isinstance(sensor.transducer, Accelerometer) else 0
        if clipped > CLIPPED_SHARE * len(recorded):
            told = f"{100 * clipped / len(recorded):.1f} % of the samples of {sensor.name} are clipped"
            raise ResponseError(f"{told}: give a lower --level, or see that no axis is near its end at rest")
        return recorded, rate_hz

    return checked


def _found(found: Identified, path: Path, date: str) -> Found:
    made = found.inverse
    coherence = found.response.coherence[found.response.inside(found.wish.low_Hz, found.wish.high_Hz)]
    figures: dict[str, Any] = {
        "file": str(path), "level_V": found.shaking.level_V, "band_Hz": [found.wish.low_Hz, found.wish.high_Hz],
        "gain_m_s2_V": made.gain, "ripple_dB": made.ripple_dB, "before_dB": made.before_dB, "delay_ms": made.delay_ms,
        "added_ms": made.added_ms, "coherence_median": float(np.median(coherence)),
        "coherence_least": float(coherence.min()), "limited_Hz": list(made.limited_Hz),
    }  # fmt: skip
    return Found({"calibration": path.name, "calibrated": date}, tuple(_told(figures)), figures)


def _told(figures: dict[str, Any]) -> Iterator[str]:
    low, high = figures["band_Hz"]
    yield f"gain: {figures['gain_m_s2_V']:.3g} m/s^2 per volt, median from {low:g} to {high:g} Hz"
    yield f"ripple: {figures['ripple_dB']:.2f} dB with the filter, {figures['before_dB']:.1f} dB without"
    yield f"delay: {figures['delay_ms']:.1f} ms from wish to movement, {figures['added_ms']:+.1f} ms of it the filter's"
    yield f"coherence: {figures['coherence_median']:.4f} (median), {figures['coherence_least']:.3f} (least)"
    if weak := figures["limited_Hz"]:
        lines = count(len(weak), "line")
        yield f"left weak, since the filter's gain is limited: {lines}, {weak[0]:g} to {weak[-1]:g} Hz"
    yield f"wrote {figures['file']}"
