"""The settings of a voice coil in a rig file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from palpate.devices.kinds import Date
from palpate.protocols.strict import Strict


def demand_voltages(driver: str, peak_V: float, rms_V: float, full_scale_V: float, within: str = "") -> None:
    """Raise ValueError unless an output's limits fit together; `within` is the place of the limits in the settings."""
    if rms_V > peak_V:
        raise ValueError(f"{within}rms_V ({rms_V:g}) must not be above {within}peak_V ({peak_V:g})")
    if driver == "sound" and peak_V > full_scale_V:
        problem = f"{within}peak_V ({peak_V:g}) must not be above full_scale_V ({full_scale_V:g})"
        raise ValueError(f"{problem}, what the sound card gives at full scale")


class Settings(Strict):
    """Settings of a voice coil: its limits `peak_V` and `rms_V` at the output, and `thermal_s`, its time to warm up.

    `calibration` names the file of an identified actuator; without one, samples are volts and not m/s^2.
    """

    kind: Literal["voice_coil"]
    driver: Literal["nidaqmx", "sound", "twin"]
    channel: Annotated[str, Field(pattern=r"^[^\s,:]+/ao\d+$")] = "Dev1/ao0"
    device: str | Annotated[int, Field(ge=0)] | None = None
    card_rate_hz: Annotated[int, Field(ge=8000, le=192_000)] = 48_000
    full_scale_V: Annotated[float, Field(ge=0.01, le=10)] = 1.0
    ahead_ms: Annotated[int, Field(ge=5, le=500)] = 20
    peak_V: Annotated[float, Field(ge=0.01, le=10)] = 1.0
    rms_V: Annotated[float, Field(ge=0.01, le=10)] = 0.5
    thermal_s: Annotated[float, Field(ge=0.1, le=60)] = 1.0
    peak_m_s2: Annotated[float, Field(ge=0.1, le=1000)] = 100.0
    calibration: str | None = None
    calibrated: Date | None = None
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        demand_voltages(self.driver, self.peak_V, self.rms_V, self.full_scale_V)
        return self


MEANINGS: Mapping[str, str] = {
    "channel": "the card's output; of `nidaqmx`",
    "device": "name, part of a name or number of the sound output, none is the machine's default; of `sound`",
    "card_rate_hz": "the sound card's rate, Hz",
    "full_scale_V": "what the sound card's amplifier gives at full scale, V",
    "ahead_ms": "how far ahead samples may be written; it is also the latency of the queue, ms",
    "peak_V": "largest voltage that the coil bears, V",
    "rms_V": "largest RMS voltage that it bears over thermal_s, V",
    "thermal_s": "how long the coil takes to warm up, s",
    "peak_m_s2": "largest acceleration that is played, m/s^2; holds with a calibration",
    "calibration": "file in the rig file's folder, written by identifying the coil; without one samples are volts",
}
