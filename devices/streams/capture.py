"""A capture: all sensors of a need recorded together while the participant explores, and written to disk meanwhile."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from math import hypot

from palpate.devices.acts import UnconfirmedFault
from palpate.devices.desk import Desk, Pages
from palpate.devices.device import DeviceFault, NowNs, Sensor, closed_on_failure
from palpate.devices.scene import Scene
from palpate.devices.streams.recording import CHUNK_S, ROOM_S, Recording
from palpate.devices.streams.stream import Stream
from palpate.devices.suspend import suspended_ns
from palpate.protocols.events import NS, Aside, Fault, Reply, Sense, WorldEvent

RECORDING, WAITING = "recording", "changing_sample"
BROKEN_OFF = "a pause broke the recording off"


def nothing_to_see(_request: Sense) -> Scene | None:
    """Return None, because real sensors ignore the scene."""
    return None


@dataclass
class _Going:
    """A request in progress; `over` holds its result while its last samples are handed on."""

    request: Sense
    recording: Recording | None = None
    paused: bool = False
    over: Reply | Fault | None = None


@dataclass
class Capture:
    """A recorder of `sensors` ({prefix: sensor}; `names`, `may_hide` and the times as for Recording).

    A recording is complete or it does not count. A pause ends it: once the session goes on, its trial is repeated.
    After a fault every sensor is stopped and made safe, and the next attempt begins once the experimenter has
    confirmed. The samples so far stay on disk, in the attempt that does not count.
    """

    sensors: Mapping[str, Sensor]
    names: Mapping[tuple[str, str], str] = field(default_factory=dict)
    scene_for: Callable[[Sense], Scene | None] = nothing_to_see
    may_hide: Collection[str] = ()
    chunk_s: float = CHUNK_S
    room_s: float = ROOM_S
    by: str = "rig"
    suspended_ns: NowNs = suspended_ns
    _going: _Going | None = None
    _unconfirmed: UnconfirmedFault = field(default_factory=UnconfirmedFault)
    _last: Recording | None = None

    def perform(self, request: Sense, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Record for the request's seconds; an abandoned request is stopped by the next one, and by `close`."""
        if self._going is None or self._going.request is not request:
            self._end()
            self._going = _Going(request)
        with closed_on_failure(self.close):
            return self._continue(self._going, window, desk, now_ns)

    def close(self) -> None:
        """Stop any recording; the sensors stay open."""
        self._end()
        self._going = None

    def _continue(self, going: _Going, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        if going.recording is not None and going.recording.ended_ns is not None:
            if going.recording.due():
                return going.recording.take()
            going.recording = None
        if going.over is not None and not going.paused:
            self._going = None
            return going.over
        # Wait for the end of a pause, and for a device to be put right.
        aside = window.wait_for(WAITING, desk, lambda: False) if going.paused else None
        if aside is None and going.recording is None:
            aside = self._unconfirmed.demand_confirmation(WAITING, window, desk)
        if aside is not None:
            return self._obey(going, aside, desk)
        try:
            return self._record(going, window, desk, now_ns)
        except DeviceFault as fault:
            message = "; ".join([str(fault.named()), *self._make_safe(desk)])
            going.over = self._unconfirmed.record(DeviceFault(fault.device, fault.what, message))
        return self._continue(going, window, desk, now_ns)

    def _record(self, going: _Going, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Wait for the next chunk, or for the end. Raises DeviceFault."""
        recording = going.recording = going.recording or self._begin(going.request, now_ns)
        until_ns = recording.started_ns + round(going.request.seconds * NS)

        def ready() -> bool:
            return recording.due() or recording.fault() is not None or now_ns() >= until_ns

        if (aside := window.wait_for(RECORDING, desk, ready)) is not None:
            return self._obey(going, aside, desk)
        if (fault := recording.fault()) is not None:
            raise fault
        if now_ns() >= until_ns:
            summary = recording.stop()
            if (fault := recording.fault()) is not None:  # A sensor may have failed at the very end.
                raise fault
            desk.tell(clear_streams(recording.streams))
            seconds = round(((recording.ended_ns or recording.started_ns) - recording.started_ns) / NS, 3)
            going.over = Reply({"recorded": True, "seconds": seconds, "by": self.by, "streams": summary})
            return self._continue(going, window, desk, now_ns)
        chunk = recording.take()
        desk.tell(describe_streams(recording.streams))
        return chunk

    def _begin(self, request: Sense, now_ns: NowNs) -> Recording:
        """Start a new recording. Raises DeviceFault, after which no sensor samples."""
        for hanging in () if self._last is None else self._last.hanging():
            raise DeviceFault(hanging, "stuck", "its driver still hangs: unplug it and plug it in again")
        scene = self.scene_for(request)
        for sensor in self.sensors.values():
            sensor.expect(scene)
        self._last = Recording(
            self.sensors, now_ns, self.chunk_s, self.room_s, self.names, self.may_hide, self.suspended_ns
        )  # fmt: skip
        self._last.start()
        return self._last

    def _obey(self, going: _Going, aside: Aside, desk: Desk) -> Aside:
        """Do what the experimenter requested: a pause breaks the recording off, a repeat or abort abandons the
        request.
        """
        match aside.value.get("do"):
            case "pause":
                going.paused = True
                if going.recording is not None:
                    # No device failed, but the trial is repeated.
                    message = "; ".join([BROKEN_OFF, *self._make_safe(desk)])
                    going.over = Fault({"device": "session", "what": "interrupted", "message": message})
            case "go_on":
                going.paused = False
            case "repeat" | "abort":
                self._make_safe(desk)
                self._going = None
        return aside

    def _make_safe(self, desk: Desk) -> list[str]:
        """Stop the recording and make every sensor safe; return a message for each that failed."""
        if self._last is not None:
            desk.tell(clear_streams(self._last.streams))
        failed = []
        for name, act in [("recording", self._end), *((sensor.name, sensor.safe) for sensor in self.sensors.values())]:
            try:
                act()
            except Exception as error:
                failed.append(f"{name} could not be made safe: {error}")
        return failed

    def _end(self) -> None:
        if self._last is not None:
            self._last.end()


def describe_streams(streams: Mapping[str, Stream]) -> dict[str, str]:
    """Return a line for each stream: its level over the last chunk (RMS about the mean), samples and lost samples."""
    lines = {}
    for name, stream in streams.items():
        parts: list[str] = []
        if stream.level is not None:
            # Channels that share a unit (the axes of a vector) are taken together.
            by_unit: dict[str, list[float]] = {}
            for unit, rms in zip(stream.signal.units, stream.level.rms, strict=True):
                by_unit.setdefault(unit, []).append(rms)
            parts = [f"RMS {hypot(*values):.3g} {unit}" for unit, values in by_unit.items()]
        parts += [f"{stream.samples:,} samples", f"{stream.lost:,} LOST" if stream.lost else "0 lost"]
        if stream.bad:
            parts.append(f"{stream.bad:,} not a number")
        lines[name] = ", ".join(parts)
    return lines


def clear_streams(streams: Mapping[str, Stream]) -> dict[str, None]:
    """Return the state that removes those lines from the desk."""
    return dict.fromkeys(streams)
