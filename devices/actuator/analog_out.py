"""An analog output of a National Instruments card, timed by the card's own clock at 1 kHz."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np

from palpate.devices.actuator.queue import RAMP, RATE_HZ
from palpate.devices.daq.ni import GONE, INPUTS, NO_DRIVER, RESERVED, code_of, first_line, quietly
from palpate.devices.device import DeviceError, DeviceFault
from palpate.devices.sound.output import DRAIN_S, Fill
from palpate.signals.arrays import Array

EMPTY = {
    -200290: "GEN_STOPPED_TO_PREVENT_REGEN_OF_OLD_SAMPLES",
    -200291: "GEN_STOPPED_TO_PREVENT_INTERMEDIATE_BUFFER_REGEN_OF_OLD_SAMPLES",
    -200018: "DAC_UNDERFLOW",
    -200016: "OUTPUT_FIFO_UNDERFLOW",
    -200621: "OUTPUT_FIFO_UNDERFLOW_2",
}
"""Errors of a card that stopped because nothing was left to play; it holds its last voltage."""
PULLED = {-200045: "DEVICE_REMOVED", -200175: "HARDWARE_NOT_RESPONDING"}
LOOK_S = 0.002
KEPT = 4096
"""Number of samples that are remembered, to know which one the card played last."""


def nidaqmx() -> Any:
    """Return the nidaqmx package. Raise DeviceError where it is not installed."""
    try:
        for part in ("constants", "stream_writers"):
            import_module(f"nidaqmx.{part}")
        return import_module("nidaqmx")
    except ImportError:
        raise DeviceError("the package nidaqmx is not installed: pip install 'palpate[rig]'") from None


@dataclass
class AnalogOut:
    """An output with a buffer of `ahead` samples in the card, without regeneration, refilled every 2 ms by a thread."""

    name: str
    channel: str
    range_V: float
    ahead: int
    package: Callable[[], Any] = nidaqmx
    pause: Callable[[float], None] = time.sleep
    rate_hz: float = RATE_HZ
    _task: Any = None
    _fill: Fill | None = None
    _fault: DeviceFault | None = None
    _written: int = 0
    _played: Array = field(default_factory=lambda: np.zeros(0))
    _end: threading.Event = field(default_factory=threading.Event)
    _thread: threading.Thread | None = None
    _lock: threading.RLock = field(default_factory=threading.RLock)

    @property
    def latency_s(self) -> float:
        """Return how long a sample waits in the card, in seconds."""
        return self.ahead / self.rate_hz

    def wait_s(self) -> float:
        """Return how long the samples last that are in the card, in seconds; before it has begun, its latency."""
        task = self._task
        try:
            played = int(task.out_stream.total_samp_per_chan_generated)
        except Exception:
            return self.latency_s
        return max(0.0, (self._written - played) / self.rate_hz)

    def open(self) -> None:
        """Reserve the output and release it again, to detect problems now. Raises DeviceError."""
        task = self._reserved()
        task.close()

    def start(self, fill: Fill) -> None:
        """Fill the card's buffer and begin. Raises DeviceError."""
        self.stop()
        self._task = self._reserved()
        self._fill, self._fault, self._written, self._played = fill, None, 0, np.zeros(0)
        try:
            self._write(self.ahead)
            self._task.start()
        except Exception as error:
            self.stop()
            raise _refused(self.name, self.channel, error) from error
        self._end.clear()
        self._thread = threading.Thread(target=self._go_on, name=f"{self.name} output", daemon=True)
        self._thread.start()

    def _reserved(self) -> Any:
        package = self.package()
        task = None
        try:
            task = package.Task()
            task.ao_channels.add_ao_voltage_chan(self.channel, min_val=-self.range_V, max_val=self.range_V)
            continuous = package.constants.AcquisitionType.CONTINUOUS
            task.timing.cfg_samp_clk_timing(self.rate_hz, sample_mode=continuous, samps_per_chan=self.ahead)
            task.out_stream.regen_mode = package.constants.RegenerationMode.DONT_ALLOW_REGENERATION
            task.out_stream.output_buf_size = self.ahead
            task.control(package.constants.TaskMode.TASK_RESERVE)
        except Exception as error:
            if task is not None:
                task.close()
            raise _refused(self.name, self.channel, error) from error
        return task

    def _go_on(self) -> None:
        while not self._end.wait(LOOK_S) and self.feed():
            pass

    def feed(self) -> bool:
        """Write as many samples as the card has played since; return False once it failed."""
        with self._lock:
            if self._task is None:
                return False
            try:
                played = int(self._task.out_stream.total_samp_per_chan_generated)
                self._write(self.ahead - (self._written - played))
            except Exception as error:
                self._fault = self._fault or _failed(self.name, error)
                self._silence()
                return False
            return True

    def _write(self, count: int) -> None:
        if count > 0 and self._fill is not None:
            part = self._fill(count)
            self._task.write(part, auto_start=False, timeout=0.0)
            self._written += count
            self._played = np.concatenate([self._played, part])[-KEPT:]

    def cut(self) -> None:
        """Drop the samples in the card and ramp from the last voltage to 0 V in 4 ms; `start` begins anew."""
        with self._lock:
            self._silence()

    def _silence(self) -> None:
        """Ramp the output to zero, one written voltage at a time: a stopped card holds its last voltage."""
        task, self._task = self._task, None
        if task is None:
            return
        last = self._last(task)
        quietly(task.stop)
        quietly(task.close)
        quietly(lambda: self._lead_down(last))

    def _last(self, task: Any) -> float:
        """Return the voltage that the card plays now; 0 if it is no longer known."""
        try:
            behind = self._written - int(task.out_stream.total_samp_per_chan_generated)
        except Exception:
            behind = 0
        place = len(self._played) - 1 - max(behind, 0)
        return float(self._played[place]) if 0 <= place < len(self._played) else 0.0

    def _lead_down(self, last: float) -> None:
        task = self.package().Task()
        try:
            task.ao_channels.add_ao_voltage_chan(self.channel, min_val=-self.range_V, max_val=self.range_V)
            for voltage in last * RAMP if last else (0.0,):
                task.write(float(voltage), auto_start=True)
                self.pause(1 / RATE_HZ)
        finally:
            task.close()

    def drain(self, silent: threading.Event) -> None:
        """Wait until the end of the ramp has reached the card's output."""
        if self._task is not None and silent.wait(DRAIN_S):
            self.pause(self.latency_s)

    def stop(self) -> None:
        """End the thread, bring the output to 0 V, and release it."""
        self._end.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        self._thread = None
        self.cut()
        self._fill = None

    def fault(self) -> DeviceFault | None:
        """Return the fault of a failed card, else None."""
        return self._fault

    def facts(self) -> Mapping[str, str]:
        """Return the output's channel, rate and latency."""
        return {"output": self.channel, "rate": f"{self.rate_hz:g} Hz", "latency": f"{1000 * self.latency_s:g} ms"}


