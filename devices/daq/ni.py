"""A National Instruments card through the `nidaqmx` package, which is imported only when one is opened."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from palpate.devices.daq.acquire import Pace, Taken, Volts, Wiring
from palpate.devices.daq.ni_errors import NO_DRIVER, NOT_YET, OVERWRITTEN, code_of, failed, quietly, refused
from palpate.devices.signals import DeviceError

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

TOLD_S = 0.005
"""A read waits for about so much, so that it is not woken for every sample."""
RATE_TOLERANCE = 1e-4
"""How far the real rate may lie from the one asked for. A card divides its clock, so few rates are met exactly; what is
let pass here is as small as the drift of two clocks, which the record shows anyway."""
KEPT = 0.5
"""What is gone on with after an overrun, as a share of the buffer: the rest of it is being written over."""


@dataclass
class NiDaq:
    """Continuous sampling by the card's own clock into a ring buffer that the driver fills.

    Where it is not read in time the oldest samples are overwritten, counted, and sampling goes on. `further` inputs in
    ranges of their own are sampled by the same clock; their columns follow.
    """

    name: str
    wiring: Wiring
    further: tuple[Wiring, ...] = ()
    task: Any = None
    reader: Any = None
    pace: Pace | None = None
    position: int = 0
    told: dict[str, str] = field(default_factory=dict)

    @property
    def columns(self) -> int:
        """How many inputs are sampled."""
        return sum(len(wiring.channels) for wiring in (self.wiring, *self.further))

    @property
    def facts(self) -> Mapping[str, str]:
        """Product, serial number and the rate that the card really runs at."""
        return self.told

    def open(self) -> None:
        """Make and commit the task. Raises DeviceError: no package, no driver, no card, taken, rate not possible."""
        self.close()
        nidaqmx = _package(self.name)
        try:
            self.task = nidaqmx.Task()
            self._configure(nidaqmx)
            self._demand_rate(float(self.task.timing.samp_clk_rate))
            self.told = _facts(nidaqmx, self.wiring, float(self.task.timing.samp_clk_rate))
        except Exception as error:
            self.close()
            _raise_opening(self.name, error)

    def expect(self, scene: Scene | None) -> None:
        """Nothing: what is sensed is there."""

    def start(self, pace: Pace) -> None:
        """Begin to sample. Raises DeviceError."""
        if self.task is None:
            raise DeviceError(f"{self.name}: the card is not open")
        self.stop()
        try:
            self.task.start()
        except Exception as error:
            _raise_opening(self.name, error)
        self.pace, self.position = pace, 0

    def read(self, most: int, timeout_s: float) -> Taken:
        """What has come. A count is asked for first, so that a read never has to wait or give a part."""
        nothing = Taken(np.empty((0, self.columns)))
        if self.pace is None:
            return nothing
        try:
            count = min(self._available(self.pace, timeout_s), most)
            return Taken(self._read(count)) if count else nothing
        except Exception as error:
            if code_of(error) == NOT_YET:
                return nothing
            if code_of(error) != OVERWRITTEN:
                raise failed(self.name, code_of(error), str(error)) from error
        return self._recover(most)

    def stop(self) -> None:
        """End sampling; a card that is gone by then is no news."""
        if self.task is not None and self.pace is not None:
            quietly(self.task.stop)
        self.pace = None

    def close(self) -> None:
        """Give the inputs back."""
        self.stop()
        if self.task is not None:
            quietly(self.task.close)
        self.task = self.reader = None

    def _configure(self, nidaqmx: Any) -> None:
        constants, wiring = nidaqmx.constants, self.wiring
        for each in (wiring, *self.further):
            terminals = getattr(constants.TerminalConfiguration, each.terminals.upper())
            self.task.ai_channels.add_ai_voltage_chan(
                ",".join(each.channels), terminal_config=terminals, min_val=each.low_V, max_val=each.high_V
            )
        self.task.timing.cfg_samp_clk_timing(
            wiring.rate_hz, sample_mode=constants.AcquisitionType.CONTINUOUS, samps_per_chan=wiring.buffer
        )
        self.task.in_stream.input_buf_size = wiring.buffer
        self.task.in_stream.overwrite = constants.OverwriteMode.OVERWRITE_UNREAD_SAMPLES
        self.task.control(constants.TaskMode.TASK_COMMIT)
        self.reader = nidaqmx.stream_readers.AnalogMultiChannelReader(self.task.in_stream)

    def _demand_rate(self, real_hz: float) -> None:
        if abs(real_hz - self.wiring.rate_hz) > RATE_TOLERANCE * self.wiring.rate_hz:
            raise DeviceError(
                f"{self.name}: the card can sample at {real_hz:g} Hz, not at {self.wiring.rate_hz:g};"
                f" write `rate_hz: {real_hz:g}`"
            )

    def _available(self, pace: Pace, timeout_s: float) -> int:
        """How many are there, once it is worth a read or the time is over."""
        wanted = max(1, round(self.wiring.rate_hz * min(TOLD_S, timeout_s)))
        end = pace.elapsed_s() + timeout_s
        while (there := int(self.task.in_stream.avail_samp_per_chan)) < wanted and pace.elapsed_s() < end:
            pace.wait(min(TOLD_S, timeout_s))
        return there

    def _read(self, count: int) -> Volts:
        volts = np.empty((self.columns, count))
        came = int(self.reader.read_many_sample(volts, number_of_samples_per_channel=count, timeout=0.0))
        self.position += came
        return volts[:, :came].T

    def _recover(self, most: int) -> Taken:
        """Go on with the newest samples; the driver's own count of samples says how many were passed over."""
        stream, before = self.task.in_stream, self.position
        count = max(1, min(most, round(KEPT * self.wiring.buffer)))
        relative = import_module("nidaqmx.constants").ReadRelativeTo
        try:
            stream.relative_to, stream.offset = relative.MOST_RECENT_SAMPLE, -count
            volts = self._read(count)
            stream.relative_to, stream.offset = relative.CURRENT_READ_POSITION, 0
            self.position = int(stream.curr_read_pos)
        except Exception as error:
            raise failed(self.name, OVERWRITTEN, str(error)) from error
        lost = self.position - len(volts) - before
        if lost < 0:
            raise failed(self.name, OVERWRITTEN, f"{lost} samples lost by the driver's count")
        return Taken(volts, lost)


def _package(name: str) -> Any:
    try:
        for part in ("constants", "errors", "stream_readers", "system"):
            import_module(f"nidaqmx.{part}")
        return import_module("nidaqmx")
    except ImportError as error:
        raise DeviceError(
            f"{name}: the package nidaqmx is not installed; pip install 'palpate[rig]', or write `driver: twin`"
        ) from error


def _raise_opening(name: str, error: Exception) -> NoReturn:
    """What failed while a card was opened, as the user's mistake that it is; anything else stays what it was."""
    if type(error).__name__ in NO_DRIVER:
        raise DeviceError(
            f"{name}: the NI-DAQmx driver is not installed on this machine, or too old; install it from ni.com and"
            f" restart, or write `driver: twin`. nidaqmx: {error}"
        ) from error
    if code_of(error):
        raise refused(name, code_of(error), str(error)) from error
    raise error


def _facts(nidaqmx: Any, wiring: Wiring, rate_hz: float) -> dict[str, str]:
    device = nidaqmx.system.Device(wiring.channels[0].partition("/")[0])
    facts = {"card": str(device.product_type), "serial": f"{int(device.serial_num):X}", "rate_hz": f"{rate_hz:.9g}"}
    if device.is_simulated:
        facts["simulated"] = "by NI-DAQmx"
    return facts
