"""Sensors that are recorded throughout a session: their samples are added to each reply, whatever the request was."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

from palpate.devices.acts import UnconfirmedFault
from palpate.devices.desk import Desk, Pages
from palpate.devices.device import DeviceFault, NowNs, Sensor
from palpate.devices.streams.recording import Recording
from palpate.protocols.events import Chunk, Samples, WorldEvent

WAITING = "changing_sample"


@dataclass
class BesideRecorder:
    """A recorder of `sensors` ({prefix: sensor}; `names` and `may_hide` as for Recording) during all trials.

    After a fault the sensors are stopped, their last samples are handed on, and recording begins again once the
    experimenter has confirmed. Samples are numbered from 0 in each reply, so that each trial is independent.
    """

    sensors: Mapping[str, Sensor]
    names: Mapping[tuple[str, str], str] = field(default_factory=dict)
    may_hide: Collection[str] = ()
    _recording: Recording | None = None
    _unconfirmed: UnconfirmedFault = field(default_factory=UnconfirmedFault)
    _failed: DeviceFault | None = None

    def ready(self, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent | None:
        """Make sure that the sensors are being recorded.

        Return None, or what comes first: actions of the experimenter while a fault is repaired, the samples up to a
        fault, and then the fault.
        """
        if (aside := self._unconfirmed.demand_confirmation(WAITING, window, desk)) is not None:
            return aside
        if self._failed is None:
            try:
                self._check(now_ns)
                return None
            except DeviceFault as fault:
                self._failed = fault
                samples = self._stop()
                if samples:
                    return Chunk({"streams": {}}, samples)
        failed, self._failed = self._failed, None
        return self._unconfirmed.record(failed.named())

    def take(self) -> tuple[Samples, ...]:
        """Return the samples since the last call."""
        recording = self._recording
        if recording is None:
            return ()
        first = {name: stream.next for name, stream in recording.streams.items()}
        taken: list[Samples] = []
        while samples := recording.take().samples:
            taken += [replace(block, first=block.first - first[block.stream]) for block in samples]
        return tuple(taken)

    def close(self) -> None:
        """Stop the sensors; they stay open."""
        self._stop()

    def _check(self, now_ns: NowNs) -> None:
        """Begin to record, or check that nothing has failed. Raises DeviceFault."""
        if self._recording is None:
            for sensor in self.sensors.values():
                sensor.expect(None)
            self._recording = Recording(
                self.sensors, now_ns, names=self.names, may_hide=self.may_hide, suspended_ns=lambda: 0
            )
            self._recording.start()
        if (fault := self._recording.fault()) is not None:
            raise fault

    def _stop(self) -> tuple[Samples, ...]:
        """Stop, and return the remaining samples."""
        recording = self._recording
        if recording is None:
            return ()
        try:
            recording.end()
        finally:
            samples = self.take()
            self._recording = None
        return samples
