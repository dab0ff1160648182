"""A tiny door: an arm that goes where it is pushed while it plays, and stands still while it does not."""

import math
from dataclasses import dataclass, field

from palpate.devices.door.firmware.controller import BOOT_MS, Firmware
from palpate.devices.door.firmware.sensor_check import Limits
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.frames import Parser
from palpate.devices.door.plant.machine import Tick


@dataclass
class TinyPlant:
    """`path` gives the angle in degrees over the milliseconds of play; the motor shows whether it is on."""

    path: object = lambda ms: 0.0
    mode: str = "off"
    t_ms: int = 0
    played_ms: int = 0
    angle_deg: float = 0.0
    pull_Nm: float = 0.0
    loaded: list = field(default_factory=list)
    changed: list = field(default_factory=list)
    moved: bool = False

    def load(self, torque_Nm, end_rad):
        self.loaded.append((tuple(torque_Nm), end_rad))

    def change(self, torque_Nm):
        self.changed.append(tuple(torque_Nm))

    def step(self):
        self.t_ms += 1
        before = self.angle_deg
        if self.mode == "play":
            self.played_ms += 1
            self.angle_deg = self.path(self.played_ms)
        else:
            self.played_ms = 0
        self.moved = self.moved or self.angle_deg != before
        speed = math.radians(self.angle_deg - before) * 1000
        motor = 0.0 if self.mode == "off" else 1.0
        brake = 1.0 if self.mode == "off" else 0.0
        return Tick(self.t_ms * 1000, math.radians(self.angle_deg), speed, self.pull_Nm, brake, 0.0, motor)


def out_and_back(opens_deg=62.0, ms=1000, waits_ms=100):
    """A path: from 0 to `opens_deg` and back, evenly."""

    def path(t_ms):
        t = t_ms - waits_ms
        if t <= 0:
            return 0.0
        return max(0.0, opens_deg * min(t / ms, 2 - t / ms))

    return path


def firmware(plant=None, limits=None):
    """One that has booted."""
    device = Firmware(plant or TinyPlant(), limits or Limits(speed_deg_s=1000.0))
    for _ in range(BOOT_MS):
        device.tick()
    return device


@dataclass
class Host:
    """Says things to a firmware directly, and reads what it says, a millisecond at a time."""

    firmware: object
    sequence: int = 0
    parser: Parser = field(default_factory=Parser)
    messages: list = field(default_factory=list)

    def say(self, message):
        """Say it, live a millisecond, and give the answer of that sequence, or None."""
        self.sequence += 1
        self.firmware.receive(says.sent(message, self.sequence))
        answers = [answer for sequence, answer in self.tick() if sequence == self.sequence]
        replies = [answer for answer in answers if not isinstance(answer, says.Telemetry | says.FaultReport)]
        return replies[0] if replies else None

    def tick(self):
        frames = self.parser.feed(self.firmware.tick())
        answers = [(frame.sequence, says.understood(frame)) for frame in frames]
        self.messages += [message for _, message in answers]
        return answers

    def run(self, ms, beats=True):
        for _ in range(ms):
            if beats:
                self.firmware.receive(says.sent(says.Heartbeat(), 0))
            self.tick()

    def upload(self, profile):
        torque = profile.torque_Nm
        chunks = [says.UploadChunk(first, torque[first : first + 128]) for first in range(0, 621, 128)]
        begin, end = says.UploadBegin(621, profile.end_deg, profile.crc), says.UploadEnd(profile.crc)
        return [self.say(part) for part in (begin, *chunks, end)]

    def play(self, profile):
        self.upload(profile)
        self.say(says.Arm(profile.crc))
        return self.say(says.Play())


def profile(height_Nm=10.0, end_deg=62.0):
    """A bell of torque."""
    return says.Profile(tuple(height_Nm * math.sin(math.pi * index / 620) for index in range(621)), end_deg)
