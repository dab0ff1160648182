"""Fault drills on the simulated door machine in full motion: how soon it is safe, in plant time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from palpate.devices.door.firmware.ailments import AILMENTS, Ailing
from palpate.devices.door.firmware.controller import BOOT_MS, Firmware
from palpate.devices.door.firmware.twin_plant import TwinPlant
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.codes import DoorFault

MOVING_MS = 1600
"""Milliseconds of play after which the twin's hand moves the arm at some tens of degrees a second."""
WATCHED_MS = 400


@dataclass(frozen=True)
class Drilled:
    """Milliseconds of plant time from the cause until the door is off, the motor has no torque, the door brakes."""

    fault: DoorFault
    off_ms: int
    without_motor_ms: int
    braked_ms: int


def _sick(plant: Ailing, _firmware: Firmware) -> None:
    plant.from_ms = plant.t_ms + 1


def _nothing(_plant: Ailing, _firmware: Firmware) -> None:
    pass


def _press(_plant: Ailing, firmware: Firmware) -> None:
    firmware.press(True)


DRILLS: Mapping[str, Callable[[Ailing, Firmware], None]] = {
    **dict.fromkeys(AILMENTS, _sick),
    "heartbeat lost": _nothing,
    "emergency button": _press,
}


def run_drill(name: str, seed: int = 1) -> Drilled:
    """Play a profile and cause the fault of that name; the host's heartbeat ends only in `heartbeat lost`."""
    twin = TwinPlant(seed)
    plant = Ailing(twin, name if name in AILMENTS else next(iter(AILMENTS)))
    firmware = Firmware(plant)
    _brought_to_play(firmware)
    drives, current_A = twin.machine.dynamics.drives, twin.machine.parameters.brake.current_limit_A
    gave_Nm = abs(drives.motor_Nm)
    DRILLS[name](plant, firmware)
    seen: dict[str, int] = {}
    for ms in range(1, WATCHED_MS + 1):
        _ms(firmware, beats=name != "heartbeat lost")
        so_far = {
            "off": plant.mode == "off",
            "motor": plant.mode == "off" and abs(drives.motor_Nm) < 0.01 * gave_Nm,
            "brake": plant.mode == "off" and drives.coil_A >= 0.9 * current_A,
        }
        seen.update({key: ms for key, is_so in so_far.items() if is_so and key not in seen})
    return Drilled(firmware.fault, *(seen.get(key, WATCHED_MS) for key in ("off", "motor", "brake")))


def _brought_to_play(firmware: Firmware) -> None:
    torque = tuple(10 * math.sin(math.pi * index / 620) for index in range(621))
    profile = says.Profile(torque, 62.0)
    chunks = [says.UploadChunk(first, profile.torque_Nm[first : first + 128]) for first in range(0, 621, 128)]
    begin, end = says.UploadBegin(621, profile.end_deg, profile.crc), says.UploadEnd(profile.crc)
    for _ in range(BOOT_MS):
        _ms(firmware)
    for sequence, message in enumerate((begin, *chunks, end, says.Arm(profile.crc), says.Play()), 1):
        firmware.receive(says.sent(message, sequence))
    for _ in range(MOVING_MS):
        _ms(firmware)


def _ms(firmware: Firmware, beats: bool = True) -> None:
    if beats:
        firmware.receive(says.sent(says.Heartbeat(), 0))
    firmware.tick()
