"""How one device is: opened, read, closed, and its health in lines of text.

What cannot be opened or fails is told, and the others are looked at.
"""

from __future__ import annotations

from collections.abc import Iterator

from palpate.devices.device import DeviceError, DeviceFault, Health, Reading
from palpate.devices.rig.file import RigFile
from palpate.devices.rig.opened import one_opened


def checked(file: RigFile, name: str, seconds: float) -> Health:
    """The device's health after reading it for so long; not ok where it cannot be had, or failed."""
    try:
        with one_opened(file, name) as device:
            return device.health(seconds)
    except (DeviceError, OSError) as error:
        return Health(False, str(error))
    except DeviceFault as fault:
        return Health(False, f"{fault} ({fault.what})")


def told(health: Health) -> Iterator[str]:
    """The readings, one line a signal and one a channel; what made units of them and when; further facts."""
    for reading in health.readings:
        yield _rate(reading)
        yield from _channels(reading)
        if reading.signal.calibration:
            yield f"  by {reading.signal.calibration}"
    if health.readings or health.calibrated:
        yield f"calibrated {health.calibrated or 'never, as far as the rig file says'}"
    for name, value in health.facts.items():
        yield f"{name}: {value}"


def _rate(reading: Reading) -> str:
    lost = f", {reading.lost} lost" if reading.lost else ""
    return f"{reading.signal.name}: {reading.rate_hz:.1f} Hz measured, {reading.signal.rate_hz:g} Hz nominal{lost}"


def _channels(reading: Reading) -> Iterator[str]:
    signal = reading.signal
    width = max(map(len, signal.channels), default=0)
    for channel, unit, mean, noise in zip(signal.channels, signal.units, reading.mean, reading.noise, strict=True):
        yield f"  {channel:<{width}} {mean:>11.4g} {unit:<6} noise {noise:.3g} {unit}"
