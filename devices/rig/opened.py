"""The devices that a study needs, opened as one and closed as one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

from palpate.devices.device import Device
from palpate.devices.kinds import KINDS
from palpate.devices.rig.file import RigFile


@dataclass
class OpenRig:
    """Open devices by their names in the rig file."""

    file: RigFile
    devices: Mapping[str, Device]
    let_go: Callable[[], None]

    def of(self, need: str) -> dict[str, Device]:
        """The devices that a need takes, by their kinds."""
        return {self.file.kind(name): self.devices[name] for name in self.file.names_for(need)}

    def describe(self) -> dict[str, Any]:
        """What the ledger keeps of each device."""
        return {name: dict(device.describe()) for name, device in self.devices.items()}

    def safe(self) -> None:
        """Bring everything to rest; what fails at that does not keep the others from it."""
        with ExitStack() as stack:
            for device in self.devices.values():
                stack.callback(device.safe)

    def close(self) -> None:
        """Make everything safe and let go of it."""
        try:
            self.safe()
        finally:
            self.let_go()


def open_rig(file: RigFile, names: Sequence[str]) -> OpenRig:
    """Open these devices. Raises DeviceError where one cannot be had; those opened before are closed then."""
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
    """One device, for as long as it is looked at."""
    rig = open_rig(file, [name])
    try:
        yield rig.devices[name]
    finally:
        rig.close()
