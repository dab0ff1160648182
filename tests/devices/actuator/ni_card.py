"""An NI card with one analog output as nidaqmx shows it: a buffer without regeneration, played by virtual time."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import nidaqmx.constants
import numpy as np
from nidaqmx.errors import DaqError


@dataclass
class Card:
    """`voltages` is what the output gave, one value a millisecond while a buffer plays, then each written one."""

    fails: dict = field(default_factory=dict)
    ms: int = 0
    voltages: list = field(default_factory=list)
    tasks: list = field(default_factory=list)

    def Task(self):
        self.fail("task")
        self.tasks.append(Task(self))
        return self.tasks[-1]

    constants = nidaqmx.constants

    def fail(self, act):
        if act in self.fails:
            raise DaqError(f"The {act} failed.\nTask Name: _unnamed", self.fails[act])

    def pass_ms(self, count):
        for _ in range(count):
            self.ms += 1
            for task in self.tasks:
                task.tick()


@dataclass
class Task:
    card: Card
    buffer: list = field(default_factory=list)
    generated: int = 0
    running: bool = False
    closed: bool = False
    empty: bool = False
    settings: dict = field(default_factory=dict)

    def __post_init__(self):
        self.ao_channels = SimpleNamespace(add_ao_voltage_chan=self.add)
        self.timing = SimpleNamespace(cfg_samp_clk_timing=self.clocked)
        self.out_stream = OutStream(self)

    def add(self, channel, min_val, max_val):
        self.card.fail("channel")
        self.settings |= {"channel": channel, "range": (min_val, max_val)}

    def clocked(self, rate, sample_mode, samps_per_chan):
        self.settings |= {"rate": rate, "mode": sample_mode.name}

    def control(self, mode):
        self.card.fail("reserve")

    def start(self):
        self.card.fail("start")
        self.running = True

    def write(self, data, auto_start, timeout=10.0):
        self.demand()
        self.card.fail("write")
        if np.isscalar(data):
            self.card.voltages.append(float(data))
            return
        free = self.out_stream.output_buf_size - (len(self.buffer) - self.generated)
        assert len(data) <= free, "more was written than fits: this would wait"
        self.buffer += [float(sample) for sample in data]

    def demand(self):
        if self.empty:
            raise DaqError("The generation has stopped to prevent the regeneration of old samples.", -200290)

    def tick(self):
        if not self.running:
            return
        if self.generated == len(self.buffer):
            self.empty, self.running = True, False
            return
        self.card.voltages.append(self.buffer[self.generated])
        self.generated += 1

    def stop(self):
        self.running = False

    def close(self):
        self.closed = True


@dataclass
class OutStream:
    task: Task
    regen_mode: object = None
    output_buf_size: int = 0

    @property
    def total_samp_per_chan_generated(self):
        self.task.card.fail("ask")
        self.task.demand()
        return self.task.generated
