"""Calibrate a vibrator with an accelerometer of the same rig: gain and phase by frequency, at two levels."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from palpate.devices.actuator.calibration import write_calibration
from palpate.devices.actuator.identify import along_the_motion, envelope_delay_ms
from palpate.devices.actuator.response import (
    CLIPPED_SHARE,
    FEWEST,
    Response,
    ResponseError,
    demand_coherence,
    estimate,
    excitation,
)
from palpate.devices.daq.adxl335 import Accelerometer
from palpate.devices.daq.sensor import DaqSensor
from palpate.devices.device import DeviceError, DeviceFault, NowNs
from palpate.devices.rig.calibration import CalibrationJob, CalibrationResult, UnfitMeasurement
from palpate.devices.rig.opened import open_rig
from palpate.devices.rig.vibration_calibration import Hastened, accelerometer_for, fastened
from palpate.devices.vibrator.calibration import VibratorCalibration, least_volts
from palpate.devices.vibrator.device import Vibrator
from palpate.devices.vibrator.outputs import full_scale_V
from palpate.devices.vibrator.settings import Settings
from palpate.protocols.events import NS
from palpate.signals import GRAVITY_M_S2
from palpate.signals.arrays import Array

LOW_HZ, HIGH_HZ = 20, 1000
TOP_SHARE = 0.4
"""Highest calibrated frequency as a share of the sensor's rate."""
LIFTED_HZ = 200.0
SECONDS = 8
QUIETER = 10 ** (-10 / 20)
"""The second level, 10 dB down, which shows whether the actuator is linear."""
PROBES = 10 ** (np.arange(-6, 1) / 2)
"""Levels that are tried one after the other, relative to the largest, until the sensor would be near its end."""
USED_SHARE, HEADROOM_G = 0.5, 1.0
PATIENCE_S, STEP_S = 5.0, 0.002


@dataclass
class Bench:
    """An open vibrator with an open accelerometer on it, on one clock."""

    vibrator: Vibrator
    sensor: DaqSensor
    now_ns: NowNs

    @property
    def rate_hz(self) -> int:
        """Return the sensor's rate."""
        return round(self.sensor.signals[0].rate_hz)

    @property
    def most_m_s2(self) -> float:
        """Return what the sensor should be shaken with at most: half of its range, without gravity."""
        transducer = self.sensor.transducer
        full_scale_g = transducer.full_scale_g if isinstance(transducer, Accelerometer) else 2.0
        return max(USED_SHARE * (full_scale_g - HEADROOM_G), 0.1) * GRAVITY_M_S2

    def shaken(self, volts: Array) -> Array:
        """Drive these volts, and return the acceleration in m/s^2 along the motion, as long as they are.

        Raises ResponseError where the recording is of no use, DeviceFault where a device failed.
        """
        needed = len(volts) * self.rate_hz // self.vibrator.settings.rate_hz
        signal, parts, count = self.sensor.signals[0], [np.zeros((0, 3))], 0
        self.sensor.start(self.now_ns)
        try:
            self.vibrator.drive(volts, self.now_ns)
            until_ns = self.now_ns() + round((2 * len(volts) / self.vibrator.settings.rate_hz + PATIENCE_S) * NS)
            while count < needed:
                self.vibrator.feed()
                for block in self.sensor.read(STEP_S).get(signal.name, ()):
                    if block.lost:
                        raise ResponseError(f"{block.lost} samples were lost ({block.why}): measure again")
                    parts.append(np.frombuffer(block.data, "<f4").reshape(-1, 3).astype(np.float64))
                    count += len(parts[-1])
                if self.now_ns() > until_ns:
                    raise DeviceFault(
                        self.sensor.name, "silent", f"{self.sensor.name}: {count} of {needed} samples came"
                    )
        finally:
            self.vibrator.safe()
            self.sensor.stop()
        self._demand_unclipped(count)
        return along_the_motion(np.concatenate(parts)[:needed])

    def _demand_unclipped(self, count: int) -> None:
        clipped = self.sensor.transducer.clipped if isinstance(self.sensor.transducer, Accelerometer) else 0
        if clipped > CLIPPED_SHARE * count:
            share = f"{100 * clipped / count:.1f} % of the samples of {self.sensor.name} are clipped"
            raise ResponseError(f"{share}: give a lower --level, or see that no axis is near its end at rest")


@contextmanager
def bench_of(job: CalibrationJob, sensor: str | None, settings: Settings) -> Iterator[Bench]:
    """Open the vibrator, with these settings, and the accelerometer on it. Raises DeviceError."""
    chosen = accelerometer_for(job.file, job.name, sensor)
    rig = open_rig(replace(job.file, devices={**job.file.devices, job.name: settings}), [job.name, chosen])
    try:
        vibrator, feeling = rig.devices[job.name], rig.devices[chosen]
        if not isinstance(vibrator, Vibrator) or not isinstance(feeling, DaqSensor):
            raise DeviceError(f"{job.name} and {chosen}: no vibrator and accelerometer")
        if not rig.file.is_twin(job.name):
            yield Bench(vibrator, feeling, time.monotonic_ns)
            return
        hastened: Hastened = fastened(vibrator, feeling)
        vibrator.output.start(vibrator.player.fill)  # its time begins anew, on the sensor's clock
        yield Bench(vibrator, hastened, hastened.clock.ns)
    except ResponseError as error:
        raise UnfitMeasurement(f"{job.name}: {error}") from None
    finally:
        rig.close()


