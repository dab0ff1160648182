"""A lab's rig as one YAML file: its devices with ports, calibrations and limits, and which need takes which device."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from palpate.devices.device import DeviceError
from palpate.devices.kinds import KINDS
from palpate.devices.stations import station_folder
from palpate.protocols.complaints import Problem, listed, translated
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.extensions import is_own
from palpate.protocols.files import file_sha256
from palpate.protocols.needs import NEEDS
from palpate.protocols.strict import Strict
from palpate.protocols.yaml_text import Document, YamlError, load

SIMULATE = "palpate rig simulate"
KEYS = ("rig", "devices", "needs")
FILES = ("calibration", "recording")
"""Settings that name a file."""
MOST_DEVICES = 100


class RigFileError(DeviceError):
    """A rig file that cannot be used; the message lists the problems, one line each."""


@dataclass(frozen=True)
class RigFile:
    """The content of a rig file: settings by device name, and the names of the devices for each need."""

    path: Path
    name: str
    devices: Mapping[str, Strict]
    needs: Mapping[str, tuple[str, ...]]

    def kind(self, name: str) -> str:
        """Return the kind of a device."""
        return str(getattr(self.devices[name], "kind", ""))

    def is_twin(self, name: str) -> bool:
        """Return whether a device is simulated."""
        return getattr(self.devices[name], "driver", None) == "twin"

    def names_for(self, need: str) -> tuple[str, ...]:
        """Return the devices for a need. Raises RigFileError if the file provides none."""
        if need not in self.needs:
            takes = _of(NEEDS[need].takes)
            raise RigFileError(f"{self.path}: the need {need!r} is not provided: needs: {{{need}: [...]}} with {takes}")
        return self.needs[need]

    def definition(self, names: Sequence[str]) -> dict[str, Any]:
        """Return devices' settings as JSON data, with the digests of the files that they name, for the ledger."""
        settings = {}
        for name in names:
            # A file may become another one under its old name: a calibration, a recording.
            named = {key: getattr(self.devices[name], key, None) for key in FILES}
            paths = {key: self.path.parent / given for key, given in named.items() if given is not None}
            digests = {f"{key}_sha256": file_sha256(path) for key, path in paths.items() if path.is_file()}
            settings[name] = {**self.devices[name].model_dump(mode="json"), **digests}
        return settings


def rig_path(lab: Path, host: str | None = None) -> Path:
    """Return the path of a station's rig file: LAB/stations/HOST/rig.yaml."""
    return station_folder(lab, host) / "rig.yaml"


def read_rig(path: Path) -> RigFile:
    """Return the rig in a file. Raises RigFileError with every problem: file, line, key and nearest valid name."""
    if not path.is_file():
        raise RigFileError(f"{path}: no rig file there; write one of twins to begin with: {SIMULATE} --out {path}")
    try:
        document = load(path.read_bytes(), str(path))
    except YamlError as error:
        raise RigFileError(str(error)) from None
    reading = _Reading(document)
    if reading.problems:
        raise RigFileError(listed(reading.problems, document, str(path)))
    return RigFile(path, reading.name, reading.devices, reading.needs)


class _Reading:
    """A reader of a rig document, which collects its content and its problems."""

    def __init__(self, document: Document) -> None:
        self.problems: list[Problem] = []
        self.name, self.devices, self.needs = "", dict[str, Strict](), dict[str, tuple[str, ...]]()
        data = document.data
        if not isinstance(data, dict):
            self.problems.append(Problem((), "keys and values are expected at the top: rig, devices, needs"))
            return
        self.problems += [Problem((str(k),), f"unknown key; {nearest(str(k), KEYS)}") for k in data if k not in KEYS]
        name = data.get("rig")
        if isinstance(name, str) and name.strip():
            self.name = name
        else:
            self.problems.append(Problem(("rig",), "a name for the rig is expected, as rig: doorlab"))
        self._take_devices(data.get("devices"))
        if not self.problems:
            self._take_needs(data.get("needs"))

    def _take_devices(self, devices: Any) -> None:
        if not isinstance(devices, dict) or not 1 <= len(devices) <= MOST_DEVICES:
            self.problems.append(Problem(("devices",), "devices by their names are expected: {door: {kind: door}}"))
            return
        for name, given in devices.items():
            path = ("devices", name)
            if not isinstance(name, str) or not name.replace("_", "").replace("-", "").isalnum():
                self.problems.append(Problem(path, f"{name!r:.40} is not a name: letters, digits, _ and -"))
            elif not isinstance(given, dict):
                self.problems.append(Problem(path, "settings are expected: {kind: ..., driver: ...}"))
            elif "kind" not in given:
                self.problems.append(Problem((*path, "kind"), f"a kind is expected; {nearest('', KINDS)}"))
            elif (missing := KINDS.why_not(given["kind"], "kind")) is not None:
                self.problems.append(Problem((*path, "kind"), missing))
            else:
                model = KINDS[given["kind"]].settings
                try:
                    self.devices[name] = model.model_validate({str(key): value for key, value in given.items()})
                except ValidationError as error:
                    self.problems += [Problem(("devices", name, *p.path), p.message) for p in translated(error, model)]

    def _take_needs(self, needs: Any) -> None:
        if needs is None:
            needs = {}
        if not isinstance(needs, dict):
            self.problems.append(Problem(("needs",), "needs with lists of devices are expected: {door: [door]}"))
            return
        served = [need for need, known in NEEDS.items() if known.takes]
        for need, names in needs.items():
            if is_own(need) and (missing := NEEDS.why_not(need, "need")) is not None:
                self.problems.append(Problem(("needs", need), missing))
            elif not is_own(need) and need not in served:
                self.problems.append(Problem(("needs", need), f"no study needs this; {nearest(str(need), served)}"))
            elif not isinstance(names, list):
                self.problems.append(Problem(("needs", need), "a list of devices is expected, as [door]"))
            else:
                # One device of each kind that the need takes, and nothing else.
                self.needs[need] = tuple(map(str, names))
                unknown = {
                    place: name
                    for place, name in enumerate(names)
                    if not isinstance(name, str) or name not in self.devices
                }
                self.problems += [
                    Problem(("needs", need, place), f"no device {name!r:.40}; {nearest(str(name), list(self.devices))}")
                    for place, name in unknown.items()
                ]
                kinds = [] if unknown else sorted(str(getattr(self.devices[name], "kind", "")) for name in names)
                if not unknown and kinds != sorted(NEEDS[need].takes):
                    self.problems.append(
                        Problem(("needs", need), f"takes {_of(NEEDS[need].takes)}; found {_of(kinds)}")
                    )


def _of(kinds: Iterable[str]) -> str:
    return ", ".join(f"one {kind}" for kind in kinds) or "nothing"
