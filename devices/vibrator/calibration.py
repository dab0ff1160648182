"""The file of a calibrated vibrator: gain and phase by frequency, and the levels that it covers."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from palpate.devices.actuator.calibration import read_calibration
from palpate.devices.kinds import Date, Finite, Positive
from palpate.protocols.canonical import digest
from palpate.protocols.strict import Strict
from palpate.signals.arrays import Array, Complex

Numbers = Annotated[list[Finite], Field(min_length=2, max_length=100_000)]
TAIL_S = 0.05
"""How long the inverse filter goes on behind the samples, to stop what moves; its second half fades out."""
STEPS = 10
"""The weakest vibration that is covered peaks at this many steps of the output's converter."""


class VibratorCalibration(Strict):
    """Response at `hz` in m/s^2 per volt (real and imaginary) without its delay, measured at peaks up to `most_V`.

    Below that the actuator counts as linear, down to `least_V`; `linear_dB` is how far the gain at `most_V` lies from
    that at a tenth of it, at most over the band. `delay_ms` is the time from the output to the movement.
    """

    kind: Literal["vibrator_response"] = "vibrator_response"
    format: Literal[1] = 1
    date: Date
    sensor: str
    excitation: str
    band_Hz: tuple[Positive, Positive]
    least_V: Positive
    most_V: Positive
    linear_dB: Finite
    delay_ms: Finite
    hz: Numbers
    real: Numbers
    imaginary: Numbers
    coherence: Numbers

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        lengths = {len(column) for column in (self.hz, self.real, self.imaginary, self.coherence)}
        if len(lengths) > 1:
            raise ValueError(f"one value per line is expected, found {sorted(lengths)} values")
        if not (np.diff(self.hz) > 0).all() or not self.hz[0] <= self.band_Hz[0] < self.band_Hz[1] <= self.hz[-1]:
            raise ValueError("rising frequencies that include the band are expected")
        if not (np.abs(self.response) > 0).all():
            raise ValueError("a response above 0 at every frequency is expected")
        return self

    @property
    def response(self) -> Complex:
        """Return the complex response at `hz`."""
        return np.asarray(np.array(self.real) + 1j * np.array(self.imaginary), np.complex128)

    @property
    def summary(self) -> str:
        """Return one line for records and people; its digest is that of the whole file."""
        low, high = self.band_Hz
        found = f"{low:g} to {high:g} Hz, up to {self.most_V:g} V, by {self.sensor}"
        return f"calibrated {self.date}, {found}, sha256 {digest(self.model_dump(mode='json'))[:12]}"

    def gain(self, hz: Array) -> Array:
        """Return the size of the response in m/s^2 per volt, along straight lines of log over log frequency.

        Beyond the band it goes on as over the outermost octave, two octaves down and one up, and is then constant.
        """
        low, high = self.band_Hz
        log_hz, log_size = np.log(self.hz), np.log(np.abs(self.response))

        def inside(at: Array | float) -> Array:
            return np.asarray(np.interp(np.log(at), log_hz, log_size), np.float64)

        falls = np.clip((inside(2 * low) - inside(low)) / math.log(2), 0.0, 2.0)
        rises = np.clip((inside(high) - inside(high / 2)) / math.log(2), -2.0, 0.0)
        size = inside(np.clip(hz, low, high))
        size += falls * np.log(np.clip(hz, low / 4, low) / low) + rises * np.log(np.clip(hz, high, 2 * high) / high)
        return np.asarray(np.exp(size), np.float64)


def load(path: Path) -> VibratorCalibration:
    """Read a calibration. Raises DeviceError that names the file and what is wrong with it."""
    return read_calibration(path, VibratorCalibration, "vibrator", "Calibrate the vibrator again")


@dataclass
class Inverse:
    """Converts accelerations to the voltages that make them, whole vibrations at a time.

    The gain is the inverse of the calibrated one, the phase the least that goes with it (folded cepstrum, Oppenheim and
    Schafer, 13.5): it follows from the gain in any mechanical resonance, and nothing sounds before the onset.
    """

    calibration: VibratorCalibration
    rate_hz: float
    _filters: dict[int, Complex] = field(default_factory=dict)

    def volts(self, acceleration: Array) -> Array:
        """Return the voltages, as long as the acceleration and 50 ms."""
        count = len(acceleration) + round(TAIL_S * self.rate_hz)
        size = max(2 ** math.ceil(math.log2(1.5 * count)), 2**16)
        whole = np.fft.irfft(np.fft.rfft(acceleration, size) * self._filter(size), size)[:count]
        fade = round(TAIL_S * self.rate_hz / 2)
        whole[-fade:] *= 0.5 + 0.5 * np.cos(np.pi * np.arange(1, fade + 1) / fade)
        return np.asarray(whole, np.float64)

    def _filter(self, size: int) -> Complex:
        if size not in self._filters:
            hz = np.arange(size // 2 + 1) * self.rate_hz / size
            cepstrum = np.fft.irfft(-np.log(self.calibration.gain(hz)), size)
            cepstrum[1 : size // 2] *= 2
            cepstrum[size // 2 + 1 :] = 0
            self._filters[size] = np.asarray(np.exp(np.fft.rfft(cepstrum)), np.complex128)
        return self._filters[size]


def least_volts(full_scale_V: float, bits: int) -> float:
    """Return the smallest covered peak of a converter of plus and minus `full_scale_V`."""
    return STEPS * 2 * full_scale_V / float(2**bits)
