"""What calibrating a device gives: the settings for its entry in the rig file, and how good they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.devices.rig.file import RigFile

Ask = Callable[[str], None]
"""Asks the experimenter to do something, and comes back once it is done."""
Say = Callable[[str], None]


class Unfit(Exception):
    """A measurement that calibrates nothing; the message says what it lacks and what to do."""


@dataclass(frozen=True)
class Found:
    """`settings` are for the device's entry; `told` says in lines how good they are, `figures` the same as data."""

    settings: Mapping[str, Any]
    told: tuple[str, ...]
    figures: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Job:
    """One device of a rig that is to be calibrated, and how the experimenter is spoken with."""

    file: RigFile
    name: str
    date: str
    ask: Ask
    say: Say


ELSEWHERE: Mapping[str, str] = {
    "force_torque": "is calibrated by its maker. Put the .cal file that came with it beside the rig file and name it:"
    " `calibration: FT12345.cal`, `calibrated:` with its date. Its zero is taken each time it is opened (`zero_s`)",
    "tracker": "is calibrated with its own software (Motive: wand, then ground plane). Do it there, then write that day"
    " into the rig file: `calibrated: 2026-11-21`",
    "door": "is calibrated in its own controller, which gives N m and radians. Measure from the hinge to the handle"
    " with a rule and write it as `handle_radius_m`",
    "masking_noise": "is calibrated with a sound level meter at the ear: play a full-scale sine and write what it reads"
    " as `db_spl_at_0_dbfs`",
    "camera": "is set at the camera itself: focus, exposure and white balance. `least_sharpness` and `most_white` then"
    " judge its pictures",
    "stage": "has nothing to calibrate: it only says which sample lies on it",
}
"""How the kinds are calibrated that this program cannot calibrate."""


def as_yaml(value: Any) -> str:
    """A setting's value as it stands in a rig file, on one line."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {as_yaml(inner)}' for key, inner in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(as_yaml, value))}]"
    return f"{value:.10g}" if isinstance(value, float) else str(value)
