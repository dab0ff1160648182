"""The file of an identified actuator: its response, and the filter computed from it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self, TypeVar

from pydantic import Field, ValidationError, model_validator

from palpate.devices.device import DeviceError
from palpate.devices.kinds import Date, Finite, Positive
from palpate.protocols.canonical import digest, json_text
from palpate.protocols.files import reason, write_text
from palpate.protocols.strict import Strict

S = TypeVar("S", bound=Strict)
Numbers = Annotated[list[Finite], Field(min_length=1, max_length=100_000)]


class Calibration(Strict):
    """The complete inputs and results of the filter, so that it can be examined and computed again.

    Filter: weights at 1 kHz, volts for m/s^2. Response: real and imaginary part, m/s^2 per volt, at `hz`.
    """

    kind: Literal["voice_coil_response"] = "voice_coil_response"
    format: Literal[1] = 1
    date: Date
    excitation: str
    band_Hz: tuple[Positive, Positive]
    boost_dB: Finite
    gain_m_s2_V: Positive
    ripple_dB: Finite
    before_dB: Finite
    delay_ms: Finite
    added_ms: Finite
    limited_Hz: tuple[Finite, ...] = ()
    hz: Numbers
    real: Numbers
    imaginary: Numbers
    coherence: Numbers
    h2_apart_dB: Numbers
    filter: Numbers

    @model_validator(mode="after")
    def _whole(self) -> Self:
        lengths = {len(column) for column in (self.hz, self.real, self.imaginary, self.coherence, self.h2_apart_dB)}
        if len(lengths) > 1:
            raise ValueError(f"one value per line is expected, found {sorted(lengths)} values")
        return self

    @property
    def summary(self) -> str:
        """Return one line for records and people; its digest is that of the whole file."""
        low, high = self.band_Hz
        flat = f"flat within {self.ripple_dB:.2f} dB from {low:g} to {high:g} Hz"
        return f"identified {self.date}, {flat}, sha256 {digest(self.model_dump(mode='json'))[:12]}"


def save(calibration: Calibration, path: Path) -> None:
    """Write the calibration completely or not at all. Raises DeviceError if the path cannot be written."""
    write_calibration(calibration, path)


def write_calibration(calibration: Strict, path: Path) -> None:
    """Write the calibration of any actuator, completely or not at all. Raises DeviceError."""
    try:
        write_text(path, json_text(calibration.model_dump(mode="json"), indent=1))
    except OSError as error:
        raise DeviceError(f"{path}: the calibration cannot be written: {reason(error)}") from None


def load(path: Path) -> Calibration:
    """Read a calibration. Raises DeviceError that names the file and what is wrong with it."""
    return read_calibration(path, Calibration, "voice coil", "Identify the actuator again")


def read_calibration(path: Path, schema: type[S], device: str, then: str) -> S:
    """Read the calibration of any actuator, the `device`; `then` says what to do if it is none. Raises DeviceError."""
    try:
        return schema.model_validate_json(path.read_bytes())
    except OSError as error:
        raise DeviceError(f"{path}: the {device}'s calibration cannot be read: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        problem = f"{where}: {first['msg']}"
        raise DeviceError(f"{path}: no {device} calibration: {problem}. {then}") from None
