"""Messages between the host and the door simulator: a frozen dataclass for each, packed by struct."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from struct import Struct, error, iter_unpack
from struct import pack as pack_values
from typing import ClassVar, Self
from zlib import crc32

from palpate.devices.door.link.codes import MAGIC, VERSION
from palpate.devices.door.link.frames import Frame, on_the_line


@dataclass(frozen=True, slots=True)
class Message:
    """A message of fixed length, whose fields LAYOUT packs in order."""

    KIND: ClassVar[int] = 0
    LAYOUT: ClassVar[Struct] = Struct("<")

    def pack(self) -> bytes:
        """Return the payload of its frame."""
        return self.LAYOUT.pack(*[getattr(self, field.name) for field in fields(self)])

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Return the message of this payload. Raises struct.error for another length."""
        return cls(*cls.LAYOUT.unpack(payload))


@dataclass(frozen=True, slots=True)
class Points(Message):
    """Points of a profile in N m, beginning with number `first`."""

    first: int
    torque_Nm: tuple[float, ...]
    LAYOUT: ClassVar[Struct] = Struct("<H")

    def pack(self) -> bytes:
        """Return the payload of its frame."""
        return self.LAYOUT.pack(self.first) + pack_values(f"<{len(self.torque_Nm)}f", *self.torque_Nm)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Return the message of this payload. Raises struct.error if the length does not fit."""
        (first,) = cls.LAYOUT.unpack_from(payload)
        return cls(first, tuple(value for (value,) in iter_unpack("<f", payload[cls.LAYOUT.size :])))


@dataclass(frozen=True, slots=True)
class Hello(Message):
    """A request for the identity, which also makes the device forget earlier messages; answered in every state."""

    version: int = VERSION
    KIND: ClassVar[int] = 0x01
    LAYOUT: ClassVar[Struct] = Struct("<H")


@dataclass(frozen=True, slots=True)
class UploadBegin(Message):
    """The announcement of a profile with so many points and a rendered stop at end_deg. Its CRC is `profile_crc`'s."""

    points: int
    end_deg: float
    crc: int
    KIND: ClassVar[int] = 0x02
    LAYOUT: ClassVar[Struct] = Struct("<HfI")


@dataclass(frozen=True, slots=True)
class UploadChunk(Points):
    """Points of the profile that is being uploaded."""

    KIND: ClassVar[int] = 0x03


@dataclass(frozen=True, slots=True)
class UploadEnd(Message):
    """The end of an upload, after which the device checks the profile."""

    crc: int
    KIND: ClassVar[int] = 0x04
    LAYOUT: ClassVar[Struct] = Struct("<I")


@dataclass(frozen=True, slots=True)
class ReadBack(Message):
    """A request for these points of the stored profile. Answered by Part."""

    first: int
    count: int
    KIND: ClassVar[int] = 0x05
    LAYOUT: ClassVar[Struct] = Struct("<HH")


@dataclass(frozen=True, slots=True)
class Arm(Message):
    """A request to switch the motor on and hold the arm in place. It names the profile to be played."""

    crc: int
    KIND: ClassVar[int] = 0x06
    LAYOUT: ClassVar[Struct] = Struct("<I")


@dataclass(frozen=True, slots=True)
class Play(Message):
    """A request to render the profile."""

    KIND: ClassVar[int] = 0x07


@dataclass(frozen=True, slots=True)
class Stop(Message):
    """A request for motor off, brake on."""

    KIND: ClassVar[int] = 0x08


@dataclass(frozen=True, slots=True)
class EStop(Message):
    """A request for motor off, brake on, until the fault is cleared."""

    KIND: ClassVar[int] = 0x09


@dataclass(frozen=True, slots=True)
class Clear(Message):
    """A request to clear the fault of this code; another fault stays."""

    fault: int
    KIND: ClassVar[int] = 0x0A
    LAYOUT: ClassVar[Struct] = Struct("<B")


@dataclass(frozen=True, slots=True)
class Heartbeat(Message):
    """The sign that the host is alive. Not answered."""

    KIND: ClassVar[int] = 0x0B


@dataclass(frozen=True, slots=True)
class SetRate(Message):
    """A request for telemetry at this rate per second of plant time, 1 to 1000."""

    rate_hz: int
    KIND: ClassVar[int] = 0x0C
    LAYOUT: ClassVar[Struct] = Struct("<H")


