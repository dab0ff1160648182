"""A stand-in for the parts of `nidaqmx` that talk to a driver: one card with a ring buffer and one converter.

Names and signatures are compared with the installed package in `test_ni.py`; constants and errors are the package's.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from types import ModuleType

import numpy as np
from nidaqmx import constants, errors
from nidaqmx.constants import Edge, ReadRelativeTo, TerminalConfiguration, VoltageUnits

READ_ALL_AVAILABLE = constants.READ_ALL_AVAILABLE
ERROR = errors.DaqError


@dataclass
class Card:
    """What is plugged in. Time passes by `wait` only."""

    inputs: tuple[str, ...] = tuple(f"Dev1/ai{n}" for n in range(16))
    fastest_hz: float = 1e6
    timebase_hz: float = 100e6
    now_s: float = 0.0
    holder: object = None
    broken: int = 0
    """The code of an error that every call gives from now on."""
    stalled: bool = False
    closed: list[str] = field(default_factory=list)

    def elapsed_s(self) -> float:
        return self.now_s

    def wait(self, seconds: float) -> None:
        self.now_s += seconds

    def volts(self, first: int, count: int, channels: int) -> np.ndarray:
        """Sample n of channel c is n / 1000 + c: what is lost shows in what comes."""
        return (np.arange(first, first + count) / 1000 + np.arange(channels)[:, None]).astype(float)

    def check(self) -> None:
        if self.broken:
            raise ERROR(f"The card said {self.broken}.\nProperty: none", self.broken, "task")


@dataclass
class State:
    """One task: its arguments and its position."""

    card: Card
    channels: list[str] = field(default_factory=list)
    arguments: dict[str, object] = field(default_factory=dict)
    rate_hz: float = 0.0
    buffer: int = 0
    overwrite: object = constants.OverwriteMode.DO_NOT_OVERWRITE_UNREAD_SAMPLES
    relative_to: object = ReadRelativeTo.CURRENT_READ_POSITION
    offset: int = 0
    position: int = 0
    started_s: float | None = None
    overrun: bool = False

    @property
    def acquired(self) -> int:
        if self.started_s is None or self.card.stalled:
            return self.position
        return int((self.card.now_s - self.started_s) * self.rate_hz + 1e-9)

    def read(self, count: int) -> np.ndarray:
        self.card.check()
        first = self.position
        if self.relative_to is ReadRelativeTo.MOST_RECENT_SAMPLE:
            first = self.acquired + self.offset
        if self.acquired - first > self.buffer:
            if self.overwrite is constants.OverwriteMode.DO_NOT_OVERWRITE_UNREAD_SAMPLES:
                raise errors.DaqReadError("stopped", -200222, 0)
            raise errors.DaqReadError("The application is not able to keep up.\n", -200279, 0)
        if first + count > self.acquired:
            raise errors.DaqReadError("not yet", -200284, 0)
        self.position = first + count
        return self.card.volts(first, count, len(self.channels))


class AIChannelCollection:
    def __init__(self, state):
        self.state = state

    def add_ai_voltage_chan(
        self,
        physical_channel,
        name_to_assign_to_channel="",
        terminal_config=TerminalConfiguration.DEFAULT,
        min_val=-5.0,
        max_val=5.0,
        units=VoltageUnits.VOLTS,
        custom_scale_name="",
    ):
        self.state.card.check()
        names = physical_channel.split(",")
        if missing := set(names) - set(self.state.card.inputs):
            devices = {name.partition("/")[0] for name in self.state.card.inputs}
            absent = any(name.partition("/")[0] not in devices for name in missing)
            raise ERROR("no such thing", -200220 if absent else -200170)
        self.state.channels += names
        self.state.arguments |= {"terminals": terminal_config, "range": (min_val, max_val)}


class Timing:
    def __init__(self, state):
        self.state = state

    def cfg_samp_clk_timing(
        self,
        rate,
        source="",
        active_edge=Edge.RISING,
        sample_mode=constants.AcquisitionType.FINITE,
        samps_per_chan=1000,
    ):
        self.state.arguments |= {"mode": sample_mode, "asked": samps_per_chan}
        if rate * len(self.state.channels) > self.state.card.fastest_hz:
            raise ERROR("too fast", -200081)
        base = self.state.card.timebase_hz
        self.state.rate_hz = base / round(base / rate)

    @property
    def samp_clk_rate(self):
        return self.state.rate_hz

    @samp_clk_rate.setter
    def samp_clk_rate(self, val):
        self.state.rate_hz = val


def _held(name):
    return property(lambda self: getattr(self.state, name), lambda self, val: setattr(self.state, name, val))


class InStream:
    def __init__(self, task):
        self._task = task
        self.state = task.state

    input_buf_size = _held("buffer")
    overwrite = _held("overwrite")
    relative_to = _held("relative_to")
    offset = _held("offset")

    @property
    def avail_samp_per_chan(self):
        self.state.card.check()
        return max(0, self.state.acquired - self.state.position)

    @property
    def curr_read_pos(self):
        return self.state.position


class AnalogMultiChannelReader:
    def __init__(self, task_in_stream):
        self.stream = task_in_stream

    def read_many_sample(self, data, number_of_samples_per_channel=READ_ALL_AVAILABLE, timeout=10.0):
        assert data.shape == (len(self.stream.state.channels), number_of_samples_per_channel)
        assert data.flags.c_contiguous
        assert data.dtype == np.float64
        data[:] = self.stream.state.read(number_of_samples_per_channel)
        return number_of_samples_per_channel


class Device:
    def __init__(self, name, *, grpc_options=None):
        self.name = name

    @property
    def product_type(self):
        return "USB-6351"

    @property
    def serial_num(self):
        return 0x1A2B3C4

    @property
    def is_simulated(self):
        return False


def task_class(card: Card):
    class Task:
        def __init__(self, new_task_name="", *, grpc_options=None):
            card.check()
            self.state = State(card)

        @property
        def ai_channels(self):
            return AIChannelCollection(self.state)

        @property
        def timing(self):
            return Timing(self.state)

        @property
        def in_stream(self):
            return InStream(self)

        def control(self, action):
            if action is constants.TaskMode.TASK_COMMIT:
                if card.holder not in (None, self):
                    raise ERROR("The specified resource is reserved.", -50103)
                card.holder = self

        def start(self):
            card.check()
            self.state.started_s, self.state.position = card.now_s, 0

        def stop(self):
            card.check()
            self.state.started_s = None

        def close(self):
            card.closed.append("closed")
            card.holder = None if card.holder is self else card.holder
            card.check()

    return Task


def plug_in(monkeypatch, card: Card) -> None:
    """Put the stand-in where `import nidaqmx` finds it."""
    fake, readers, system = ModuleType("nidaqmx"), ModuleType("nidaqmx.stream_readers"), ModuleType("nidaqmx.system")
    readers.AnalogMultiChannelReader, system.Device = AnalogMultiChannelReader, Device
    fake.Task, fake.constants, fake.errors = task_class(card), constants, errors
    fake.stream_readers, fake.system = readers, system
    for name, module in (("", fake), (".stream_readers", readers), (".system", system)):
        monkeypatch.setitem(sys.modules, f"nidaqmx{name}", module)
