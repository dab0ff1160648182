"""The kind `door` of a rig file: its settings, and the device that it makes."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from palpate.devices.device import DeviceFault
from palpate.devices.door.link import dialogue
from palpate.devices.door.link.connections import by_serial, by_twin
from palpate.devices.door.link.limits import Limits, ProfileRefused
from palpate.devices.door.link.messages import Profile
from palpate.devices.door.link.simulator import DoorSimulator, Setup
from palpate.devices.kinds import Date, DeviceKind
from palpate.protocols.strict import Strict
from palpate.signals.doors.grid import POINTS
from palpate.signals.doors.limits import HANDLE_RADIUS_M


class Settings(Strict):
    """The settings of a car-door simulator in a rig file.

    port: of the driver `serial`, as /dev/ttyUSB0 or COM3. baud: no lower than telemetry at 1000 Hz needs; a slower line
    would go on delivering old heartbeats of a dead host. twin_speed: seconds of the twin's plant per second; below 1, a
    busy machine does not cost it its heartbeat. twin_seed: of its sensors' noise and its hand.
    """

    kind: Literal["door"]
    driver: Literal["serial", "twin"]
    port: str | None = None
    baud: Annotated[int, Field(ge=460_800, le=12_000_000)] = 1_000_000
    handle_radius_m: Annotated[float, Field(ge=0.2, le=2.0)] = HANDLE_RADIUS_M
    limits: Limits = Limits()
    telemetry_hz: Annotated[int, Field(ge=500, le=1000)] = 500
    time_limit_s: Annotated[float, Field(ge=5, le=3600)] = 120.0
    twin_speed: Annotated[float, Field(ge=0.02, le=2.0)] = 1.0
    twin_seed: Annotated[int, Field(ge=0)] = 1
    calibrated: Date | None = None

    @model_validator(mode="after")
    def _a_port_for_serial(self) -> Self:
        if self.driver == "serial" and not self.port:
            raise ValueError("the driver serial needs a port, as /dev/ttyUSB0")
        return self


MEANINGS: Mapping[str, str] = {
    "port": "serial port, as /dev/ttyUSB0 or COM3; needed by `serial`",
    "baud": "symbols per second on the line",
    "handle_radius_m": "from the hinge to the handle, m; a force times it is a torque",
    "limits": "a profile beyond them is refused before it is uploaded; the door's own limits hold as well",
    "limits.torque_Nm": "largest torque of a profile at the hinge, N m",
    "limits.slope_Nm_deg": "steepest step of a profile, N m per degree",
    "limits.speed_deg_s": "the door must itself stop at this speed or a lower one, degrees/s",
    "telemetry_hz": "how often the door sends angle, velocity, torque and brake current, Hz",
    "time_limit_s": "longest time for one opening, s",
    "twin_speed": "seconds of the twin's plant that pass in one second; below 1 where the machine is busy",
    "twin_seed": "seed of the twin's sensor noise and of its hand",
}


def make(name: str, settings: Settings, folder: Path) -> DoorSimulator:  # noqa: ARG001 - it reads no file
    """Return the device without opening it."""
    setup = Setup(
        settings.handle_radius_m, settings.limits, settings.telemetry_hz, settings.time_limit_s, settings.driver,
        settings.calibrated,
    )  # fmt: skip
    if settings.driver == "serial":
        return DoorSimulator(name, setup, partial(by_serial, name, settings.port or "", settings.baud))
    twin = partial(by_twin, name, settings.twin_speed, settings.twin_seed, settings.limits, settings.baud)
    return DoorSimulator(name, setup, twin)


def unplug(door: DoorSimulator) -> None:
    """Close the line under an open door, as if its cable were pulled."""
    link, _ = door.greeted()
    link.lose(OSError("its cable is pulled"))


def exceed(door: DoorSimulator) -> tuple[float, float]:
    """Send a door of twice the limit, past the checks of the driver too; return the greatest torque that it took, and
    the limit, in N m.
    """
    link, _ = door.greeted()
    torque_Nm = 2 * door.setup.limits.torque_Nm
    taken: list[Profile] = []
    with suppress(ProfileRefused):
        taken.append(door.check([torque_Nm / door.setup.handle_radius_m] * POINTS, "a door beyond the limit"))
    beyond = Profile((torque_Nm,) * POINTS, 60.0)
    with suppress(DeviceFault):
        dialogue.upload(link, beyond)
        dialogue.verify(link, beyond)
        taken.append(beyond)
    return max((max(profile.torque_Nm) for profile in taken), default=0.0), door.setup.limits.torque_Nm


KIND = DeviceKind(
    Settings,
    make,
    MEANINGS,
    calibration=(
        "is calibrated in its own controller, which gives N m and radians. Measure from the hinge to the "
        "handle with a rule and write it as `handle_radius_m`"
    ),
    unplug=unplug,
    exceed=exceed,
)
