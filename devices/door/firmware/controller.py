"""The firmware of the car-door simulator as a pure state machine: bytes and milliseconds in, bytes out.

Nothing moves before ARM and PLAY; every failure ends in `safe` with the fault latched. A profile is uploaded in parts,
and is accepted only when it is complete, undamaged and within the limits. docs/reference/door-protocol.md has a table
of the states.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

from palpate.devices.door.firmware.sensor_check import Found, Limits, SensorCheck
from palpate.devices.door.firmware.twin_plant import Plant
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.codes import (
    CHUNK_POINTS,
    FOLLOWS_FROM,
    HEARTBEAT_MS,
    MAGIC,
    RATES_HZ,
    VERSION,
    DoorFault,
    Reason,
    State,
)
from palpate.devices.door.link.frames import Frame, Parser
from palpate.devices.door.link.messages import Part, Profile, ReadBack, UploadBegin, UploadChunk, UploadEnd, profile_crc
from palpate.devices.door.plant.machine import Tick
from palpate.signals.doors.grid import MAX_ANGLE_DEG, POINTS, POINTS_PER_DEG

FIRMWARE = FOLLOWS_FROM
BOOT_MS = 20
TICKS_PER_S = 1000
REMEMBERED = 32
"""Number of answers that are stored for requests that come twice because the answer was lost."""
FLOAT32_MOST = 3.4e38
ANYWHERE = frozenset(State)
BOOTED = ANYWHERE - {State.boot}
ONLY_SAFE = frozenset({State.safe})
ONLY_PLAYING = frozenset({State.playing})
UPLOADING = ONLY_SAFE | ONLY_PLAYING
ALLOWED: Mapping[type[says.Message], frozenset[State]] = {
    says.Hello: ANYWHERE, says.Heartbeat: ANYWHERE, says.Stop: ANYWHERE, says.EStop: ANYWHERE,
    says.SetRate: BOOTED, says.ReadBack: BOOTED,
    says.UploadBegin: UPLOADING, says.UploadChunk: UPLOADING, says.UploadEnd: UPLOADING,
    says.Clear: ONLY_SAFE, says.Arm: ONLY_SAFE, says.Play: frozenset({State.armed}), says.Change: ONLY_PLAYING,
}  # fmt: skip
"""The states in which each request is allowed; in others it is refused as wrong_state."""
BEFORE_CHANGE: Mapping[type[says.Message], frozenset[State]] = {
    kind: ONLY_SAFE if states is UPLOADING else states for kind, states in ALLOWED.items() if kind is not says.Change
}
"""The same for firmware 1."""
ALWAYS_DONE = (says.Hello, says.Heartbeat, says.Stop, says.EStop)
"""Requests that are performed however often they come; all others are done once, and a copy gets the same answer."""
Answer = says.Identity | says.Part | Reason | Literal[True]
"""What was requested, why it is refused, or True for a request that is done."""


class Firmware:
    """A device. `receive` takes bytes from the line; `tick` advances by 1 ms and returns the bytes to send."""

    def __init__(
        self, plant: Plant, limits: Limits | None = None, serial_number: int = 1, version: int = FIRMWARE
    ) -> None:
        self.plant, self.version = plant, version
        self._allowed = ALLOWED if version >= FOLLOWS_FROM else BEFORE_CHANGE
        self.limits = limits or Limits()
        self.serial_number = serial_number
        self.state, self.fault, self.pressed = State.boot, DoorFault.none, False
        self.t_ms = self.beat_ms = 0
        self.reading: Tick | None = None
        self.memory = Memory(self.limits)
        self.parser = Parser()
        self._watch = SensorCheck(self.limits)
        self._wrong: Found | None = None
        self._answers: OrderedDict[Frame, bytes] = OrderedDict()
        self._out = bytearray()
        self._rate_hz, self._phase, self._sample = 500, 0, 0
        plant.mode = "off"

    def receive(self, data: bytes) -> None:
        """Take bytes from the line, at any time, in pieces of any size."""
        for frame in self.parser.feed(data):
            self._hear(frame)

    def press(self, pressed: bool) -> None:
        """Press or release the emergency button beside the arm; the fault stays latched either way."""
        self.pressed = pressed

    def tick(self) -> bytes:
        """Advance the plant by 1 ms with all checks, and return the bytes to send on the line."""
        self.t_ms += 1
        if self.pressed:
            self._trip(DoorFault.emergency_stop, 1.0)
        if self.state in (State.armed, State.playing) and self.t_ms - self.beat_ms > HEARTBEAT_MS:
            self._trip(DoorFault.heartbeat_lost, float(self.t_ms - self.beat_ms))
        self.reading = self.plant.step()
        end_deg = self.memory.profile.end_deg if self.memory.profile else MAX_ANGLE_DEG
        self._wrong = self._watch.check(self.reading, self.state, end_deg)
        if self._wrong is not None:
            self._trip(*self._wrong)
        if self.state is State.boot and self.t_ms >= BOOT_MS:
            self.state = State.safe
        self._report(self.reading)
        out, self._out = bytes(self._out), bytearray()
        return out

    def _trip(self, fault: DoorFault, value: float) -> None:
        """Switch the motor off and the brake on; the first fault stays latched."""
        self._rest()
        if self.fault is DoorFault.none:
            self.fault = fault
            self._say(says.FaultReport(self.t_ms * 1000, fault, _sendable(value)), 0)

    def _rest(self) -> None:
        self.plant.mode = "off"
        if self.state is not State.boot:
            self.state = State.safe

    def _report(self, reading: Tick) -> None:
        self._phase += self._rate_hz
        if self._phase < TICKS_PER_S:
            return
        self._phase -= TICKS_PER_S
        telemetry = says.Telemetry(
            t_us=self.t_ms * 1000, sample=self._sample & 0xFFFFFFFF,
            angle_deg=_sendable(math.degrees(reading.angle_rad)),
            velocity_deg_s=_sendable(math.degrees(reading.velocity_rad_s)),
            torque_Nm=_sendable(reading.torque_Nm), brake_A=_sendable(reading.brake_A),
            state=self.state, fault=self.fault,
        )  # fmt: skip
        self._say(telemetry, self._sample & 0xFFFF)
        self._sample += 1

    def _say(self, message: says.Message, sequence: int) -> None:
        self._out += says.sent(message, sequence)

    def _hear(self, frame: Frame) -> None:
        if frame in self._answers:
            self._out += self._answers[frame]
            return
        message = says.understood(frame)
        answer = self._answer(message)
        if answer is None:
            return
        reply: says.Message = answer if isinstance(answer, says.Message) else says.Ack(frame.kind, self.state)
        if isinstance(answer, Reason):
            reply = says.Nak(frame.kind, answer, self.state, self.fault)
        data = says.sent(reply, frame.sequence)
        self._out += data
        if not isinstance(message, ALWAYS_DONE):
            self._answers[frame] = data
            if len(self._answers) > REMEMBERED:
                self._answers.popitem(last=False)

    def _answer(self, message: says.Message | None) -> Answer | None:
        """Return the answer to a request, or None."""
        if message is None or type(message) not in self._allowed:
            return Reason.unknown_type
        if self.state not in self._allowed[type(message)]:
            return Reason.wrong_state
        match message:
            case says.Heartbeat():
                self.beat_ms = self.t_ms
                return None
            case says.Hello():
                return self._identity(message)
            case says.ReadBack():
                return self.memory.part(message)
            case _:
                return self._do(message) or True

    def _do(self, message: says.Message) -> Reason | None:
        """Perform the request, or return the reason why it is refused."""
        match message:
            case says.UploadBegin() | says.UploadChunk() | says.UploadEnd():
                return self.memory.take(message, self.state is State.playing)
            case says.Change():
                refused = self.memory.change(message.crc)
                if refused is None and self.memory.profile is not None:
                    self.plant.change(self.memory.profile.torque_Nm)
                return refused
            case says.SetRate():
                return self._set_rate(message.rate_hz)
            case says.Clear():
                return self._clear(message.fault)
            case says.Arm():
                return self._arm(message.crc)
            case says.Play():
                self.plant.mode, self.state = "play", State.playing
            case says.Stop():
                self._rest()
            case says.EStop():
                self._trip(DoorFault.emergency_stop, 0.0)
        return None

    def _identity(self, message: says.Hello) -> says.Identity | Reason:
        self._answers.clear()
        if message.version != VERSION:
            return Reason.wrong_version
        limits, held = self.limits, self.memory.profile
        return says.Identity(
            MAGIC, VERSION, self.version, self.serial_number, POINTS, limits.torque_Nm, limits.slope_Nm_deg,
            limits.speed_deg_s, HEARTBEAT_MS, self.state, self.fault, held.crc if held else 0,
        )  # fmt: skip

    def _set_rate(self, rate_hz: int) -> Reason | None:
        if not RATES_HZ[0] <= rate_hz <= RATES_HZ[1]:
            return Reason.bad_value
        self._rate_hz, self._phase = rate_hz, 0
        return None

    def _clear(self, fault: int) -> Reason | None:
        if fault != self.fault:
            return Reason.bad_value
        if self.pressed or self._wrong is not None:
            return Reason.cause_remains
        self.fault, self._watch = DoorFault.none, SensorCheck(self.limits)
        return None

    def _arm(self, crc: int) -> Reason | None:
        profile = self.memory.profile
        if profile is None or (refused := self._unfit(profile, crc)) is not None:
            return Reason.incomplete if profile is None else refused
        self.plant.load(profile.torque_Nm, math.radians(profile.end_deg))
        self.plant.mode, self.state, self.beat_ms = "hold", State.armed, self.t_ms
        return None

    def _unfit(self, profile: says.Profile, crc: int) -> Reason | None:
        """Return the reason why the motor must not be switched on for this profile; None if it may."""
        if self.memory.damaged:
            self._trip(DoorFault.profile_damaged, 0.0)
        if self.fault is not DoorFault.none:
            return Reason.faulted
        if crc != profile.crc:
            return Reason.wrong_crc
        still = self.reading is not None and abs(math.degrees(self.reading.velocity_rad_s)) <= self.limits.still_deg_s
        return None if still else Reason.moving


def _sendable(value: float) -> float:
    """Return the nearest value that a float32 can hold."""
    return value if math.isnan(value) else min(max(value, -FLOAT32_MOST), FLOAT32_MOST)


@dataclass
class Memory:
    """The received part of an upload, and the last accepted profile."""

    limits: Limits
    profile: Profile | None = None
    upload: UploadBegin | None = None
    points: dict[int, float] = field(default_factory=dict)
    following: Profile | None = None
    """The profile that was uploaded while `profile` is being played, and may follow it."""

    def take(self, message: UploadBegin | UploadChunk | UploadEnd, playing: bool = False) -> Reason | None:
        """Store a part of an upload, or return the reason why it is refused.

        While playing, the old profile stays active.
        """
        match message:
            case UploadBegin():
                return self.begin(message, playing)
            case UploadChunk():
                return self.chunk(message)
            case UploadEnd():
                return self.end(message, playing)

    def begin(self, message: UploadBegin, playing: bool = False) -> Reason | None:
        """Begin a new profile, which replaces the old one, or is stored beside it while playing."""
        if message.points != POINTS or not 0 < message.end_deg <= MAX_ANGLE_DEG:
            return Reason.bad_value
        self.upload, self.points, self.following = message, {}, None
        if not playing:
            self.profile = None
        return None

    def chunk(self, message: UploadChunk) -> Reason | None:
        """Store some points; the same points may come twice."""
        if self.upload is None:
            return Reason.incomplete
        count = len(message.torque_Nm)
        if not 1 <= count <= CHUNK_POINTS or message.first + count > POINTS:
            return Reason.bad_value
        if not all(map(math.isfinite, message.torque_Nm)):
            return Reason.bad_value
        self.points.update(enumerate(message.torque_Nm, message.first))
        return None

    def end(self, message: UploadEnd, playing: bool = False) -> Reason | None:
        """Accept the profile if it is complete, undamaged and within the limits, or return the reason why not."""
        if self.upload is None or len(self.points) < POINTS:
            return Reason.incomplete
        torque = tuple(self.points[index] for index in range(POINTS))
        if not self.upload.crc == message.crc == profile_crc(torque, self.upload.end_deg):
            return Reason.wrong_crc
        if not self.allowed(torque):
            return Reason.over_limit
        taken = Profile(torque, self.upload.end_deg)
        if playing:
            self.following = taken
        else:
            self.profile = taken
        self.upload, self.points = None, {}
        return None

    def change(self, crc: int) -> Reason | None:
        """Activate the profile that is stored beside, or return the reason why not."""
        if self.profile is None or self.following is None:
            return Reason.incomplete
        if not crc == self.following.crc == profile_crc(self.following.torque_Nm, self.following.end_deg):
            return Reason.wrong_crc
        if self.following.end_deg != self.profile.end_deg:
            return Reason.bad_value
        self.profile, self.following = self.following, None
        return None

    def allowed(self, torque: tuple[float, ...]) -> bool:
        """Return whether torque and slope are within the limits, with a margin for the rounding to float32."""
        hair = 1 + 1e-6
        steepest = max(abs(after - before) for before, after in pairwise(torque)) * POINTS_PER_DEG
        highest = max(map(abs, torque))
        return highest <= self.limits.torque_Nm * hair and steepest <= self.limits.slope_Nm_deg * hair

    def part(self, message: ReadBack) -> Part | Reason:
        """Return points of the stored profile."""
        if self.profile is None:
            return Reason.incomplete
        if not 1 <= message.count <= CHUNK_POINTS or message.first + message.count > POINTS:
            return Reason.bad_value
        return Part(message.first, self.profile.torque_Nm[message.first : message.first + message.count])

    @property
    def damaged(self) -> bool:
        """Return whether the stored profile differs from the accepted one."""
        held = self.profile
        return held is not None and held.crc != profile_crc(held.torque_Nm, held.end_deg)
