"""Named numbers of the door's protocol: states, faults, reasons; see docs/reference/door-protocol.md."""

from __future__ import annotations

from enum import IntEnum

VERSION = 1
FOLLOWS_FROM = 2
"""The first firmware that supports Change, for a door that can be changed while it is felt."""
MAGIC = b"PDOR"
"""The beginning of a door simulator's identity; anything else on the line is another device."""
RATES_HZ = (1, 1000)
CHUNK_POINTS = 128
HEARTBEAT_MS = 40
SAFE_WITHIN_MS = 50
"""Time from the cause of a fault until the motor is off and the brake is on, in plant time."""


class State(IntEnum):
    """The device's state. The motor is on only in `armed` and `playing`."""

    boot = 0
    safe = 1
    armed = 2
    playing = 3


class DoorFault(IntEnum):
    """The reason why the device went safe by itself; latched until CLEAR names it."""

    none = 0
    heartbeat_lost = 1
    sensor_silent = 2
    encoder_stuck = 3
    not_a_number = 4
    over_range = 5
    over_speed = 6
    emergency_stop = 7
    profile_damaged = 8


class Reason(IntEnum):
    """The reason why a request was refused."""

    wrong_state = 1
    faulted = 2
    bad_value = 3
    over_limit = 4
    incomplete = 5
    wrong_crc = 6
    moving = 7
    cause_remains = 8
    unknown_type = 9
    wrong_version = 10


def state_name(code: int) -> str:
    """Return the state's name, also for a code that this version does not know."""
    return State(code).name if code in set(State) else f"state {code}"


def fault_name(code: int) -> str:
    """Return the fault's name, also for a code that this version does not know."""
    return DoorFault(code).name if code in set(DoorFault) else f"fault {code}"


def reason_name(code: int) -> str:
    """Return the reason's name, also for a code that this version does not know."""
    return Reason(code).name if code in set(Reason) else f"reason {code}"
