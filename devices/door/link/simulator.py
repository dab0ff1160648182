"""The car-door simulator as a device: it presents a stimulus as forces at its handle, and its telemetry is a signal."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from inspect import GEN_RUNNING, getgeneratorstate
from typing import TYPE_CHECKING, Any

from palpate.devices.acts import UnconfirmedFault
from palpate.devices.desk import Desk, Pages
from palpate.devices.device import (
    Block,
    DeviceError,
    DeviceFault,
    Health,
    NowNs,
    Signal,
    closed_on_failure,
    faults_as_errors,
)
from palpate.devices.door.link import dialogue
from palpate.devices.door.link.codes import FOLLOWS_FROM, VERSION, fault_name, state_name
from palpate.devices.door.link.limits import Limits, ProfileRefused, change_for_door, profile_for_door
from palpate.devices.door.link.link import Link
from palpate.devices.door.link.messages import Identity, Profile, SetRate
from palpate.devices.door.link.showing import Changes, Recorded, Showing
from palpate.devices.door.link.telemetry import CHANNELS, UNITS, TelemetryBlocks, trouble
from palpate.protocols.events import Fault, Present, Reply, WorldEvent
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

ProfileFor = Callable[[Present], Sequence[float]]
"""Returns the 621 forces, in newtons at the handle, for a request."""
Recorder = Callable[["DoorSimulator", NowNs], Recorded]
PAUSE_S = 600.0
"""Telemetry goes on while a session is paused, and is kept for this long until it can be taken."""


@dataclass(frozen=True)
class Connection:
    """An open link, and the function that closes it; `facts` describe it."""

    link: Link
    close: Callable[[], None]
    facts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Setup:
    """The settings of the door in a rig file, except those of the line."""

    handle_radius_m: float
    limits: Limits
    telemetry_hz: int
    time_limit_s: float
    driver: str
    calibrated: str | None = None


def no_profiles(request: Present) -> Sequence[float]:
    """Raise DeviceError, because this door was given no stimuli."""
    raise DeviceError(f"the door was given no profile for {request.trial.stimulus.id}")


def streamed(door: DoorSimulator, now_ns: NowNs) -> Recorded:
    """Return a recorder of the telemetry, as for every other stream."""
    from palpate.devices.streams.recording import Recording

    return Recording({door.name: door}, now_ns, room_s=PAUSE_S)


@dataclass
class DoorSimulator:
    """A door simulator. `connect` opens the line, `profile_for` gives a stimulus' forces, `recorder` records
    telemetry.
    """

    name: str
    setup: Setup
    connect: Callable[[], Connection]
    profile_for: ProfileFor = no_profiles
    recorder: Recorder = streamed
    unconfirmed: UnconfirmedFault = field(default_factory=UnconfirmedFault)
    identity: Identity | None = None
    changes: Changes | None = None
    """The source of changes while the door is felt; None if the profile does not change."""
    _connection: Connection | None = None
    _showing: tuple[Present, Generator[WorldEvent, None, None]] | None = None
    _numbering: TelemetryBlocks | None = None

    @property
    def by(self) -> str:
        """Return the name of the door that presents, for the reply; a simulated door is named as such."""
        return "twin" if self.setup.driver == "twin" else "door"

    @property
    def time_limit_s(self) -> float:
        """Return the longest time of a presentation, in seconds."""
        return self.setup.time_limit_s

    @property
    def signals(self) -> Sequence[Signal]:
        """Return its only signal, the telemetry."""
        return (Signal("telemetry", CHANNELS, UNITS, float(self.setup.telemetry_hz), self.name, self.setup.calibrated),)

    def open(self) -> None:
        """Connect, and leave it safe. Raises DeviceError: no door, or one that allows more than the rig does."""
        self._let_go()
        connection = self.connect()
        self._connection = connection
        with closed_on_failure(self._let_go), faults_as_errors():
            self._greet(connection.link)

    def safe(self) -> None:
        """Switch the motor off and the brake on; an unreachable device does so itself without a heartbeat."""
        if self._connection is not None:
            dialogue.rest(self._connection.link)

    def close(self) -> None:
        """Make it safe and close the line."""
        if self._showing is not None and getgeneratorstate(self._showing[1]) != GEN_RUNNING:
            self._end_showing()
        self._let_go()

    def greeted(self) -> tuple[Link, Identity]:
        """Return the link, reconnected if it was lost, and the door's identity. Raises DeviceFault."""
        try:
            if self._connection is None or self._connection.link.broken is not None:
                self.open()
            link = self._up()
            identity = self._greet(link)
        except DeviceError as error:
            raise DeviceFault(self.name, "link_lost", str(error)) from error
        return link, identity

    def profile(self, request: Present) -> Profile:
        """Return the profile to be played, within the limits. Raises DeviceFault (limit)."""
        try:
            return self.check(self.profile_for(request), request.trial.stimulus.id)
        except ProfileRefused as refused:
            raise DeviceFault(self.name, "limit", f"{self.name}: {refused}") from refused

    def demand_follows(self) -> None:
        """Raise DeviceError if the open door's firmware cannot change the door while it is felt."""
        identity = self.identity
        if identity is not None and identity.firmware < FOLLOWS_FROM:
            raise DeviceError(
                f"{self.name}: its firmware {identity.firmware} cannot change the door while it is felt, which the"
                f" study's `live` asks for and firmware {FOLLOWS_FROM} can. Bring it up to date, or take `live` out of"
                " the study"
            )

    def check(self, force_N: Sequence[float], what: str) -> Profile:
        """Return the profile as it would be sent, for a check before a session. Raises ProfileRefused."""
        return profile_for_door(force_N, self.setup.handle_radius_m, self._limits(), what)

    def change_for(self, force_N: Sequence[float], end_deg: float) -> Profile:
        """Return the torques for a change while it plays, with the stop in its place. Raises ProfileRefused."""
        return change_for_door(force_N, self.setup.handle_radius_m, self._limits(), end_deg, "the changed profile")

    def recorded(self, now_ns: NowNs) -> Recorded:
        """Return a recorder of one presentation's telemetry."""
        return self.recorder(self, now_ns)

    def expect(self, scene: Scene | None) -> None:
        """Do nothing: the door makes its own scene."""

    def start(self, now_ns: NowNs) -> None:
        """Number telemetry samples from the next one on. Raises DeviceError."""
        link = self._up()
        link.stamp_ns = now_ns
        link.from_now()
        link.samples.clear()
        self._numbering = TelemetryBlocks()

    def read(self, timeout_s: float) -> Mapping[str, Sequence[Block]]:
        """Return the telemetry that has arrived. Raises DeviceFault if the link is lost or silent."""
        link = self._up()
        link.wait(lambda: bool(link.samples), timeout_s)
        arrived = [link.samples.popleft() for _ in range(len(link.samples))]
        if not arrived and (fault := trouble(link, None)) is not None and fault.what in {"link_lost", "silent"}:
            raise fault
        return {"telemetry": self._numbering.blocks(arrived) if self._numbering is not None else []}

    def stop(self) -> None:
        """Stop numbering samples."""
        self._numbering = None

    def describe(self) -> Mapping[str, Any]:
        """Return the driver, the device's description of itself, and the limits of both, for the ledger."""
        setup, identity = self.setup, self.identity
        account = {} if identity is None else _account(identity)
        return {
            "kind": "door",
            "driver": setup.driver,
            "protocol": VERSION,
            "handle_radius_m": setup.handle_radius_m,
            "limits": setup.limits.model_dump(),
            "telemetry_hz": setup.telemetry_hz,
            "calibrated": setup.calibrated,
            **account,
        }

    def health(self, seconds: float) -> Health:
        """Read the telemetry of the open door at rest for some seconds."""
        from palpate.devices.health import sensed

        link = self._up()
        try:
            readings = sensed(self, seconds, time.monotonic_ns)
            identity = self.identity = dialogue.greet(link)
        except DeviceFault as fault:
            return Health(False, str(fault), calibrated=self.setup.calibrated)
        facts = {**(self._connection.facts if self._connection else {}), **_facts(identity, link)}
        wrong = [str(dialogue.latched_fault(self.name, identity.fault))] if identity.fault else []
        wrong += [f"{count(lost, 'sample')} of telemetry lost on the line"] if (lost := readings[0].lost) else []
        summary = "; ".join(wrong) or f"{state_name(identity.state)}, motor off"
        return Health(not wrong, summary, readings, self.setup.calibrated, facts)

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Let the participant feel the stimulus, and leave the door safe in any case. Raises DeviceError."""
        if self._showing is None or self._showing[0] is not request:
            self._end_showing()
            self._showing = (request, Showing(self, request, window, desk, now_ns).steps())
        try:
            event = next(self._showing[1])
        except BaseException:
            self._showing = None
            self.safe()
            raise
        if isinstance(event, Reply | Fault):
            self._end_showing()
        return event

    def _end_showing(self) -> None:
        ended, self._showing = self._showing, None
        if ended is not None:
            ended[1].close()

    def _limits(self) -> Limits:
        """Return the rig's or the device's own limits, whichever are lower."""
        limits, identity = self.setup.limits, self.identity
        if identity is None:
            return limits
        lower = {
            "torque_Nm": min(limits.torque_Nm, identity.torque_Nm),
            "slope_Nm_deg": min(limits.slope_Nm_deg, identity.slope_Nm_deg),
        }
        return limits.model_copy(update=lower)

    def _let_go(self) -> None:
        self.safe()
        gone, self._connection = self._connection, None
        if gone is not None:
            gone.close()

    def _up(self) -> Link:
        if self._connection is None:
            raise DeviceError(f"{self.name}: the door is not open")
        return self._connection.link

    def _greet(self, link: Link) -> Identity:
        """Return the identity of a safe door with the rig's settings, as it may have been restarted."""
        self.identity = identity = dialogue.greet(link)
        if identity.speed_deg_s > self.setup.limits.speed_deg_s:
            raise DeviceError(
                f"{self.name}: the door stops itself at {identity.speed_deg_s:g} deg/s, the rig allows "
                f"{self.setup.limits.speed_deg_s:g}; set the device's limit, or limits: speed_deg_s in the rig file"
            )
        link.ask(SetRate(self.setup.telemetry_hz))
        return identity


def _account(identity: Identity) -> dict[str, Any]:
    return {
        "serial_number": identity.serial_number,
        "firmware": identity.firmware,
        "device_limits": {
            "torque_Nm": identity.torque_Nm,
            "slope_Nm_deg": identity.slope_Nm_deg,
            "speed_deg_s": identity.speed_deg_s,
            "heartbeat_ms": identity.heartbeat_ms,
        },
    }


def _facts(door: Identity, link: Link) -> dict[str, str]:
    return {
        "serial number": str(door.serial_number),
        "firmware": str(door.firmware),
        "device limits": f"{door.torque_Nm:g} N m, {door.slope_Nm_deg:g} N m/deg, {door.speed_deg_s:g} deg/s",
        "heartbeat": f"{door.heartbeat_ms} ms",
        "latched fault": fault_name(door.fault),
        "dropped on the line": f"{link.parser.dropped} frames, {link.parser.dropped_bytes} bytes",
    }
