"""The settings of a vibrator in a rig file: its output, its limits, its calibration and its certificate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from palpate.devices.actuator.settings import demand_voltages
from palpate.devices.kinds import Date, Finite
from palpate.protocols.canonical import digest
from palpate.protocols.strict import Strict


class Limits(Strict):
    """What the driver never exceeds, whatever study, procedure or caller wants.

    While it is calibrated or certified, which is done without a person, only the voltages are limited.
    `hand_arm_m_s2` and `a8_m_s2` are frequency-weighted for the hand (ISO 5349-1). The daily limit of 2.5 m/s^2 over 8
    hours is the action value of directive 2002/44/EC; the peaks are ours.
    """

    peak_V: Annotated[float, Field(gt=0, le=10)] = 1.0
    rms_V: Annotated[float, Field(gt=0, le=10)] = 0.5
    thermal_s: Annotated[float, Field(ge=0.1, le=60)] = 1.0
    peak_m_s2: Annotated[float, Field(gt=0, le=2000)] = 300.0
    peak_um: Annotated[float, Field(gt=0, le=5000)] = 1000.0
    longest_s: Annotated[float, Field(gt=0, le=60)] = 20.0
    hand_arm_m_s2: Annotated[float, Field(gt=0, le=100)] = 20.0
    window_s: Annotated[float, Field(ge=1, le=3600)] = 60.0
    a8_m_s2: Annotated[float, Field(gt=0, le=5)] = 2.5


class Certificate(Strict):
    """What `palpate rig certify` measured: from command to onset, in ms, and the error of the level, in dB.

    `late_ms` is from the onset that replies report to the measured one. `settings` is the digest of the settings and
    the calibration that it holds for.
    """

    date: Date
    sensor: str
    bursts: Annotated[int, Field(ge=1)]
    p50_ms: Finite
    p99_ms: Finite
    most_ms: Finite
    late_ms: Finite
    level_dB: Finite
    settings: str


class Settings(Strict):
    """The settings of a vibrator. `calibration` names its file; a twin without one knows its own response."""

    kind: Literal["vibrator"]
    driver: Literal["nidaqmx", "sound", "twin"]
    channel: Annotated[str, Field(pattern=r"^[^\s,:]+/ao\d+$")] = "Dev1/ao0"
    device: str | Annotated[int, Field(ge=0)] | None = None
    rate_hz: Annotated[int, Field(ge=8000, le=192_000)] = 48_000
    bits: Annotated[int, Field(ge=8, le=32)] = 16
    full_scale_V: Annotated[float, Field(ge=0.01, le=10)] = 1.0
    ahead_ms: Annotated[int, Field(ge=5, le=50)] = 20
    feed_s: Annotated[float, Field(ge=0.1, le=2)] = 0.5
    limits: Limits = Limits()
    calibration: str | None = None
    certificate: Certificate | None = None
    calibrated: Date | None = None
    delay_ms: Annotated[float, Field(ge=0, le=100)] = 5.0
    jitter_ms: Annotated[float, Field(ge=0, le=20)] = 0.0
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        demand_voltages(self.driver, self.limits.peak_V, self.limits.rms_V, self.full_scale_V, "limits.")
        return self

    def certified_digest(self, response: str) -> str:
        """Return the digest of what a certificate depends on: all settings but itself and dates, and the response."""
        settings = self.model_dump(mode="json", exclude={"certificate", "calibrated"})
        return digest({**settings, "response": response})[:16]


MEANINGS: Mapping[str, str] = {
    "channel": "the card's output; of `nidaqmx`",
    "device": "name, part of a name or number of the sound output, none is the machine's default; of `sound`",
    "rate_hz": "samples per second of the output, Hz; waveforms are made at this rate",
    "bits": "of the output's converter; a vibration that peaks below 10 of its steps is refused",
    "full_scale_V": "what the sound card's amplifier gives at full scale, V",
    "ahead_ms": "how far ahead a DAQ card is filled, ms; of `nidaqmx`",
    "feed_s": "the output ramps to silence by itself if the session has not been heard of for so long, s",
    "limits": "what the driver never exceeds; independent of the study",
    "limits.peak_V": "largest voltage, V",
    "limits.rms_V": "largest RMS voltage over thermal_s, V",
    "limits.thermal_s": "how long the actuator takes to warm up, s",
    "limits.peak_m_s2": "largest acceleration, m/s^2",
    "limits.peak_um": "largest displacement, um",
    "limits.longest_s": "longest vibration, s",
    "limits.hand_arm_m_s2": "largest frequency-weighted RMS over window_s (ISO 5349-1), m/s^2",
    "limits.window_s": "window of hand_arm_m_s2, s",
    "limits.a8_m_s2": "largest daily exposure A(8) of a participant (2002/44/EC), m/s^2",
    "calibration": "file in the rig file's folder, written by `palpate rig calibrate`; levels in dB need it",
    "certificate": "written by `palpate rig certify`",
    "certificate.date": "when it was measured",
    "certificate.sensor": "the accelerometer that measured it",
    "certificate.bursts": "how many bursts were measured",
    "certificate.p50_ms": "median time from command to onset, ms",
    "certificate.p99_ms": "99th percentile of it, ms",
    "certificate.most_ms": "longest, ms",
    "certificate.late_ms": "median time from the onset in the replies (`onset_ns`) to the measured one, ms",
    "certificate.level_dB": "level measured above the level commanded, median, dB",
    "certificate.settings": "digest of the settings and the calibration that it holds for",
    "delay_ms": "how late the twin moves, ms",
    "jitter_ms": "by how much that varies (SD), ms",
}
