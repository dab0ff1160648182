"""National Instruments cards through the `nidaqmx` package, which is imported only when a card is opened.

Codes and names of errors are those of `nidaqmx.error_codes`; a test compares them with the installed package.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from palpate.devices.daq.acquire import POLL_S, Pace, Taken, Volts, Wiring
from palpate.devices.device import DeviceError, DeviceFault

if TYPE_CHECKING:
    from palpate.devices.scene import Scene

RATE_TOLERANCE = 1e-4
"""Greatest deviation of the actual rate from the requested one. A card divides its clock, so few rates are met exactly;
this is as small as the drift of two clocks, which the record shows anyway.
"""
KEPT = 0.5
"""Share of the buffer that is read after an overrun: the rest of it is being overwritten."""
OVERWRITTEN = -200279
"""SAMPLES_NO_LONGER_AVAILABLE: unread samples were overwritten; sampling goes on, and the loss can be counted."""
NO_DRIVER = {"DaqNotFoundError", "DaqNotSupportedError", "DaqFunctionNotSupportedError"}
"""Errors of the package if the maker's driver is not installed or too old."""
NOT_YET = -200284
"""SAMPLES_NOT_YET_AVAILABLE: fewer samples than requested have arrived; not an error here."""
STOPPED = {
    -200222: "ACQ_STOPPED_TO_PREVENT_INPUT_BUFFER_OVERWRITE",
    -200278: "SAMPLES_WILL_NEVER_BE_AVAILABLE",
    -200283: "ACQ_STOPPED_TO_PREVENT_INTERMEDIATE_BUFFER_OVERFLOW",
    -200361: "INPUT_FIFO_OVERFLOW_2",
    -200010: "INPUT_FIFO_OVERFLOW",
    -200613: "ACQ_STOPPED_TO_PREVENT_INPUT_BUFFER_OVERWRITE_ONE_DATA_XFER_MECH",
    -209829: "INPUT_FIFO_OVERFLOW_3",
}
"""Errors of a card that stopped because samples could not be stored; how many are missing is unknown."""
GONE = {
    -200220: "INVALID_DEVICE_ID",
    -200324: "DEV_ABSENT_OR_UNAVAILABLE",
    -201003: "DEV_CANNOT_BE_ACCESSED",
    -88705: "DRIVER_DEVICE_GUID_NOT_FOUND_ROUTING",
    -88710: "RUNTIME_ABORTING_ROUTING",
    -89130: "DEV_ABSENT_OR_UNAVAILABLE_ROUTING",
    -50405: "PAL_TRANSFER_ABORTED",
}
INPUTS = {
    -200170: "PHYSICAL_CHAN_DOES_NOT_EXIST",
    -200086: "INVALID_SYNTAX_FOR_PHYSICAL_CHANNEL_RANGE",
    -200099: "PHYSICAL_CHANNEL_NOT_SPECIFIED",
}
RESERVED = {
    -50103: "PAL_RESOURCE_RESERVED",
    -200022: "RESOURCE_ALREADY_RESERVED",
    -201105: "RESOURCE_RESERVED_WITH_CONFLICTING_SETTINGS",
}
RATE = {
    -200081: "SAMPLE_RATE_NUM_CHANS_CONVERT_PERIOD_COMBO",
    -200331: "SAMP_RATE_TOO_LOW",
    -200332: "SAMP_RATE_TOO_HIGH",
    -200335: "AI_CONV_RATE_TOO_HIGH",
    -209834: "SAMPLE_RATE_NUM_CHANS_OR_ATTRIBUTE_VALUES",
}
VALUE = {-200077: "INVALID_ATTRIBUTE_VALUE"}
_REFUSED = (
    (GONE, "the card is not there; see its cable and power, and its name in NI MAX"),
    (INPUTS, "the card has no such input; correct `channels`"),
    (
        RESERVED,
        "another program samples on this card, which has one converter for all its inputs; end that program",
    ),
    (RATE, "the card cannot sample this many inputs at this rate; lower `rate_hz`"),
    (VALUE, "the card cannot do that rate, range or wiring; see `rate_hz`, `range_V` and `terminals`"),
)


