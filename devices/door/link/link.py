"""The link to the door simulator: requests and answers, telemetry, and a heartbeat that needs a live host.

Nothing here waits by the wall clock: `clock_s` is the time of the port, so a dialogue can run in virtual time.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from palpate.devices.device import DeviceFault
from palpate.devices.door.link import messages as says
from palpate.devices.door.link.codes import fault_name, reason_name, state_name
from palpate.devices.door.link.frames import SEQUENCES, Frame, Parser

REPLY_S = 0.2
"""Seconds after which a request without an answer is sent again."""
PATIENCE_S = 2.0
"""Seconds without an answer after which the link counts as lost."""
ALIVE_S = 0.5
"""Seconds for which heartbeats go on after the main thread was last alive."""
KEPT = 60_000
"""Telemetry samples that may wait to be read: a minute at the highest rate."""

Arrived = tuple[int, says.Telemetry]


class Port(Protocol):
    """A line to the device. It raises OSError if the line is lost."""

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes that have arrived, waiting at most `timeout_s` for some; it may return earlier with none."""

    def write(self, data: bytes) -> None:
        """Send all bytes."""

    def close(self) -> None:
        """Close the line."""


@dataclass(frozen=True)
class Timing:
    """The host's timeouts."""

    reply_s: float = REPLY_S
    patience_s: float = PATIENCE_S
    silent_s: float = 0.5


class Link:
    """A line to one device. With `Threads` any thread may use it; without them, the waiting thread reads the port."""

    def __init__(
        self, name: str, port: Port, clock_s: Callable[[], float] = time.monotonic, timing: Timing | None = None
    ) -> None:
        self.name, self.port, self.clock_s, self.timing = name, port, clock_s, timing or Timing()
        self.parser = Parser()
        self.threaded = False
        self.broken: DeviceFault | None = None
        self.latest: says.Telemetry | None = None
        self.report: says.FaultReport | None = None
        self.listen: Callable[[says.Telemetry], None] | None = None
        self.stamp_ns: Callable[[], int] = time.monotonic_ns
        self.samples: deque[Arrived] = deque(maxlen=KEPT)
        self.received = 0
        self._alive_until_s = self._heard_s = clock_s()
        self._sequence = 0
        self._answers: dict[int, says.Message | None] = {}
        self._changed = threading.Condition()
        self._writing = threading.Lock()

    def ask(self, *messages: says.Message) -> list[says.Message]:
        """Send requests and return their answers in order; requests without an answer are sent again.

        Raises DeviceFault: link_lost if no answer comes, refused if a request is refused.
        """
        requests = {self._next(): message for message in messages}
        try:
            answers = self._answered(requests)
        finally:
            for sequence in requests:
                self._answers.pop(sequence, None)
        for message, answer in zip(messages, answers, strict=True):
            if isinstance(answer, says.Nak):
                fault = f", with the fault {fault_name(answer.fault)}" if answer.fault else ""
                how, why = f"it is {state_name(answer.state)}{fault}", reason_name(answer.reason)
                refusal = f"{self.name}: the door refused {type(message).__name__} ({why}); {how}"
                raise Refused(self.name, answer, refusal)
        return answers

    def send(self, message: says.Message) -> None:
        """Send a message once, without waiting. If the line is lost, that is recorded in `broken`."""
        self._write(says.sent(message, self._next()))

    def keep_alive(self, seconds: float = ALIVE_S) -> None:
        """Allow heartbeats for so many seconds, because the main thread is alive; 0 ends them."""
        self._alive_until_s = self.clock_s() + seconds

    def beat(self) -> None:
        """Send a heartbeat if the main thread was alive recently."""
        if self.clock_s() < self._alive_until_s and self.broken is None:
            self.send(says.Heartbeat())

    def wait(self, ready: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until `ready`, the link is broken, or the time is over; return whether it is ready."""
        if self.threaded:
            with self._changed:
                self._changed.wait_for(lambda: ready() or self.broken is not None, timeout_s)
                return ready()
        until_s = self.clock_s() + timeout_s
        while not ready() and self.broken is None and (left_s := until_s - self.clock_s()) > 0:
            self.pump(left_s)
        return ready()

    def pump(self, timeout_s: float) -> None:
        """Read the bytes that have arrived, and handle their messages."""
        try:
            data = self.port.read(timeout_s)
        except OSError as error:
            self.lose(error)
            return
        self.received += len(data)
        frames = self.parser.feed(data)
        with self._changed:
            for frame in frames:
                self._hear(frame)
            self._changed.notify_all()

    def from_now(self) -> None:
        """Forget the telemetry so far, so that `latest` and `quiet_s` count from now on."""
        self.latest, self.report, self._heard_s = None, None, self.clock_s()

    def quiet_s(self) -> float:
        """Return how many seconds have passed without telemetry."""
        return self.clock_s() - self._heard_s

    def lose(self, error: Exception) -> None:
        """Record that the line is lost; the first cause stays in `broken`, and heartbeats end."""
        message = f"{self.name}: the link to the door is lost ({error}); without a heartbeat it goes safe by itself"
        with self._changed:
            if self.broken is None:
                self.broken = DeviceFault(self.name, "link_lost", message)
            self._changed.notify_all()

    def _next(self) -> int:
        with self._writing:
            self._sequence = self._sequence % (SEQUENCES - 1) + 1
            return self._sequence

    def _answered(self, requests: dict[int, says.Message]) -> list[says.Message]:
        self._answers.update(dict.fromkeys(requests))
        patience_s = self.timing.patience_s
        until_s = self.clock_s() + patience_s
        while self.broken is None:
            for sequence, message in requests.items():
                if self._answers[sequence] is None:
                    self._write(says.sent(message, sequence))
                    if len(requests) > 1:  # a heartbeat behind all parts of a profile would be 26 ms late
                        self.beat()
            self.wait(lambda: None not in self._of(requests), self.timing.reply_s)
            answers = [answer for answer in self._of(requests) if answer is not None]
            if len(answers) == len(requests):
                return answers
            if self.clock_s() >= until_s:
                names = ", ".join(dict.fromkeys(type(message).__name__ for message in requests.values()))
                self.lose(TimeoutError(f"no answer to {names} for {patience_s:g} s"))
        raise self.broken

    def _of(self, requests: dict[int, says.Message]) -> list[says.Message | None]:
        return [self._answers[sequence] for sequence in requests]

    def _hear(self, frame: Frame) -> None:
        message = says.understood(frame)
        if isinstance(message, says.Telemetry):
            self.latest, self._heard_s = message, self.clock_s()
            self.samples.append((self.stamp_ns(), message))
            if self.listen is not None:
                self.listen(message)
        elif isinstance(message, says.FaultReport):
            self.report = message
        elif message is not None and self._answers.get(frame.sequence, message) is None:
            self._answers[frame.sequence] = message

    def _write(self, data: bytes) -> None:
        try:
            with self._writing:
                self.port.write(data)
        except OSError as error:
            self.lose(error)


class Refused(DeviceFault):
    """A request that the device refused; `nak` is its answer."""

    def __init__(self, device: str, nak: says.Nak, message: str) -> None:
        super().__init__(device, "refused", message)
        self.nak = nak
