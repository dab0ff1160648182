"""The devices that a study needs, opened and closed together, and the health of a single device."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from palpate.devices.device import Device, DeviceError, DeviceFault, Health
from palpate.devices.kinds import KINDS
from palpate.devices.rig.file import RigFile


@dataclass
class OpenRig:
    """The open devices of a rig, by their names in the rig file."""

    file: RigFile
    devices: Mapping[str, Device]
    let_go: Callable[[], None]

    def of(self, need: str) -> dict[str, Device]:
        """Return the open devices of a need, by their kinds."""
        return {self.file.kind(name): self.devices[name] for name in self.file.names_for(need)}

    def describe(self) -> dict[str, Any]:
        """Return each device's description, for the ledger."""
        return {name: dict(device.describe()) for name, device in self.devices.items()}

    def safe(self) -> None:
        """Make all devices safe; a failure of one does not affect the others."""
        with ExitStack() as stack:
            for device in self.devices.values():
                stack.callback(device.safe)

    def close(self) -> None:
        """Make all devices safe and release them."""
        try:
            self.safe()
        finally:
            self.let_go()


def open_rig(file: RigFile, names: Sequence[str]) -> OpenRig:
    """Open these devices. Raises DeviceError if one is not available; those opened before are closed then."""
    kinds = {name: KINDS[file.kind(name)] for name in names}
    devices = {name: kind.make(name, file.devices[name], file.path.parent) for name, kind in kinds.items()}
    if any(kind.shares_card for kind in kinds.values()):
        from palpate.devices.daq.shared import share_cards

        share_cards(devices.values())
    with ExitStack() as opened:
        for device in devices.values():
            opened.callback(device.close)  # Also one that fails half-way: what it holds by then is let go of.
            device.open()
        return OpenRig(file, devices, opened.pop_all().close)


@contextmanager
def opened_device(file: RigFile, name: str) -> Iterator[Device]:
    """Open one device of a rig file on its own, and close it afterwards."""
    rig = open_rig(file, [name])
    try:
        yield rig.devices[name]
    finally:
        rig.close()


def check_device(file: RigFile, name: str, seconds: float) -> Health:
    """Return the device's health after reading it for some seconds; not ok if it cannot be opened, or fails."""
    try:
        with opened_device(file, name) as device:
            return device.health(seconds)
    except (DeviceError, OSError) as error:
        return Health(False, str(error))
    except DeviceFault as fault:
        return Health(False, f"{fault} ({fault.what})")


def describe_health(health: Health) -> Iterator[str]:
    """Yield the readings, a line for each signal and channel; their calibration and its date; further facts."""
    for reading in health.readings:
        signal, lost = reading.signal, f", {reading.lost} lost" if reading.lost else ""
        yield f"{signal.name}: {reading.rate_hz:.1f} Hz measured, {signal.rate_hz:g} Hz nominal{lost}"
        width = max(map(len, signal.channels), default=0)
        for channel, unit, mean, noise in zip(signal.channels, signal.units, reading.mean, reading.noise, strict=True):
            yield f"  {channel:<{width}} {mean:>11.4g} {unit:<6} noise {noise:.3g} {unit}"
        if signal.calibration:
            yield f"  by {signal.calibration}"
    if health.readings or health.calibrated:
        yield f"calibrated {health.calibrated or 'never, according to the rig file'}"
    for name, value in health.facts.items():
        yield f"{name}: {value}"
