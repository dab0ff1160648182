"""The health of a rig's devices: open each, read it, close it, and describe it in lines of text."""

from __future__ import annotations

from collections.abc import Iterator

from palpate.devices.device import DeviceError, DeviceFault, Health
from palpate.devices.rig.file import RigFile
from palpate.devices.rig.opened import opened_device


def check_device(file: RigFile, name: str, seconds: float) -> Health:
    """Return the device's health after reading it for so long; not ok where it cannot be opened, or fails."""
    try:
        with opened_device(file, name) as device:
            return device.health(seconds)
    except (DeviceError, OSError) as error:
        return Health(False, str(error))
    except DeviceFault as fault:
        return Health(False, f"{fault} ({fault.what})")


def describe_health(health: Health) -> Iterator[str]:
    """Yield the readings, one line a signal and one a channel; their calibration and its date; further facts."""
    for reading in health.readings:
        signal, lost = reading.signal, f", {reading.lost} lost" if reading.lost else ""
        yield f"{signal.name}: {reading.rate_hz:.1f} Hz measured, {signal.rate_hz:g} Hz nominal{lost}"
        width = max(map(len, signal.channels), default=0)
        for channel, unit, mean, noise in zip(signal.channels, signal.units, reading.mean, reading.noise, strict=True):
            yield f"  {channel:<{width}} {mean:>11.4g} {unit:<6} noise {noise:.3g} {unit}"
        if signal.calibration:
            yield f"  by {signal.calibration}"
    if health.readings or health.calibrated:
        yield f"calibrated {health.calibrated or 'never, as far as the rig file says'}"
    for name, value in health.facts.items():
        yield f"{name}: {value}"
