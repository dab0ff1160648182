"""The door profiles of a study, each the very file that it was planned with."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from palpate.protocols.files import file_sha256
from palpate.protocols.study import Stimulus
from palpate.signals.doors.profile_file import read_profile
from palpate.studies.sessions.rig import RigError

MID_SIZE = "K8"
"""The door of the catalogue that represents a car without a known profile."""


@dataclass
class Profiles:
    """The door profiles of a study, read once; each must be the file that the study was planned with."""

    folder: Path
    read: dict[str, tuple[float, ...]] = field(default_factory=dict)

    def of(self, stimulus: Stimulus) -> tuple[float, ...]:
        """Return the 621 forces, in newtons, of a stimulus. Raises RigError, or DoorDataError on an invalid file."""
        if stimulus.id not in self.read:
            file = self.folder / stimulus.columns.get("file", "")
            if not file.is_file():
                raise RigError(f"stimulus {stimulus.id!r}: no door profile {file} (the column `file` of its table)")
            if file_sha256(file) != stimulus.sha256:
                raise RigError(f"{file}: not the file that the session was planned with (its SHA-256 differs)")
            self.read[stimulus.id] = read_profile(file)
        return self.read[stimulus.id]


def profile_of(stimulus: Stimulus, profiles: Profiles) -> tuple[float, ...]:
    """Return the profile of the door that sensors are simulated at: the column `file`, else a mid-size door."""
    if stimulus.columns.get("file"):
        return profiles.of(stimulus)
    from palpate.devices.door.stimuli import find_door, read_catalogue
    from palpate.signals.doors.mechanics import simulate

    return tuple(simulate(find_door(read_catalogue(), MID_SIZE).door, MID_SIZE).tolist())
