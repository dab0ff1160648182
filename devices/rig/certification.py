"""Certify when a vibration is felt: from command to onset and the error of the level, by an accelerometer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.devices.actuator.identify import along_the_motion
from palpate.devices.actuator.response import ResponseError
from palpate.devices.device import Block, DeviceError
from palpate.devices.rig.calibration import CalibrationJob, CalibrationResult, UnfitMeasurement
from palpate.devices.rig.vibrator_calibration import Bench, bench_of
from palpate.devices.vibrator.device import Vibrator
from palpate.devices.vibrator.settings import Certificate, Settings
from palpate.protocols.events import NS
from palpate.signals.arrays import Array
from palpate.signals.vibration import Vibration, waveform

BURST = Vibration("burst of the certificate", "noise", 0.0, "m_s2", 0.04, 0.002, low_hz=50.0, high_hz=400.0, seed=1)
"""40 ms of noise: only one delay fits it, where a burst of a sine fits at every period."""
PEAK_M_S2 = 5.0
SPACING_S, SPREAD_S = 0.2, 0.05
"""Commands come so far apart, and by another part of `SPREAD_S` each time, to meet every phase of the output."""
LONGEST_S = 0.15
GOLDEN = 0.6180339887498949
LEAST_FIT = 0.7
"""Least correlation of a burst with what was recorded."""
FEWEST, MOST = 20, 1000
KEYS = {"p50": "p50_ms", "p99": "p99_ms", "max": "most_ms"}
"""The bounds that a study may set, and the figures of a certificate."""


@dataclass(frozen=True)
class Measured:
    """What was measured of each burst: arrays of shape (bursts,).

    `onset_ms` is from the command to the onset, `level_dB` the level above the commanded one, `late_ms` from the onset
    that the device reports (`onset_ns`) to the measured one.
    """

    onset_ms: Array
    level_dB: Array
    late_ms: Array

    def certificate(self, settings: str, date: str, sensor: str) -> Certificate:
        """Return the certificate; `settings` is the digest of what it holds for."""
        p50, p99, most = (float(value) for value in (*np.percentile(self.onset_ms, [50, 99]), self.onset_ms.max()))
        return Certificate(
            date=date, sensor=sensor, bursts=len(self.onset_ms), p50_ms=round(p50, 3), p99_ms=round(p99, 3),
            most_ms=round(most, 3), level_dB=round(float(np.median(self.level_dB)), 2),
            late_ms=round(float(np.median(self.late_ms)), 3), settings=settings,
        )  # fmt: skip


def certify(job: CalibrationJob, sensor: str | None = None, bursts: int = 200) -> CalibrationResult:
    """Play bursts, measure each by the accelerometer, and return the setting with the certificate.

    Raises:
        DeviceError: vibrator or sensor are not available for this, or the vibrator is not calibrated.
        DeviceFault: one of them failed.
        UnfitMeasurement: bursts were not found in the recording.
    """
    settings = job.file.devices[job.name]
    if not isinstance(settings, Settings):
        raise DeviceError(f"{job.name}: it is of kind {job.file.kind(job.name)}, and only a vibrator is certified")
    if not FEWEST <= bursts <= MOST:
        raise DeviceError(f"--bursts {bursts}: {FEWEST} to {MOST} are expected")
    job.ask(f"{job.name} will play {bursts} short bursts. Fasten the accelerometer where the skin is.")
    with bench_of(job, sensor, settings) as bench:
        measured = measure(bench, bursts)
        certificate = measured.certificate(bench.vibrator.certified_digest(), job.date, bench.sensor.name)
    figures = {
        **certificate.model_dump(mode="json"), "sd_ms": float(measured.onset_ms.std()),
        "resolution_ms": 1000 / bench.rate_hz,
    }  # fmt: skip
    lines = (
        f"onset after the command: {certificate.p50_ms:.2f} ms (median), {certificate.p99_ms:.2f} ms (p99), "
        f"{certificate.most_ms:.2f} ms (longest), of {bursts} bursts",
        f"after the onset that replies report: {certificate.late_ms:.2f} ms (median)",
        f"level: {certificate.level_dB:+.2f} dB from the commanded one (median)",
        f"by {bench.sensor.name}, one sample is {figures['resolution_ms']:.2f} ms",
    )
    return CalibrationResult({"certificate": certificate.model_dump(mode="json")}, lines, figures)


def measure(bench: Bench, bursts: int) -> Measured:
    """Play the bursts and find each in the recording. Raises UnfitMeasurement, DeviceFault."""
    rate_hz = bench.vibrator.settings.rate_hz
    burst = waveform(BURST, rate_hz)
    burst *= min(PEAK_M_S2, bench.most_m_s2) / float(np.abs(burst).max())
    signal, blocks, commands_ns = bench.sensor.signals[0], list[Block](), list[int]()
    reported_ns = list[int]()
    bench.sensor.start(bench.now_ns)
    begin_ns = bench.now_ns()
    due_s = [SPACING_S * (n + 1) + SPREAD_S * ((n * GOLDEN) % 1) for n in range(bursts)]
    try:
        while bench.now_ns() - begin_ns < (due_s[-1] + 2 * LONGEST_S) * NS:
            passed_s = (bench.now_ns() - begin_ns) / NS
            if len(commands_ns) < bursts and passed_s >= due_s[len(commands_ns)]:
                commands_ns.append(bench.now_ns())
                bench.vibrator.play(burst, 0.0, bench.now_ns)
            bench.vibrator.feed()
            if len(reported_ns) < len(commands_ns) and (onset_ns := bench.vibrator.player.onset_ns) is not None:
                reported_ns.append(onset_ns)
            blocks += bench.sensor.read(0.003).get(signal.name, ())
    finally:
        bench.vibrator.safe()
        bench.sensor.stop()
    rows, first_ns = _rows(blocks, bench.rate_hz)
    template = np.interp(np.arange(round(BURST.seconds * bench.rate_hz)) / bench.rate_hz,
                         np.arange(len(burst)) / rate_hz, burst)  # fmt: skip
    starts_s = [(command_ns - first_ns) / NS for command_ns in commands_ns]
    try:
        recorded = along_the_motion(rows)
    except ResponseError as error:
        raise UnfitMeasurement(f"{bench.vibrator.name}: {error}") from None
    onset_ms, level_dB = onsets(recorded, bench.rate_hz, template, starts_s)
    return Measured(onset_ms, level_dB, onset_ms - (np.array(reported_ns) - np.array(commands_ns)) / 1e6)


def _rows(blocks: Sequence[Block], rate_hz: int) -> tuple[Array, int]:
    """Return the samples of shape (n, 3), and when the first was taken: no block comes before its samples are over."""
    if not blocks or any(block.lost for block in blocks):
        raise UnfitMeasurement("samples of the accelerometer were lost or none came: certify it again")
    parts = [np.frombuffer(block.data, "<f4").reshape(-1, 3).astype(np.float64) for block in blocks]
    ends = np.cumsum([len(part) for part in parts])
    first_ns = min(block.at_ns - round(int(end) * NS / rate_hz) for block, end in zip(blocks, ends, strict=True))
    return np.concatenate(parts), first_ns


def onsets(recorded: Array, rate_hz: float, template: Array, starts_s: Sequence[float]) -> tuple[Array, Array]:
    """Return when (ms) and how strong (dB) the template is in the recording after each start, by its best fit.

    The delay is where the correlation is largest, between samples by a parabola; the level is the fitted factor. Raises
    UnfitMeasurement where a burst does not fit.
    """
    reach, found_ms, found_dB = round(LONGEST_S * rate_hz), list[float](), list[float]()
    energy = float(template @ template)
    sign = 0.0
    for number, start_s in enumerate(starts_s):
        first = max(int(np.floor(start_s * rate_hz)) - 1, 0)
        part = recorded[first : first + reach + len(template)]
        part = part - part.mean() if len(part) else part
        if len(part) <= len(template) + 2:
            raise UnfitMeasurement(f"burst {number + 1} is not in the recording: it ended too soon")
        fit = np.correlate(part, template, "valid")
        sign = sign or float(np.sign(fit[np.abs(fit).argmax()]))  # the sensor may lie either way round
        place = int((sign * fit).argmax())
        inside = min(max(place, 1), len(fit) - 2)
        before, at, after = (sign * fit[inside - 1 : inside + 2]).tolist()
        bend = before - 2 * at + after
        shift = 0.5 * (before - after) / bend if bend < 0 else 0.0
        piece = part[inside : inside + len(template)]
        if at < LEAST_FIT * np.sqrt(energy * float(piece @ piece)):
            share = at / max(np.sqrt(energy * float(piece @ piece)), 1e-12)
            raise UnfitMeasurement(
                f"burst {number + 1} of {len(starts_s)} was not found (correlation {share:.2f}; {LEAST_FIT} is needed)"
                ": fasten the sensor, let nothing else shake it, and calibrate the vibrator first"
            )
        found_ms.append(1000 * ((first + inside + shift) / rate_hz - start_s))
        found_dB.append(20 * float(np.log10((at - 0.25 * (before - after) * shift) / energy)))
    return np.array(found_ms), np.array(found_dB)


def demand_certified(vibrator: Vibrator, onset_ms: Mapping[str, float]) -> None:
    """Raise DeviceError unless the open device has a certificate of its settings that keeps a study's bounds, in ms.

    `onset_ms` has bounds by `p50`, `p99` or `max`.
    """
    name = vibrator.name
    advice = f"palpate rig certify {name} --sensor NAME --write"
    certificate: Any = vibrator.settings.certificate
    if certificate is None:
        raise DeviceError(f"{name}: the study bounds its onset, and it was never certified: {advice}")
    if certificate.settings != vibrator.certified_digest():
        raise DeviceError(f"{name}: its settings have changed since it was certified on {certificate.date}: {advice}")
    for key, most_ms in onset_ms.items():
        if (found := getattr(certificate, KEYS[key])) > most_ms:
            raise DeviceError(
                f"{name}: onset {key} is {found:g} ms by its certificate of {certificate.date}; the study allows at "
                f"most {most_ms:g} ms"
            )
