"""How one device is: opened, read, closed; what cannot be opened or fails is told, and the others are looked at."""

from __future__ import annotations

from palpate.devices.rig.file import RigFile
from palpate.devices.rig.opened import one_opened
from palpate.devices.signals import DeviceError, DeviceFault, Health


def checked(file: RigFile, name: str, seconds: float) -> Health:
    """The device's health after reading it for so long; not ok where it cannot be had, or failed."""
    try:
        with one_opened(file, name) as device:
            return device.health(seconds)
    except (DeviceError, OSError) as error:
        return Health(False, str(error))
    except DeviceFault as fault:
        return Health(False, f"{fault} ({fault.what})")
