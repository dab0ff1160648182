"""The interface of every device: named signals, opening, making safe, closing, and its abilities.

A device is a small dataclass that implements `Device`; one that records also implements `Sensor`, one that presents
stimuli `Presents`, one that records a whole act `Records`.
"""

from __future__ import annotations

import sys
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from palpate.devices.desk import Desk, Pages
from palpate.protocols.events import Present, Sense, WorldEvent

if TYPE_CHECKING:
    from palpate.devices.scene import Scene
    from palpate.protocols.study import Stimulus

NowNs = Callable[[], int]
"""A clock in nanoseconds that never decreases; any thread may call it."""
FAULTS = (
    "link_lost", "heartbeat_lost", "silent", "stuck", "not_a_number", "over_range", "overload", "overrun", "underrun",
    "refused", "limit", "emergency_stop", "firmware",
)  # fmt: skip
"""Categories of device faults, by which a record counts them."""


class DeviceError(ValueError):
    """A device that cannot be opened or used as requested: its port, settings, calibration or library."""


class DeviceFault(Exception):
    """A failure of a device in use: silent, out of range, not a number, gone. The device is then made safe.

    `device` is the device's name in the rig; `what` is the fault's category (see FAULTS), the message is for people.
    """

    def __init__(self, device: str, what: str, message: str) -> None:
        super().__init__(message)
        self.device, self.what = device, what

    def named(self) -> DeviceFault:
        """Return the fault with a message that begins with the device's name, as it is recorded."""
        message = str(self)
        return (
            self
            if message.startswith(self.device)
            else DeviceFault(self.device, self.what, f"{self.device}: {message}")
        )


@contextmanager
def closed_on_failure(close: Callable[[], object]) -> Iterator[None]:
    """Close a device that is partly open if the block raises; the block's exception is raised in any case."""
    try:
        yield
    except BaseException:
        with suppress(Exception):
            close()
        raise


@contextmanager
def faults_as_errors() -> Iterator[None]:
    """Raise a DeviceFault of the block as a DeviceError: a device that fails on opening is not available."""
    try:
        yield
    except DeviceFault as fault:
        raise DeviceError(str(fault)) from fault


@dataclass(frozen=True)
class Signal:
    """A stream of samples: channels that are sampled together by one clock.

    `units` has the unit of each channel, as the ledger records it (`palpate.protocols.events.Samples`).
    `clock` names the clock that times the samples: `host`, or a device whose own clock may drift against the host's.
    `calibration` says what converted raw readings to these units (maker's number, date, digest); None if nothing did.
    """

    name: str
    channels: tuple[str, ...]
    units: tuple[str, ...]
    rate_hz: float
    clock: str = "host"
    calibration: str | None = None


@dataclass(frozen=True)
class Block:
    """Consecutive samples of a signal as they arrived.

    `first` is the number of the first sample since the start, counting lost ones; `data` holds rows of channels,
    little-endian float32; `at_ns` is the host's clock when the last sample had arrived; `device_s` the device's own
    clock for the last sample, if it has one (in the time of `now_ns` if the signal's clock is `lsl`). `lost` samples
    are missing just before `first`, because of `why`.
    """

    first: int
    data: bytes
    at_ns: int
    device_s: float | None = None
    lost: int = 0
    why: str = ""


@dataclass(frozen=True)
class Reading:
    """A reading of a signal at rest: per channel the mean and the noise (SD), in its units."""

    signal: Signal
    rate_hz: float
    mean: tuple[float, ...]
    noise: tuple[float, ...]
    lost: int = 0


@dataclass(frozen=True)
class Health:
    """The state of a device: a `summary` in one line; `facts` are further details to show, by name."""

    ok: bool
    summary: str
    readings: tuple[Reading, ...] = ()
    calibrated: str | None = None
    facts: Mapping[str, str] = field(default_factory=dict)


class Device(Protocol):
    """A device of a rig; `name` is its name in the rig file."""

    name: str

    @property
    def signals(self) -> Sequence[Signal]:
        """Return the device's signals; () if it has none."""

    def open(self) -> None:
        """Connect, and leave the device safe. Raises DeviceError if it is not available."""

    def safe(self) -> None:
        """Bring it to rest: motor off, brake on, output silent. May be called at any time, repeatedly, from any
        thread.
        """

    def close(self) -> None:
        """Make it safe and release it, also if it is not open."""

    def describe(self) -> Mapping[str, Any]:
        """Return the device's description for the ledger as JSON data: kind, driver or twin, versions, calibration,
        limits.
        """

    def health(self, seconds: float) -> Health:
        """Read the open device for some seconds and return its state."""


class Sensor(Device, Protocol):
    """A device that gives samples. One thread reads it, another may start and stop it."""

    def expect(self, scene: Scene | None) -> None:
        """Set the scene that is sensed next; a twin uses it (None: at rest), a real sensor ignores it."""

    def start(self, now_ns: NowNs) -> None:
        """Begin to sample; blocks carry times of the clock `now_ns`. Raises DeviceError."""

    def read(self, timeout_s: float) -> Mapping[str, Sequence[Block]]:
        """Return the blocks since the last call, by signal name, waiting at most `timeout_s` for some.

        Raises DeviceFault.
        """

    def stop(self) -> None:
        """Stop sampling, also if it has not started."""


class Presents(Protocol):
    """A device that presents stimuli, while the window shows a page and the desk may interrupt."""

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Perform the request; called again after anything but a Reply, it continues where it was."""


class PresentsStimuli(Device, Presents, Protocol):
    """A device that presents the stimuli of a table by itself, within limits of its own.

    One with an attribute `folder` is given the study's, one with `elapsed_s` (seconds) another clock in simulations.
    A method `feels(stimulus, seconds)` returns the columns that simulated people feel in place of those of the table.
    """

    def check(self, stimulus: Stimulus, seconds: float | None = None) -> None:
        """Raise DeviceError unless the stimulus can be presented, in an interval of `seconds` if there is one.

        Another ValueError may have the attribute `column`, which names the column that is wrong.
        """


class Records(Protocol):
    """A device that records a stimulus while it is explored, and can be interrupted in the same way."""

    def perform(self, request: Sense, window: Pages, desk: Desk, now_ns: NowNs) -> WorldEvent:
        """Perform the request; called again after anything but a Reply, it continues where it was."""


def interleaved(*channels: Sequence[float]) -> bytes:
    """Return channels of equal length as rows, 4 bytes per value. Raises ValueError if their lengths differ."""
    if len({len(channel) for channel in channels}) > 1:
        raise ValueError(f"channels of one length are expected, found {[len(channel) for channel in channels]}")
    rows = array("f", [0.0]) * sum(map(len, channels))
    for place, channel in enumerate(channels):
        rows[place :: len(channels)] = array("f", channel)
    if sys.byteorder == "big":
        rows.byteswap()
    return rows.tobytes()