@dataclass
class NiDaq:
    """A card that samples continuously by its own clock into a ring buffer that the driver fills.

    If it is not read in time, the oldest samples are overwritten and counted, and sampling goes on. `further` inputs
    with ranges of their own are sampled by the same clock; their columns come last.
    """

    name: str
    wiring: Wiring
    further: tuple[Wiring, ...] = ()
    task: Any = None
    reader: Any = None
    pace: Pace | None = None
    position: int = 0
    card_facts: dict[str, str] = field(default_factory=dict)

    @property
    def columns(self) -> int:
        """Return how many inputs are sampled."""
        return sum(len(wiring.channels) for wiring in (self.wiring, *self.further))

    @property
    def facts(self) -> Mapping[str, str]:
        """Return product, serial number and the actual rate of the card."""
        return self.card_facts

    def open(self) -> None:
        """Create and commit the task. Raises DeviceError: no package, no driver, no card, in use, impossible rate."""
        self.close()
        nidaqmx = _package(self.name)
        try:
            self.task = nidaqmx.Task()
            constants, wiring = nidaqmx.constants, self.wiring
            for wired in (wiring, *self.further):
                terminals = getattr(constants.TerminalConfiguration, wired.terminals.upper())
                self.task.ai_channels.add_ai_voltage_chan(
                    ",".join(wired.channels), terminal_config=terminals, min_val=wired.low_V, max_val=wired.high_V
                )
            self.task.timing.cfg_samp_clk_timing(
                wiring.rate_hz, sample_mode=constants.AcquisitionType.CONTINUOUS, samps_per_chan=wiring.buffer
            )
            self.task.in_stream.input_buf_size = wiring.buffer
            self.task.in_stream.overwrite = constants.OverwriteMode.OVERWRITE_UNREAD_SAMPLES
            self.task.control(constants.TaskMode.TASK_COMMIT)
            self.reader = nidaqmx.stream_readers.AnalogMultiChannelReader(self.task.in_stream)
            real_hz = float(self.task.timing.samp_clk_rate)
            if abs(real_hz - self.wiring.rate_hz) > RATE_TOLERANCE * self.wiring.rate_hz:
                raise DeviceError(
                    f"{self.name}: the card can sample at {real_hz:g} Hz, not at {self.wiring.rate_hz:g};"
                    f" write `rate_hz: {real_hz:g}`"
                )
            device = nidaqmx.system.Device(self.wiring.channels[0].partition("/")[0])
            self.card_facts = {
                "card": str(device.product_type), "serial": f"{int(device.serial_num):X}", "rate_hz": f"{real_hz:.9g}",
                **({"simulated": "by NI-DAQmx"} if device.is_simulated else {}),
            }  # fmt: skip
        except Exception as error:
            self.close()
            _raise_opening(self.name, error)

    def expect(self, scene: Scene | None) -> None:
        """Do nothing: a real card senses the real scene."""

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
        """Return the samples that have arrived; their count is queried first, so that a read never waits or is
        partial.
        """
        nothing = Taken(np.empty((0, self.columns)))
        if self.pace is None:
            return nothing
        try:
            # Wait until there is enough for a read, or the time is over.
            enough = max(1, round(self.wiring.rate_hz * min(POLL_S, timeout_s)))
            end = self.pace.elapsed_s() + timeout_s
            while (there := int(self.task.in_stream.avail_samp_per_chan)) < enough and self.pace.elapsed_s() < end:
                self.pace.wait(min(POLL_S, timeout_s))
            count = min(there, most)
            return Taken(self._read(count)) if count else nothing
        except Exception as error:
            if code_of(error) == NOT_YET:
                return nothing
            if code_of(error) != OVERWRITTEN:
                raise failed(self.name, code_of(error), str(error)) from error
        return self._recover(most)

    def stop(self) -> None:
        """Stop sampling; a card that is gone by then is not an error."""
        if self.task is not None and self.pace is not None:
            quietly(self.task.stop)
        self.pace = None

    def close(self) -> None:
        """Release the inputs."""
        self.stop()
        if self.task is not None:
            quietly(self.task.close)
        self.task = self.reader = None

    def _read(self, count: int) -> Volts:
        volts = np.empty((self.columns, count))
        came = int(self.reader.read_many_sample(volts, number_of_samples_per_channel=count, timeout=0.0))
        self.position += came
        return volts[:, :came].T

    def _recover(self, most: int) -> Taken:
        """Go on with the newest samples; the driver's own count of samples says how many were skipped."""
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
    """Raise an error on opening a card as DeviceError if it has a known cause; raise any other as it is."""
    if type(error).__name__ in NO_DRIVER:
        raise DeviceError(
            f"{name}: the NI-DAQmx driver is not installed on this machine, or too old; install it from ni.com and"
            f" restart, or write `driver: twin`. nidaqmx: {error}"
        ) from error
    if code_of(error):
        raise refused(name, code_of(error), str(error)) from error
    raise error


def refused(name: str, code: int, message: str) -> DeviceError:
    """Return an error for a card that is not available, with advice."""
    todo = next((words for codes, words in _REFUSED if code in codes), "see the NI-DAQmx message")
    return DeviceError(f"{name}: {todo}. NI-DAQmx {code}: {first_line(message)}")


def failed(name: str, code: int, text: str) -> DeviceFault:
    """Return the fault of a card that failed while it sampled."""
    reported = f"NI-DAQmx {code}: {first_line(text)}"
    if code in STOPPED or code == OVERWRITTEN:
        why = "samples came faster than they were stored, and how many are missing is unknown"
        return DeviceFault(name, "overrun", f"{name}: {why}; lower `rate_hz` or raise `buffer_s`. {reported}")
    if code in GONE:
        return DeviceFault(name, "link_lost", f"{name}: the card is gone; see its cable and power. {reported}")
    return DeviceFault(name, "refused", f"{name}: the card refused to continue. {reported}")


def first_line(message: str, otherwise: str = "no message") -> str:
    """Return the first line of a long message."""
    return next((line.strip() for line in message.splitlines() if line.strip()), otherwise)


def code_of(error: BaseException) -> int:
    """Return the driver's code of an error; 0 where the error is not the driver's."""
    return int(getattr(error, "error_code", 0))


def quietly(act: Callable[[], None]) -> None:
    """Release a card that may be gone, and ignore its errors."""
    try:
        act()
    except Exception as error:
        if not code_of(error):
            raise