def _refused(name: str, channel: str, error: Exception) -> DeviceError:
    """Return an error for an output that is not available, with advice."""
    if type(error).__name__ in NO_DRIVER:
        return DeviceError(f"{name}: the NI-DAQmx driver is not installed on this machine: install it from ni.com")
    if isinstance(error, DeviceError):
        return error
    todo = {
        **dict.fromkeys(GONE | PULLED, "the card is not there: see its cable and power, and its name in NI MAX"),
        **dict.fromkeys(INPUTS, "the card has no such output: correct `channel`"),
        **dict.fromkeys(RESERVED, "another program uses this output: end it"),
    }.get(code_of(error), "see the NI-DAQmx message")
    return DeviceError(f"{name}: {channel}: {todo}. NI-DAQmx {code_of(error)}: {_line(error)}")


def _failed(name: str, error: Exception) -> DeviceFault:
    """Return the fault of a card that failed while it played."""
    message = f"NI-DAQmx {code_of(error)}: {_line(error)}"
    if code_of(error) in EMPTY:
        return DeviceFault(name, "underrun", f"{name}: the output ran out of samples; raise `ahead_ms`. {message}")
    if code_of(error) in GONE | PULLED:
        return DeviceFault(name, "link_lost", f"{name}: the card is gone: see its cable and power. {message}")
    return DeviceFault(name, "refused", f"{name}: the card refused to continue. {message}")


def _line(error: Exception) -> str:
    return first_line(str(error), type(error).__name__)
