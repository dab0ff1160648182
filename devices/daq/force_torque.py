"""The kind `force_torque`: a six-axis force/torque sensor of the ATI Nano17 class on a card's analogue inputs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from palpate.devices.device import DeviceError, Signal
from palpate.devices.kinds import Date, DeviceKind, Finite
from palpate.protocols.registry import lazy_function
from palpate.protocols.strict import Strict

if TYPE_CHECKING:
    from palpate.devices.daq.acquire import Daq, Wiring
    from palpate.devices.daq.cal_file import CalFile
    from palpate.devices.daq.gauges import Gauges, Slopes
    from palpate.devices.daq.sensor import DaqSensor
    from palpate.signals.arrays import Array

SAMPLE = Path(__file__).resolve().parent / "sample.cal"
"""The calibration of a twin if no file is named: of a sensor that does not exist."""
CHANNELS = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
Share = Annotated[float, Field(gt=0, le=1)]
Six = tuple[Finite, Finite, Finite, Finite, Finite, Finite]


class Frame(Strict):
    """The frame of the wrench: its origin is moved along the sensor's axes, which are then turned about x, y and z."""

    dx_mm: Finite = 0.0
    dy_mm: Finite = 0.0
    dz_mm: Finite = 0.0
    rx_deg: Finite = 0.0
    ry_deg: Finite = 0.0
    rz_deg: Finite = 0.0


class Thermistor(Strict):
    """Software temperature compensation: the thermistor's input, and slopes if the .cal file has none."""

    channel: str
    bias_slopes: Six | None = None
    gain_slopes: Six | None = None
    reference_V: Finite = 0.0


class Settings(Strict):
    """The settings in a rig file."""

    kind: Literal["force_torque"]
    driver: Literal["nidaqmx", "twin"]
    channels: str = "Dev1/ai0:5"
    rate_hz: Annotated[float, Field(ge=10, le=200_000)] = 10_000.0
    calibration: str | None = None
    terminals: Literal["default", "diff", "rse", "nrse"] = "diff"
    buffer_s: Annotated[float, Field(ge=0.1, le=60)] = 4.0
    frame: Frame = Frame()
    thermistor: Thermistor | None = None
    zero_s: Annotated[float, Field(ge=0, le=30)] = 0.5
    still: Share = 0.005
    overload: Annotated[float, Field(ge=1, le=5)] = 1.2
    stuck_s: Annotated[float, Field(ge=0, le=10)] = 0.5
    noise_V: Annotated[float, Field(ge=0, le=1)] = 0.002
    seed: int = 1
    calibrated: Date | None = None


MEANINGS: Mapping[str, str] = {
    "channels": "the card's inputs of the six gauges, in the order of the calibration file",
    "rate_hz": "samples per second, Hz",
    "calibration": "the maker's .cal file, in the rig file's folder; needed by `nidaqmx`",
    "terminals": "how the inputs are wired",
    "buffer_s": "how much the card keeps until it is read, s",
    "frame": "point for which the wrench is given; the origin is moved first, then turned about x, y and z",
    "frame.dx_mm": "moved along the sensor's x, mm",
    "frame.dy_mm": "moved along the sensor's y, mm",
    "frame.dz_mm": "moved along the sensor's z, mm",
    "frame.rx_deg": "turned about x, degrees",
    "frame.ry_deg": "turned about y, degrees",
    "frame.rz_deg": "turned about z, degrees",
    "thermistor": "for a sensor whose electronics do not compensate temperature",
    "thermistor.channel": "the card's input of the thermistor",
    "thermistor.bias_slopes": "change of each gauge's offset, V per V of the thermistor, where the .cal file has none",
    "thermistor.gain_slopes": "change of each gauge's gain, per V of the thermistor, where the .cal file has none",
    "thermistor.reference_V": "the thermistor's voltage at calibration, V",
    "zero_s": "how long the unloaded sensor is read for its zero when it is opened, s; 0 takes none",
    "still": "how far a reading may wander meanwhile, as a share of the rated load",
    "overload": "a load beyond this many times the rated one is a fault",
    "stuck_s": "a gauge that does not change by one bit for so long is a fault, s; 0 looks for none",
    "noise_V": "the twin's noise at each input (SD), V",
}


