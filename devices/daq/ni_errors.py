"""What NI-DAQmx error codes mean to a lab: what may be had, what is lost, and what to do.

Codes and their names are those of `nidaqmx.error_codes`; a test compares them with the installed package.
"""

from __future__ import annotations

from collections.abc import Callable

from palpate.devices.signals import DeviceError, DeviceFault

OVERWRITTEN = -200279
"""SAMPLES_NO_LONGER_AVAILABLE: unread samples were overwritten; sampling goes on, and the loss can be counted."""
NO_DRIVER = {"DaqNotFoundError", "DaqNotSupportedError", "DaqFunctionNotSupportedError"}
"""What the package raises where the maker's driver is not installed, or too old."""
NOT_YET = -200284
"""SAMPLES_NOT_YET_AVAILABLE: fewer have come than were asked for; no error here."""

STOPPED = {
    -200222: "ACQ_STOPPED_TO_PREVENT_INPUT_BUFFER_OVERWRITE",
    -200278: "SAMPLES_WILL_NEVER_BE_AVAILABLE",
    -200283: "ACQ_STOPPED_TO_PREVENT_INTERMEDIATE_BUFFER_OVERFLOW",
    -200361: "INPUT_FIFO_OVERFLOW_2",
    -200010: "INPUT_FIFO_OVERFLOW",
    -200613: "ACQ_STOPPED_TO_PREVENT_INPUT_BUFFER_OVERWRITE_ONE_DATA_XFER_MECH",
    -209829: "INPUT_FIFO_OVERFLOW_3",
}
"""The card stopped because samples could not be stored: how many are missing cannot be said."""
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
    (RATE, "the card cannot sample so many inputs so fast; lower `rate_hz`"),
    (VALUE, "the card cannot do that rate, range or wiring; see `rate_hz`, `range_V` and `terminals`"),
)


def refused(name: str, code: int, message: str) -> DeviceError:
    """Why a card cannot be had, in words that say what to do."""
    todo = next((words for codes, words in _REFUSED if code in codes), "see the NI-DAQmx message")
    return DeviceError(f"{name}: {todo}. NI-DAQmx {code}: {first_line(message)}")


def failed(name: str, code: int, message: str) -> DeviceFault:
    """What a card did while it sampled."""
    told = f"NI-DAQmx {code}: {first_line(message)}"
    if code in STOPPED or code == OVERWRITTEN:
        why = "samples came faster than they were stored, and how many are missing cannot be said"
        return DeviceFault(name, "overrun", f"{name}: {why}; lower `rate_hz` or raise `buffer_s`. {told}")
    if code in GONE:
        return DeviceFault(name, "link_lost", f"{name}: the card is gone; see its cable and power. {told}")
    return DeviceFault(name, "refused", f"{name}: the card refused to go on. {told}")


def first_line(message: str, otherwise: str = "no message") -> str:
    """What of a long message is told."""
    return next((line.strip() for line in message.splitlines() if line.strip()), otherwise)


def code_of(error: BaseException) -> int:
    """The driver's code of an error; 0 of one that is not the driver's."""
    return int(getattr(error, "error_code", 0))


def quietly(act: Callable[[], None]) -> None:
    """Let go of a card that may be gone; what it says to that helps nobody any more."""
    try:
        act()
    except Exception as error:
        if not code_of(error):
            raise
