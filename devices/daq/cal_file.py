"""The maker's calibration file of a six-axis force/torque sensor (ATI's `FTSensor` XML), as it is written.

The meaning of the elements is from the maker's C library and the note in the files: `UserAxis` rows are the calibration
matrix in the file's units; `Axis` rows divided by `scale` give it before `BasicTransform`; `BiasSlope`, `GainSlope` and
`Thermistor` are there if the temperature is compensated in software.
"""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from palpate.devices.device import DeviceError
from palpate.protocols.wording import some

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
LARGEST = 1 << 20
"""Greatest size of a file in bytes; the maker's files have about three thousand."""
SHIFTS = ("Dx", "Dy", "Dz", "Rx", "Ry", "Rz")
_DATE = re.compile(r"^(\d{1,2})/(\d{1,2})/(\d{4})$")

MatrixRow = tuple[float, ...]


@dataclass(frozen=True)
class CalFile:
    """A calibration as in the file, in the file's units.

    `user` holds the rows of `UserAxis`, `basic` those of `Axis` divided by their scale, by axis; either may be empty.
    `shift` is BasicTransform: three distances and three angles. `slopes` are (bias, gain, thermistor's reference).
    """

    serial: str
    body: str
    part: str
    date: str | None
    force_unit: str
    torque_unit: str
    distance_unit: str
    angle_unit: str
    low_V: float
    high_V: float
    user: Mapping[str, MatrixRow]
    basic: Mapping[str, MatrixRow]
    rated: Mapping[str, float]
    shift: MatrixRow
    slopes: tuple[MatrixRow, MatrixRow, float] | None
    sha256: str


def read_cal_file(path: Path) -> CalFile:
    """Return the first calibration of a file.

    Raises:
        DeviceError: the file cannot be read, is not a calibration file, or an element of it is incomplete.
    """
    try:
        size = path.stat().st_size
        data = path.read_bytes() if size <= LARGEST else b""
    except OSError as error:
        raise DeviceError(f"{path}: the calibration file cannot be read ({error.strerror})") from error
    if size > LARGEST:
        raise DeviceError(f"{path}: {size} bytes; a calibration file has at most {LARGEST}")
    return _Reader(str(path)).calibration(data)