def make(name: str, settings: Settings, folder: Path) -> DaqSensor:
    """Return the device with its calibration read, without opening it.

    Raises:
        DeviceError: the calibration file is missing or cannot be used, or the inputs are not six (plus a thermistor).
    """
    from palpate.devices.daq.acquire import Wiring, demand_channels
    from palpate.devices.daq.cal_file import read_cal_file
    from palpate.devices.daq.gauges import UNITS, Gauges, calibration
    from palpate.devices.daq.sensor import DaqSensor
    from palpate.devices.daq.voltage_check import VoltageCheck

    path = SAMPLE
    if settings.calibration is not None:
        path = folder / settings.calibration
    elif settings.driver != "twin":
        raise DeviceError(f"{name}: `calibration` is missing; name the .cal file that came with the sensor")
    file = read_cal_file(path)
    channels = demand_channels(settings.channels, 6, name, "one for each gauge")
    if settings.thermistor is not None:
        channels += demand_channels(settings.thermistor.channel, 1, name, "the thermistor")
    wiring = Wiring(channels, file.low_V, file.high_V, settings.rate_hz, settings.buffer_s, settings.terminals)
    known = calibration(file, str(path))
    number = f"{file.body} {file.part} {file.serial}, {file.date or 'no date'}, sha256 {file.sha256[:12]}"
    gauges = Gauges(
        name,
        Signal("wrench", CHANNELS, UNITS, settings.rate_hz, "host", number),
        known,
        _framed(settings.frame, known.matrix),
        VoltageCheck(name, wiring.channels, wiring.low_V, wiring.high_V, wiring.rate_hz, settings.stuck_s),
        _slopes(name, settings.thermistor, file, path),
        _description(settings, file, path),
        settings.calibrated or file.date,
        settings.still,
        settings.overload,
    )
    daq = _daq(name, settings, wiring, gauges)
    return DaqSensor(name, settings.kind, settings.driver, daq, gauges, settings.zero_s)


def _framed(frame: Frame, matrix: Array) -> Array:
    from math import radians

    from palpate.devices.daq.gauges import moved

    distance = [part / 1000 for part in (frame.dx_mm, frame.dy_mm, frame.dz_mm)]
    return moved(distance, [radians(part) for part in (frame.rx_deg, frame.ry_deg, frame.rz_deg)]) @ matrix


def _slopes(name: str, thermistor: Thermistor | None, file: CalFile, path: Path) -> Slopes | None:
    """Return the settings' slopes, else the file's. Raises DeviceError for a thermistor without slopes."""
    import numpy as np

    from palpate.devices.daq.gauges import Slopes

    if thermistor is None:
        return None
    if thermistor.bias_slopes or thermistor.gain_slopes:
        none = [0.0] * 6
        bias, gain = thermistor.bias_slopes or none, thermistor.gain_slopes or none
        return Slopes(np.array(bias), np.array(gain), thermistor.reference_V)
    if file.slopes is None:
        raise DeviceError(
            f"{name}: a thermistor is wired, but neither {path} nor the rig file has slopes; leave the thermistor out"
            " where the sensor's electronics compensate (HWTempComp)"
        )
    return Slopes(np.array(file.slopes[0]), np.array(file.slopes[1]), file.slopes[2])


def _description(settings: Settings, file: CalFile, path: Path) -> dict[str, Any]:
    return {
        "calibration": {
            "file": path.name,
            "sha256": file.sha256,
            "serial": file.serial,
            "body": file.body,
            "part": file.part,
            "date": file.date,
        },
        "frame": settings.frame.model_dump(),
    }


def _daq(name: str, settings: Settings, wiring: Wiring, gauges: Gauges) -> Daq:
    if settings.driver == "nidaqmx":
        from palpate.devices.daq.ni import NiDaq

        return NiDaq(name, wiring)
    from palpate.devices.daq.gauges import gauge_volts
    from palpate.devices.daq.twin import TwinDaq

    ideal = gauge_volts(gauges.matrix, gauges.slopes)
    return TwinDaq(name, wiring, ideal, settings.noise_V, (settings.seed,))


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    calibration=(
        "is calibrated by its maker. Put the .cal file that came with it beside the rig file and name it: "
        "`calibration: FT12345.cal`, `calibrated:` with its date. Its zero is taken each time it is opened "
        "(`zero_s`)"
    ),
    shares_card=True,
    unplug=lazy_function("palpate.devices.daq.sensor:unplug"),
)
