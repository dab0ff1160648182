"""The kind `accelerometer`: an ADXL335 on three analogue inputs of a card."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from palpate.devices.device import Signal
from palpate.devices.kinds import CalibrationMethod, Date, DeviceKind, Finite, Positive
from palpate.protocols.registry import lazy_function
from palpate.protocols.strict import Strict

if TYPE_CHECKING:
    from palpate.devices.daq.acquire import Daq, Wiring
    from palpate.devices.daq.adxl335 import Scaling
    from palpate.devices.daq.sensor import DaqSensor

Three = tuple[Positive, Positive, Positive]


class Settings(Strict):
    """The settings in a rig file. The defaults are the data sheet's typical values at a supply of 3 V."""

    kind: Literal["accelerometer"]
    driver: Literal["nidaqmx", "twin"]
    channels: str = "Dev1/ai0:2"
    rate_hz: Annotated[float, Field(ge=10, le=200_000)] = 3000.0
    range_V: tuple[Finite, Finite] = (-5.0, 5.0)
    terminals: Literal["default", "diff", "rse", "nrse"] = "rse"
    buffer_s: Annotated[float, Field(ge=0.1, le=60)] = 4.0
    sensitivity_V_per_g: Three = (0.3, 0.3, 0.3)
    zero_g_V: Three = (1.5, 1.5, 1.5)
    scaled_at_V: Annotated[float, Field(ge=1.8, le=3.6)] = 3.0
    supply_V: Annotated[float, Field(ge=1.8, le=3.6)] = 3.0
    full_scale_g: Annotated[float, Field(gt=0, le=10)] = 3.0
    clipped_s: Annotated[float, Field(gt=0, le=10)] = 0.1
    stuck_s: Annotated[float, Field(ge=0, le=10)] = 0.5
    bandwidth_hz: Three = (1600.0, 1600.0, 550.0)
    noise_V: Annotated[float, Field(ge=0, le=1)] = 0.0023
    seed: int = 1
    calibrated: Date | None = None

    @model_validator(mode="after")
    def _ranges(self) -> Self:
        low, high = self.range_V
        if not -10 <= low < high <= 10:
            raise ValueError(f"range_V {self.range_V}: low before high, within -10 and 10, is expected")
        if high < self.supply_V:
            raise ValueError(f"range_V ends at {high:g} V, below supply_V {self.supply_V:g}; the rest is cut off")
        if not all(1.0 <= band_hz <= 100_000 for band_hz in self.bandwidth_hz):
            raise ValueError(f"bandwidth_hz {self.bandwidth_hz}: 1 to 100000 Hz are expected")
        return self


MEANINGS: Mapping[str, str] = {
    "channels": "the card's inputs of x, y and z",
    "rate_hz": "samples per second, Hz",
    "range_V": "the card's input range, lowest and highest, V",
    "terminals": "how the inputs are wired",
    "buffer_s": "how much the card keeps until it is read, s",
    "sensitivity_V_per_g": "of x, y and z at the supply of scaled_at_V, V per g",
    "zero_g_V": "output of x, y and z at 0 g at that supply, V",
    "scaled_at_V": "the supply at which these two hold, V",
    "supply_V": "the sensor's supply now, V; both are scaled by it",
    "full_scale_g": "beyond this a sample counts as clipped, g",
    "clipped_s": "clipped for so long without a break is a fault, s",
    "stuck_s": "an axis that does not change by one bit for so long is a fault, s; 0 looks for none",
    "bandwidth_hz": "the twin's bandwidth of x, y and z, Hz",
    "noise_V": "the twin's noise at each input (SD), V",
}


def make(name: str, settings: Settings, folder: Path) -> DaqSensor:  # noqa: ARG001 - every kind is made alike
    """Return the device without opening it. Raises DeviceError unless it has exactly three inputs."""
    import numpy as np

    from palpate.devices.daq.acquire import Wiring, demand_channels
    from palpate.devices.daq.adxl335 import Accelerometer, Scaling
    from palpate.devices.daq.sensor import DaqSensor
    from palpate.devices.daq.voltage_check import VoltageCheck

    low, high = settings.range_V
    channels = demand_channels(settings.channels, 3, name, "one for each axis")
    wiring = Wiring(channels, low, high, settings.rate_hz, settings.buffer_s, settings.terminals)
    rated = Scaling(np.array(settings.sensitivity_V_per_g), np.array(settings.zero_g_V), settings.scaled_at_V)
    scaling = rated.at(settings.supply_V)
    watch = VoltageCheck(name, wiring.channels, 0.0, settings.supply_V, settings.rate_hz, settings.stuck_s)
    transducer = Accelerometer(
        name, _signal(settings), scaling, watch, settings.full_scale_g, settings.clipped_s, settings.calibrated
    )
    return DaqSensor(name, settings.kind, settings.driver, _daq(name, settings, wiring, scaling), transducer)


def _signal(settings: Settings) -> Signal:
    given = {"sensitivity_V_per_g", "zero_g_V"} & settings.model_fields_set
    how = "six positions" if given else "typical values of the data sheet"
    number = f"ADXL335, {how}, {settings.calibrated or 'no date'}"
    return Signal("acceleration", ("ax", "ay", "az"), ("m/s^2",) * 3, settings.rate_hz, "host", number)


def _daq(name: str, settings: Settings, wiring: Wiring, scaling: Scaling) -> Daq:
    if settings.driver == "nidaqmx":
        from palpate.devices.daq.ni import NiDaq

        return NiDaq(name, wiring)
    from palpate.devices.daq.adxl335 import acceleration_volts
    from palpate.devices.daq.twin import TwinDaq

    ideal = acceleration_volts(scaling, settings.bandwidth_hz)
    return TwinDaq(name, wiring, ideal, settings.noise_V, (settings.seed,))


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    calibration=CalibrationMethod(
        "palpate.devices.rig.vibration_calibration:calibrate_accelerometer",
        ("seconds", "yes"),
        by_hand=True,
    ),
    shares_card=True,
    unplug=lazy_function("palpate.devices.daq.sensor:unplug"),
)