@dataclass(frozen=True)
class _Reader:
    where: str

    def calibration(self, data: bytes) -> CalFile:
        root = self._tree(data)
        if root.tag != "FTSensor":
            raise self._wrong(f"<{root.tag}>", "the outermost element is <FTSensor>")
        if self._text(root, "NumGages").strip() != "6":
            raise self._wrong("<FTSensor NumGages>", "sensors of 6 gauges are supported")
        calibration = root.find("Calibration")
        if calibration is None:
            raise self._wrong("<FTSensor>", "a <Calibration> is expected inside")
        if self._number(calibration, "GainMultiplier", 1.0) != 1.0:
            raise self._wrong("<Calibration GainMultiplier>", "only 1 is supported: no amplifier added")
        user = {name: self._values(child, "values") for name, child in self._axes(calibration, "UserAxis").items()}
        axes, basic = self._axes(calibration, "Axis"), dict[str, MatrixRow]()
        for name, child in axes.items():
            scale = self._number(child, "scale", 1.0)
            if scale == 0:
                raise self._wrong(_called(child, "scale"), "0 divides nothing")
            basic[name] = tuple(value / scale for value in self._values(child, "values"))
        if not user and not basic:
            raise self._wrong("<Calibration>", "rows named UserAxis or Axis are expected inside")
        # The gauges' volts: OutputRange wide, on both sides of zero where OutputBipolar says so.
        width = self._number(calibration, "OutputRange", 20.0)
        if not 0 < width <= 100:
            raise self._wrong("<Calibration OutputRange>", f"{width:g} V is not a range of a gauge")
        bipolar = calibration.get("OutputBipolar", "True").strip().lower() == "true"
        low, high = (-width / 2, width / 2) if bipolar else (0.0, width)
        transform = calibration.find("BasicTransform")
        shift = tuple(0.0 if transform is None else self._number(transform, name, 0.0) for name in SHIFTS)
        return CalFile(
            root.get("Serial") or self._text(root, "SerialNumber"), root.get("BodyStyle", ""),
            calibration.get("PartNumber", ""), _iso(calibration.get("CalDate", "")),
            self._text(calibration, "ForceUnits"), self._text(calibration, "TorqueUnits"),
            calibration.get("DistUnits", "m"), calibration.get("AngleUnits", "degrees"), low, high, user, basic,
            {name: self._rated(child) for name, child in (self._axes(calibration, "UserAxis") or axes).items()},
            shift, self._slopes(calibration), hashlib.sha256(data).hexdigest(),
        )  # fmt: skip

    def _tree(self, data: bytes) -> Element:
        """Return the root element. Raises DeviceError at a document type, which could declare entities."""
        builder, parser = TreeBuilder(), expat.ParserCreate()
        parser.StartElementHandler = builder.start
        parser.EndElementHandler = builder.end
        parser.StartDoctypeDeclHandler = self._refuse_doctype
        try:
            parser.Parse(data.rstrip(b"\0\x1a \t\r\n"), True)
            return builder.close()
        except (expat.ExpatError, AssertionError, ValueError) as error:
            if isinstance(error, DeviceError):
                raise
            raise DeviceError(f"{self.where}: no calibration file: {error}") from error

    def _refuse_doctype(self, *_ignored: object) -> None:
        raise self._wrong("<!DOCTYPE>", "a calibration file has none")

    def _axes(self, calibration: Element, tag: str) -> dict[str, Element]:
        """Return the six rows of that name by axis; an empty dict if the file has none."""
        axes = [(self._text(child, "Name"), child) for child in calibration.findall(tag)]
        names = [name for name, _ in axes]
        if axes and sorted(names) != sorted(AXES):
            raise self._wrong(f"<{tag}>", f"one each of {', '.join(AXES)} is expected, found {some(names)}")
        return dict(axes)

    def _rated(self, axis: Element) -> float:
        rated = self._number(axis, "max", None)
        if rated <= 0:
            raise self._wrong(_called(axis, "max"), f"{rated:g} is not a rated load; more than 0 is expected")
        return rated

    def _slopes(self, calibration: Element) -> tuple[MatrixRow, MatrixRow, float] | None:
        bias, gain, thermistor = (calibration.find(name) for name in ("BiasSlope", "GainSlope", "Thermistor"))
        if bias is None and gain is None:
            return None
        none = (0.0,) * 6
        return (
            none if bias is None else self._values(bias, "values"),
            none if gain is None else self._values(gain, "values"),
            0.0 if thermistor is None else self._number(thermistor, "value", None),
        )

    def _values(self, element: Element, name: str) -> MatrixRow:
        texts = self._text(element, name).split()
        if len(texts) != 6:
            raise self._wrong(_called(element, name), f"6 numbers are expected, found {len(texts)}")
        return tuple(self._float(text, _called(element, name)) for text in texts)

    def _number(self, element: Element, name: str, missing: float | None) -> float:
        if missing is not None and element.get(name) is None:
            return missing
        return self._float(self._text(element, name), _called(element, name))

    def _float(self, text: str, called: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise self._wrong(called, f"{text!r} is not a number") from None
        if not math.isfinite(value):
            raise self._wrong(called, f"{text!r} is not a finite number")
        return value

    def _text(self, element: Element, name: str) -> str:
        text = element.get(name)
        if text is None:
            raise self._wrong(_called(element, name), "it is missing")
        return text

    def _wrong(self, element: str, problem: str) -> DeviceError:
        return DeviceError(f"{self.where}: {element}: {problem}; ask the maker for the sensor's .cal file")


def _called(element: Element, attribute: str) -> str:
    name = element.get("Name")
    return f"<{element.tag}{f' Name={name}' if name else ''} {attribute}>"


def _iso(date: str) -> str | None:
    """Return the maker's month/day/year as an ISO date; None for other formats."""
    match = _DATE.match(date.strip())
    return f"{match[3]}-{int(match[1]):02}-{int(match[2]):02}" if match else None
