"""The firmware's memory for one profile: it comes in parts, and counts only once it is complete, whole and allowed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

from palpate.devices.door.firmware.limits import Limits
from palpate.devices.door.link.codes import CHUNK_POINTS, Reason
from palpate.devices.door.link.messages import Part, Profile, ReadBack, UploadBegin, UploadChunk, UploadEnd, profile_crc
from palpate.signals.doors.grid import MAX_ANGLE_DEG, POINTS, POINTS_PER_DEG


@dataclass
class Memory:
    """What has come of an upload, and the last profile that was accepted."""

    limits: Limits
    profile: Profile | None = None
    begun: UploadBegin | None = None
    points: dict[int, float] = field(default_factory=dict)
    following: Profile | None = None
    """What was uploaded while `profile` is being played, and may follow it."""

    def take(self, message: UploadBegin | UploadChunk | UploadEnd, playing: bool = False) -> Reason | None:
        """A part of an upload; a reason where it is refused. While playing, the old profile stays in force."""
        match message:
            case UploadBegin():
                return self.begin(message, playing)
            case UploadChunk():
                return self.chunk(message)
            case UploadEnd():
                return self.end(message, playing)

    def begin(self, message: UploadBegin, playing: bool = False) -> Reason | None:
        """A new profile replaces the old one from here on, or is laid beside it while playing."""
        if message.points != POINTS or not 0 < message.end_deg <= MAX_ANGLE_DEG:
            return Reason.bad_value
        self.begun, self.points, self.following = message, {}, None
        if not playing:
            self.profile = None
        return None

    def chunk(self, message: UploadChunk) -> Reason | None:
        """Keep some points; the same ones may come twice."""
        if self.begun is None:
            return Reason.incomplete
        count = len(message.torque_Nm)
        if not 1 <= count <= CHUNK_POINTS or message.first + count > POINTS:
            return Reason.bad_value
        if not all(map(math.isfinite, message.torque_Nm)):
            return Reason.bad_value
        self.points.update(enumerate(message.torque_Nm, message.first))
        return None

    def end(self, message: UploadEnd, playing: bool = False) -> Reason | None:
        """Take the profile if nothing lacks, nothing is damaged and nothing is beyond the limits."""
        if self.begun is None or len(self.points) < POINTS:
            return Reason.incomplete
        torque = tuple(self.points[index] for index in range(POINTS))
        if not self.begun.crc == message.crc == profile_crc(torque, self.begun.end_deg):
            return Reason.wrong_crc
        if not self.allowed(torque):
            return Reason.over_limit
        taken = Profile(torque, self.begun.end_deg)
        if playing:
            self.following = taken
        else:
            self.profile = taken
        self.begun, self.points = None, {}
        return None

    def change(self, crc: int) -> Reason | None:
        """The profile beside the one in force takes its place; a reason where it may not."""
        if self.profile is None or self.following is None:
            return Reason.incomplete
        if not crc == self.following.crc == profile_crc(self.following.torque_Nm, self.following.end_deg):
            return Reason.wrong_crc
        if self.following.end_deg != self.profile.end_deg:
            return Reason.bad_value
        self.profile, self.following = self.following, None
        return None

    def allowed(self, torque: tuple[float, ...]) -> bool:
        """Whether torque and slope stay within the limits; a hair is left for the rounding to float32."""
        hair = 1 + 1e-6
        steepest = max(abs(after - before) for before, after in pairwise(torque)) * POINTS_PER_DEG
        highest = max(map(abs, torque))
        return highest <= self.limits.torque_Nm * hair and steepest <= self.limits.slope_Nm_deg * hair

    def part(self, message: ReadBack) -> Part | Reason:
        """Points of the profile as they are held."""
        if self.profile is None:
            return Reason.incomplete
        if not 1 <= message.count <= CHUNK_POINTS or message.first + message.count > POINTS:
            return Reason.bad_value
        return Part(message.first, self.profile.torque_Nm[message.first : message.first + message.count])

    @property
    def damaged(self) -> bool:
        """Whether what is held is no longer what was accepted."""
        held = self.profile
        return held is not None and held.crc != profile_crc(held.torque_Nm, held.end_deg)