@dataclass(frozen=True, slots=True)
class Change(Message):
    """A request to change to the profile of this CRC, uploaded while playing, with the stop of the old one."""

    crc: int
    KIND: ClassVar[int] = 0x0D
    LAYOUT: ClassVar[Struct] = Struct("<I")


@dataclass(frozen=True, slots=True)
class Ack(Message):
    """The answer that the request of this sequence, of type `to`, was done; the device is in `state` now."""

    to: int
    state: int
    KIND: ClassVar[int] = 0x80
    LAYOUT: ClassVar[Struct] = Struct("<BB")


@dataclass(frozen=True, slots=True)
class Nak(Message):
    """The answer that the request of this sequence, of type `to`, was refused; nothing has changed."""

    to: int
    reason: int
    state: int
    fault: int
    KIND: ClassVar[int] = 0x81
    LAYOUT: ClassVar[Struct] = Struct("<BBBB")


@dataclass(frozen=True, slots=True)
class Identity(Message):
    """The device's identity, abilities and state. `profile_crc` is 0 if it holds no profile."""

    magic: bytes
    version: int
    firmware: int
    serial_number: int
    points: int
    torque_Nm: float
    slope_Nm_deg: float
    speed_deg_s: float
    heartbeat_ms: int
    state: int
    fault: int
    profile_crc: int
    KIND: ClassVar[int] = 0x82
    LAYOUT: ClassVar[Struct] = Struct("<4sHHIHfffHBBI")

    @property
    def known(self) -> bool:
        """Return whether the device is a door simulator."""
        return self.magic == MAGIC


@dataclass(frozen=True, slots=True)
class Part(Points):
    """Points of the profile that the device holds."""

    KIND: ClassVar[int] = 0x83


@dataclass(frozen=True, slots=True)
class Telemetry(Message):
    """The door's state: device time, the number of this sample, sensors, state, latched fault. Not answered."""

    t_us: int
    sample: int
    angle_deg: float
    velocity_deg_s: float
    torque_Nm: float
    brake_A: float
    state: int
    fault: int
    KIND: ClassVar[int] = 0x90
    LAYOUT: ClassVar[Struct] = Struct("<QIffffBB")


@dataclass(frozen=True, slots=True)
class FaultReport(Message):
    """The report that the device went safe by itself, at this time of its clock, because of this value. Sent once."""

    t_us: int
    fault: int
    value: float
    KIND: ClassVar[int] = 0x91
    LAYOUT: ClassVar[Struct] = Struct("<QBf")


MESSAGES: tuple[type[Message], ...] = (
    Hello, UploadBegin, UploadChunk, UploadEnd, ReadBack, Arm, Play, Stop, EStop, Clear, Heartbeat, SetRate, Change,
    Ack, Nak, Identity, Part, Telemetry, FaultReport,
)  # fmt: skip
_BY_KIND = {message.KIND: message for message in MESSAGES}


def understood(frame: Frame) -> Message | None:
    """Return the message of a frame; None for a type or a length that this version does not know."""
    kind = _BY_KIND.get(frame.kind)
    if kind is None:
        return None
    try:
        return kind.unpack(frame.payload)
    except error:
        return None


def sent(message: Message, sequence: int) -> bytes:
    """Return the message as it is sent on the line."""
    return on_the_line(Frame(message.KIND, sequence, message.pack()))


@dataclass(frozen=True)
class Profile:
    """An uploaded profile: torques in N m, as the device holds them (float32), and the position of its rendered
    stop.
    """

    torque_Nm: tuple[float, ...]
    end_deg: float
    crc: int = field(init=False)

    def __post_init__(self) -> None:
        *torque, end = as_float32((*self.torque_Nm, self.end_deg))
        object.__setattr__(self, "torque_Nm", tuple(torque))
        object.__setattr__(self, "end_deg", end)
        object.__setattr__(self, "crc", profile_crc(torque, end))


def as_float32(values: tuple[float, ...]) -> tuple[float, ...]:
    """Return the values as they are sent, rounded to float32."""
    layout = Struct(f"<{len(values)}f")
    rounded: tuple[float, ...] = layout.unpack(layout.pack(*values))
    return rounded


def profile_crc(torque_Nm: tuple[float, ...] | list[float], end_deg: float) -> int:
    """Return the CRC-32 of end_deg and the torques, each a little-endian float32."""
    return crc32(pack_values(f"<{len(torque_Nm) + 1}f", end_deg, *torque_Nm))
