"""Play prepared samples once, to the sample, from an output's callback; go silent by itself if nobody feeds it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from palpate.devices.device import DeviceFault, NowNs
from palpate.devices.vibrator.exposure import VoltGuard
from palpate.protocols.events import NS
from palpate.signals.arrays import Array

RAMP_S = 0.004


@dataclass
class Player:
    """The source of an output's samples, in V: silence, or the loaded samples from a place that is known to the sample.

    `feed` must be called within `feed_s` of output time while something plays; else it ramps to silence in 4 ms and
    stays silent until the next `play`. `wait_s` says how long from now the next filled sample sounds. Any thread may
    call any function.
    """

    name: str
    rate_hz: float
    guard: VoltGuard
    feed_s: float
    wait_s: Callable[[], float] = lambda: 0.0
    taken: int = 0
    """Number of samples that the output has taken since it was opened."""
    silent: threading.Event = field(default_factory=threading.Event)
    now_ns: NowNs = time.monotonic_ns
    _volts: Array | None = None
    _starts: int = 0
    _ended: int = 0
    _tail: int = 0
    _unfed: int = 0
    _last: float = 0.0
    _ramp: Array = field(default_factory=lambda: np.zeros(0))
    _onset_ns: int | None = None
    _fault: DeviceFault | None = None
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def __post_init__(self) -> None:
        self.silent.set()

    def play(
        self, volts: Array, gap_s: float, now_ns: NowNs, demand: Callable[[], None] = lambda: None, tail: int = 0
    ) -> None:
        """Begin with the next sample that is filled, at least `gap_s` after the end of what was played before.

        The last `tail` samples do not count: the gap begins before them.

        `demand` is called once it is certain that they may be played, and may still refuse them by an exception. Raises
        DeviceFault (`refused`) while something plays.
        """
        with self._lock:
            if self._volts is not None:
                raise DeviceFault(self.name, "refused", f"{self.name}: it is still playing; wait for its end")
            demand()
            self._starts = max(self.taken + len(self._ramp), self._ended + round(gap_s * self.rate_hz))
            self.now_ns, self._onset_ns, self._fault, self._unfed = now_ns, None, None, 0
            self._tail = tail
            self._volts = np.array(volts, np.float64)  # a copy: nobody changes it while it plays
            self.silent.clear()

    def feed(self) -> None:
        """Say that whoever plays is alive."""
        self._unfed = 0

    @property
    def busy(self) -> bool:
        """Return whether something plays, or waits for its gap."""
        return self._volts is not None

    @property
    def onset_ns(self) -> int | None:
        """Return when the first sample sounds, by the clock given to `play`; None before the output has taken it."""
        return self._onset_ns

    def fault(self) -> DeviceFault | None:
        """Return why the last samples were not played to their end, or None."""
        return self._fault

    def fill(self, count: int) -> Array:
        """Return the next samples, in V."""
        with self._lock:
            out = np.zeros(count)
            part, self._ramp = self._ramp[:count], self._ramp[count:]
            out[: len(part)] = part
            if self._volts is not None:
                self._take(out)
            else:
                self.guard.cool(count)
            self.taken += count
            self._last = float(out[-1]) if count else self._last
            if self._volts is None and not len(self._ramp) and self._last == 0.0:
                self.silent.set()
            return out

    def _take(self, out: Array) -> None:
        """Put the loaded samples in their places; stop at the first that must not be played, or if nobody feeds."""
        volts = np.zeros(0) if self._volts is None else self._volts
        first = max(self._starts - self.taken, 0)
        done = max(self.taken - self._starts, 0)
        part = volts[done : done + max(len(out) - first, 0)]
        allowed = round(self.feed_s * self.rate_hz) - self._unfed
        self._unfed += len(out)
        if first:
            self.guard.cool(min(first, len(out)))
        if len(part) and done == 0:
            self._onset_ns = self.now_ns() + round((self.wait_s() + first / self.rate_hz) * NS)
        most, problem = self.guard.first_beyond(part)
        if allowed < first + most:
            most, problem = max(allowed - first, 0), ""
            late = f"nobody fed it for {self.feed_s:g} s (`feed_s`)"
            self._fault = DeviceFault(self.name, "heartbeat_lost", f"{self.name}: the output was switched off: {late}")
        out[first : first + most] = part[:most]
        if problem:
            kind = "not_a_number" if "sample is" in problem else "limit"
            self._fault = DeviceFault(self.name, kind, f"{self.name}: the output was switched off: {problem}")
        if self._fault is not None:
            here = first + most
            last = float(part[most - 1]) if most else float(volts[done - 1]) if done else 0.0
            self._stop(last)
            tail, self._ramp = self._ramp[: len(out) - here], self._ramp[len(out) - here :]
            out[here : here + len(tail)] = tail
        elif done + len(part) >= len(volts) and (len(part) or done):
            self._volts, self._ended = None, self._starts + len(volts) - self._tail

    def _stop(self, last: float) -> None:
        self._volts, self._ended = None, self.taken
        steps = round(RAMP_S * self.rate_hz)
        self._ramp = last * (0.5 + 0.5 * np.cos(np.pi * np.arange(1, steps + 1) / steps)) if last else np.zeros(0)

    def halt(self) -> None:
        """Drop what plays and go to silence in 4 ms; a second call changes nothing."""
        with self._lock:
            if self._volts is not None:
                self._stop(self._last)
