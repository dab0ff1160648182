"""A vibrator's twin on a clock that a test moves, and a window and a desk without people."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from palpate.devices.vibrator.device import make
from palpate.devices.vibrator.settings import Settings
from palpate.protocols.events import Present
from palpate.protocols.study import Stimulus
from palpate.protocols.trial import Trial

RATE = 8000
SINE = {"waveform": "sine", "frequency_hz": "200", "level_db": "-6", "seconds": "0.25"}


class Clock:
    def __init__(self):
        self.s = 0.0

    def __call__(self):
        return self.s

    def ns(self):
        return round(self.s * 1e9)


class Window:
    """A window whose frames last 10 ms; `asides` come before the frame of that number."""

    def __init__(self, clock, asides=None, frame_s=0.01):
        self.clock, self.asides, self.frame_s, self.frames = clock, dict(asides or {}), frame_s, 0

    def wait_for(self, _key, _desk, ready):
        while not ready():
            self.frames += 1
            assert self.frames < 3000, "it never ends"
            if aside := self.asides.pop(self.frames, None):
                return aside
            self.clock.s += self.frame_s
        return None


DESK = SimpleNamespace(poll=lambda: None, demand=lambda _p: None, answer=lambda: True, tell=lambda _s: None)


def bench(limits=None, **settings):
    """An open twin that moves as it is told, without delay and noise."""
    clock = Clock()
    given = {"kind": "vibrator", "driver": "twin", "rate_hz": RATE, "delay_ms": 0, "bits": 24, **settings}
    vibrator = make("shaker", Settings(**given, limits=limits or {}), Path(), clock)
    vibrator.output.shaken.coil = vibrator.output.shaken.coil.__class__(
        **{**vars(vibrator.output.shaken.coil), "noise_m_s2": 0.0}
    )
    vibrator.open()
    return vibrator, clock


def present(columns=SINE, part=None, name="a"):
    trial = Trial(1, "main", False, Stimulus(id=name, columns=columns), None, False, False)
    return Present(trial, part=part)


def run(vibrator, clock, seconds, feed=True):
    """Let time pass in frames of 10 ms."""
    for _ in range(round(seconds / 0.01)):
        clock.s += 0.01
        vibrator.feed() if feed else vibrator.check_output()


def played(vibrator):
    volts, felt = vibrator.output.whole()
    return np.asarray(volts), np.asarray(felt)
