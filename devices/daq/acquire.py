"""The interface of a data acquisition card for sensors: a steady stream of volts, and the number of lost samples."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate.devices.device import DeviceError, NowNs
from palpate.devices.source import Elapsed, since

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

Volts = NDArray[np.float64]
"""Readings of shape (n, channels)."""
POLL_S = 0.005
"""A read waits for about this many seconds, so that it is not woken for every sample."""
Terminals = Literal["default", "diff", "rse", "nrse"]
_RANGE = re.compile(r"^(?:(?P<device>[^/,\s]+)/)?(?P<line>[A-Za-z_]+)(?P<first>\d+)(?::(?:[A-Za-z_]+)?(?P<last>\d+))?$")


@dataclass(frozen=True)
class Wiring:
    """The setup of a card: inputs, range, rate, and how many seconds it may buffer unread."""

    channels: tuple[str, ...]
    low_V: float
    high_V: float
    rate_hz: float
    buffer_s: float = 4.0
    terminals: Terminals = "default"

    @property
    def buffer(self) -> int:
        """Return the greatest number of unread samples per channel."""
        return max(16, round(self.rate_hz * self.buffer_s))


@dataclass(frozen=True)
class Taken:
    """The rows of one read; `lost` samples are missing just before the first row."""

    volts: Volts
    lost: int = 0


@dataclass(frozen=True)
class Pace:
    """The time of a reader of samples: seconds since the start, and a function that waits."""

    elapsed_s: Elapsed
    wait: Callable[[float], None]

    @staticmethod
    def real(now_ns: NowNs) -> Pace:
        """Return a pace in real time, beginning now."""
        return Pace(since(now_ns), time.sleep)

    @staticmethod
    def by_clock(elapsed_s: Elapsed) -> Pace:
        """Return a pace by an elapsed time that is computed elsewhere, beginning now; reads never wait."""
        start_s = elapsed_s()
        return Pace(lambda: elapsed_s() - start_s, lambda _seconds: None)


class Daq(Protocol):
    """A card or its twin. Its name is that of the sensor that it serves."""

    name: str
    wiring: Wiring

    @property
    def facts(self) -> Mapping[str, str]:
        """Return the card's own description once it is open: product, serial number, driver, real rate."""

    def open(self) -> None:
        """Reserve the inputs. Raises DeviceError if they are not available as wired."""

    def expect(self, scene: Scene | None) -> None:
        """Set the scene that is sensed next; a real card ignores it."""

    def start(self, pace: Pace) -> None:
        """Begin to sample into the buffer. Raises DeviceError."""

    def read(self, most: int, timeout_s: float) -> Taken:
        """Return at most `most` rows that have arrived, waiting for some at most timeout_s. Raises DeviceFault."""

    def stop(self) -> None:
        """Stop sampling, also if it has not started."""

    def close(self) -> None:
        """Release the inputs, also if they are not open."""


def channel_names(spelled: str, where: str) -> tuple[str, ...]:
    """Return the single inputs of a list as NI-DAQmx spells it: `Dev1/ai0:5` or `Dev1/ai0:2, Dev1/ai7`.

    Raises DeviceError, with a message that begins with `where`, for anything else and for an input named twice.
    """
    names: list[str] = []
    device = ""
    for part in spelled.split(","):
        match = _RANGE.match(part.strip())
        device = (match["device"] or device) if match else ""
        if not match or not device:
            raise DeviceError(f"{where}: channels {spelled!r}: {part.strip()!r} is not an input; write as Dev1/ai0:5")
        first = int(match["first"])
        last = int(match["last"] or first)
        step = 1 if last >= first else -1
        names += [f"{device}/{match['line']}{n}" for n in range(first, last + step, step)]
    if len(set(names)) < len(names):
        raise DeviceError(f"{where}: channels {spelled!r} name an input twice; each sensor wire has its own")
    return tuple(names)


def demand_channels(spelled: str, count: int, where: str, what: str) -> tuple[str, ...]:
    """Return the single inputs. Raises DeviceError unless there are `count` of them."""
    names = channel_names(spelled, where)
    if len(names) != count:
        raise DeviceError(f"{where}: channels {spelled!r} are {len(names)} inputs; {count} are expected: {what}")
    return names