def calibrate_vibrator(
    job: CalibrationJob, sensor: str | None, level_V: float | None, seconds: float | None, force: bool
) -> CalibrationResult:
    """Shake the vibrator, write its response beside the rig file, and return the setting that names that file.

    Raises:
        DeviceError: vibrator or sensor are not available for this.
        DeviceFault: one of them failed, or a limit was reached.
        UnfitMeasurement: the recording calibrates nothing.
    """
    settings = job.file.devices[job.name]
    if not isinstance(settings, Settings):
        raise DeviceError(f"{job.name}: no vibrator")
    most_V = settings.limits.peak_V
    if level_V is not None and level_V > most_V:
        raise DeviceError(f"--level {level_V:g}: {job.name} bears {most_V:g} V (`limits.peak_V`); give a lower level")
    whole = SECONDS if seconds is None else round(seconds)
    if whole < FEWEST:
        raise DeviceError(
            f"{job.name}: --seconds {seconds:g}: {FEWEST} at least are needed to tell noise from response"
        )
    path = job.file.path.parent / f"{job.name}-{job.date}.json"
    if path.exists() and not force:
        raise DeviceError(f"{path} exists, and records may name it; give --force to overwrite it")
    name = accelerometer_for(job.file, job.name, sensor)
    job.ask(f"{job.name} will shake for some {3 * whole + 4} s. Fasten {name} where the skin is, let nobody hold it.")
    bare = settings.model_copy(update={"calibration": None, "certificate": None})
    with bench_of(job, sensor, bare) as bench:
        calibration = measured(bench, job.date, level_V, whole)
    write_calibration(calibration, path)
    figures = _figures(calibration, str(path))
    lines = tuple(_lines(figures))
    return CalibrationResult({"calibration": path.name, "calibrated": job.date}, lines, figures)


def measured(bench: Bench, date: str, level_V: float | None = None, seconds: int = SECONDS) -> VibratorCalibration:
    """Return the calibration that a bench gives; without a level at what the sensor bears. Raises ResponseError."""
    settings = bench.vibrator.settings
    top = min(HIGH_HZ, round(TOP_SHARE * bench.rate_hz))
    level_V = _bearable_V(bench, top) if level_V is None else level_V
    loud, quiet = (_response(bench, level, seconds, top) for level in (level_V, level_V * QUIETER))
    inside = loud.inside(LOW_HZ, top)
    hz, response = loud.hz[inside], loud.response[inside]
    delay_ms = envelope_delay_ms(hz, response)
    flat = response * np.exp(2j * np.pi * hz * delay_ms / 1000)
    return VibratorCalibration(
        date=date, sensor=bench.sensor.name, excitation=f"multisine, {level_V:.4g} V", band_Hz=(LOW_HZ, top),
        least_V=least_volts(full_scale_V(settings), settings.bits), most_V=level_V,
        linear_dB=_apart_dB(loud, quiet, top), delay_ms=delay_ms, hz=hz.tolist(), real=flat.real.tolist(),
        imaginary=flat.imag.tolist(), coherence=loud.coherence[inside].tolist(),
    )  # fmt: skip


def _bearable_V(bench: Bench, top: int) -> float:
    """Return the largest level at which the sensor stays within half of its range."""
    settings = bench.vibrator.settings
    most_V = min(settings.limits.peak_V, settings.limits.rms_V)
    probe = excitation("multisine", 1.0, 1, 1, settings.rate_hz, top, LIFTED_HZ).samples[: settings.rate_hz // 2]
    for share in PROBES:
        peak = float(np.abs(bench.shaken(share * most_V * probe)).max())
        if peak * np.sqrt(10) > bench.most_m_s2:
            return float(share * most_V * min(1.0 / share, bench.most_m_s2 / peak))
    return float(most_V)


def _response(bench: Bench, level_V: float, seconds: int, top: int) -> Response:
    settings = bench.vibrator.settings
    played = excitation("multisine", level_V, settings.seed, seconds, settings.rate_hz, top, LIFTED_HZ)
    response = estimate(played, bench.shaken(played.samples), bench.rate_hz)
    demand_coherence(response, LOW_HZ, top)
    return response


def _apart_dB(loud: Response, quiet: Response, top: int) -> float:
    """Return the largest difference of the two gains, of the medians in twenty bands."""
    apart = 20 * np.log10(np.abs(loud.response) / np.abs(quiet.response))
    edges = np.geomspace(LOW_HZ, top, 21)
    bands = [apart[loud.inside(low, high)] for low, high in pairwise(edges)]
    return float(max(abs(float(np.median(band))) for band in bands if len(band)))


def _figures(calibration: VibratorCalibration, path: str) -> dict[str, Any]:
    gains = np.abs(calibration.response)
    coherence = np.array(calibration.coherence)
    return {
        "file": path, "band_Hz": list(calibration.band_Hz), "level_V": calibration.most_V,
        "gain_m_s2_V": float(np.median(gains)), "linear_dB": calibration.linear_dB, "delay_ms": calibration.delay_ms,
        "coherence_median": float(np.median(coherence)), "coherence_least": float(coherence.min()),
    }  # fmt: skip


def _lines(figures: dict[str, Any]) -> Iterator[str]:
    low, high = figures["band_Hz"]
    yield f"gain: {figures['gain_m_s2_V']:.3g} m/s^2 per volt, median from {low:g} to {high:g} Hz"
    yield f"levels: up to a peak of {figures['level_V']:.3g} V; linear within {figures['linear_dB']:.2f} dB over 10 dB"
    yield f"delay: {figures['delay_ms']:.1f} ms from the output to the movement"
    yield f"coherence: {figures['coherence_median']:.4f} (median), {figures['coherence_least']:.3f} (least)"
    yield f"wrote {figures['file']}"
