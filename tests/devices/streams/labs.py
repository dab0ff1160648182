"""Sensors that give what a test feeds them, a window whose turns a test makes, an experimenter with a script."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from palpate.devices.device import Block, Health, Signal, interleaved
from palpate.protocols.canonical import canonical
from palpate.protocols.events import NS, Aside, Sense
from palpate.protocols.study import Stimulus
from palpate.protocols.trial import Trial

XYZ = Signal("acceleration", ("x", "y", "z"), ("m/s^2",) * 3, 1000.0, "daq", "made up, 2026-11-01")
WAIT_S = 10.0


def rows(first, count, channels=3):
    """`count` rows whose every value is its sample's number."""
    return interleaved(*[[float(n) for n in range(first, first + count)]] * channels)


def block(first, count, at_s=None, *, channels=3, rate_hz=1000.0, **also):
    """A block that is there as soon as its last sample is."""
    at_s = (first + count - 1) / rate_hz if at_s is None else at_s
    return Block(first, rows(first, count, channels), round(at_s * NS), **also)


@dataclass
class Time:
    """Time that a test lets pass."""

    t_ns: int = 0

    def __call__(self):
        return self.t_ns

    def pass_s(self, seconds):
        self.t_ns += round(seconds * NS)


@dataclass
class Fed:
    """A sensor that gives what it is fed, on the thread that reads it; errors that it is fed are raised there."""

    name: str = "vibration"
    signal: Signal = XYZ
    at_start: Exception | None = None
    at_stop: Exception | None = None
    log: list[str] = field(default_factory=list)
    given: queue.Queue = field(default_factory=queue.Queue)
    fed: int = 0
    passed: int = 0
    changed: threading.Condition = field(default_factory=threading.Condition)

    @property
    def signals(self):
        return (self.signal,)

    def open(self):
        self.log.append("open")

    def safe(self):
        self.log.append("safe")

    def close(self):
        self.log.append("close")

    def describe(self):
        return {"kind": "fed"}

    def health(self, seconds):
        return Health(True, "well")

    def expect(self, scene):
        self.log.append(f"expect {scene}")

    def start(self, now_ns):
        if self.at_start is not None:
            raise self.at_start
        self.log.append("start")

    def stop(self):
        self.log.append("stop")
        if self.at_stop is not None:
            raise self.at_stop

    def read(self, timeout_s):
        with self.changed:
            self.passed = self.fed - self.given.qsize()
            self.changed.notify_all()
        try:
            one = self.given.get(timeout=timeout_s) if timeout_s else self.given.get_nowait()
        except queue.Empty:
            return {}
        if isinstance(one, Exception):
            with self.changed:
                self.passed = self.fed
                self.changed.notify_all()
            raise one
        return {self.signal.name: (one,)}

    def feed(self, *what):
        """Give it blocks or an error, and wait until the thread has passed them on."""
        with self.changed:
            for one in what:
                self.fed += 1
                self.given.put(one)
            assert self.changed.wait_for(lambda: self.passed == self.fed, WAIT_S)


def fed_until(condition, what=WAIT_S):
    """Wait, bounded, until another thread has made something so."""
    done = threading.Event()
    for _ in range(round(what / 0.01)):
        if condition():
            return
        done.wait(0.01)
    raise AssertionError("it did not come to pass")


@dataclass
class Window:
    """A window whose turn the test defines; while paused it does not ask whether all is ready."""

    turn: Callable[[], None]
    pages: list[str] = field(default_factory=list)
    paused: bool = False

    def wait_for(self, key, desk, ready):
        self.pages.append(key)
        for _ in range(10_000):
            if not self.paused and ready():
                return None
            if (aside := desk.poll()) is not None:
                self.paused = {"pause": True, "go_on": False}.get(aside.value["do"], self.paused)
                return aside
            self.turn()
        raise AssertionError(f"{key}: nothing came of it")


@dataclass
class Desk:
    """An experimenter who does what is scripted for a time, in seconds, and confirms at once where that is so."""

    now_ns: Time
    script: list = field(default_factory=list)
    confirms: bool = True
    prompts: list[str] = field(default_factory=list)
    demanded: object = None
    states: dict = field(default_factory=dict)
    seen: list[dict] = field(default_factory=list)

    def poll(self):
        if self.script and self.now_ns() >= self.script[0][0] * NS:
            did = self.script.pop(0)[1]
            if isinstance(did, BaseException):
                raise did
            return Aside(did)
        return None

    def demand(self, prompt):
        if prompt is not None and prompt != self.demanded:
            self.prompts.append(prompt.text)
        self.demanded = prompt

    def answer(self):
        return True if self.confirms and self.demanded is not None else None

    def tell(self, state):
        canonical(state)
        self.seen.append(dict(state))
        self.states = {k: v for k, v in {**self.states, **state}.items() if v is not None}


def sense(seconds=2.0):
    """A request to record."""
    trial = Trial(1, "main", False, Stimulus(id="T07"), None, False, False)
    return Sense("tool", seconds, trial)


def values(chunks, stream):
    """All samples of a stream as they stand in chunks: {number: row}."""
    by_number = {}
    for chunk in chunks:
        for piece in chunk.samples:
            if piece.stream == stream:
                data = np.frombuffer(piece.data, "<f4").reshape(-1, len(piece.channels))
                by_number |= {piece.first + place: tuple(row.tolist()) for place, row in enumerate(data)}
    return by_number
