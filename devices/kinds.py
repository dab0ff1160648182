"""The kinds of devices: the settings of each in a rig file, how it is made, and how it is calibrated.

A kind is described once, as `KIND` in the module of its device: a module of `devices/instruments/`, or one that the
table below names. Naming a kind imports nothing; only the modules of the kinds that a rig names are imported.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field

from palpate.protocols.registry import Registry
from palpate.protocols.strict import Strict

if TYPE_CHECKING:
    from palpate.devices.device import Device
    from palpate.protocols.events import Present, Reply


def _iso_date(text: str) -> str:
    """Return the date unchanged. Raises ValueError if it is not a date of the calendar."""
    return date.fromisoformat(text).isoformat()


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Date = Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$"), AfterValidator(_iso_date)]
"""An ISO date, as 2026-11-21."""


@dataclass(frozen=True)
class CalibrationMethod:
    """The method of `palpate rig calibrate` for a kind of device.

    `call` is the function ("module:name"), called with the job and the command's `options` that it takes. `required`
    says what to do if one of them is missing. `by_hand`: a person has to turn a real device meanwhile.
    """

    call: str
    options: tuple[str, ...]
    required: Mapping[str, str] = field(default_factory=dict)
    by_hand: bool = False


@dataclass(frozen=True)
class DeviceKind:
    """A kind of device that a rig file may name.

    `make(name, settings, folder)` returns the device without opening it; with the driver `twin` it is simulated behind
    the same code. Files that the settings name are in `folder`. It raises DeviceError if a file cannot be read.
    `meanings` explains each setting (`a.b` is inside `a`), `calibration` is a text if the kind is calibrated elsewhere.
    `may_hide`: its streams may be NaN for long, as those of a hidden marker. `shares_card`: devices of such kinds may
    be on one card, which then samples for all of them. `simulated`: settings of the twin in a simulated session.
    `at_once(device, request, t_ns)` returns the reply of a presentation that begins at t_ns, and its seconds, in no
    time; without it, a simulated session performs the request on a clock that leaps.

    The contract of devices (`palpate.devices.contract`) tries twins by two functions. `unplug(device)` cuts the link of
    an open twin, as if its cable were pulled. `exceed(device)` commands more than the hard limit of an open twin, and
    returns the most that came out, and the limit, in one unit. A text in place of either says why there is none; a
    kind that presents nothing needs no `exceed`.
    """

    settings: type[Strict]
    make: Callable[[str, Any, Path], Device]
    meanings: Mapping[str, str]
    calibration: CalibrationMethod | str
    may_hide: bool = False
    shares_card: bool = False
    unplug: Callable[[Any], object] | str = ""
    exceed: Callable[[Any], tuple[float, float]] | str = ""
    simulated: Mapping[str, Any] = field(default_factory=dict)
    at_once: Callable[[Any, Present, int], tuple[Reply, float]] | None = None


KINDS: Registry[DeviceKind] = Registry(
    places={
        "door": "palpate.devices.door.link.device:KIND",
        "force_torque": "palpate.devices.daq.force_torque:KIND",
        "accelerometer": "palpate.devices.daq.accelerometer:KIND",
        "tracker": "palpate.devices.tracker.device:KIND",
        "tablet": "palpate.devices.tablet.device:KIND",
        "voice_coil": "palpate.devices.actuator.device:KIND",
        "vibrator": "palpate.devices.vibrator.device:KIND",
        "masking_noise": "palpate.devices.sound.device:KIND",
        "camera": "palpate.devices.camera.device:KIND",
        "stage": "palpate.devices.stage.device:KIND",
    },
    folder="palpate.devices.instruments.*",
    kind="devices",
    of="palpate.devices.kinds:DeviceKind",
)
