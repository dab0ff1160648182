"""A lab's folder: what makes it a lab, its few settings in lab.yaml, and the error for everything about its people."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.shell_command import shell_command
from palpate.protocols.yaml_text import load


class ParticipantError(ValueError):
    """A participant, a row, a lab or one of its files about people cannot be used; the message says what to do."""


TEMPLATE = Path(__file__).resolve().parents[1] / "participants_template"
"""The template's folder, in a checkout beside the packages and inside Palpate where it is installed."""
SIDECAR = "participants.json"
"""The file that makes a folder a lab: the questions about participants, as BIDS describes columns."""
SETTINGS = "lab.yaml"
_KEYS = ("registry", "extensions")


@dataclass(frozen=True)
class Settings:
    """The settings in lab.yaml.

    `registry` is the SQLAlchemy URL of a registry that several stations share. `extensions`: code in LAB/extensions is
    imported where a study, a rig or a plan names a part of it.
    """

    registry: str | None = None
    extensions: bool = False


def demand_lab(lab: Path) -> None:
    """Raise ParticipantError unless `palpate init` made the folder a lab."""
    if not (lab / SIDECAR).is_file():
        raise ParticipantError(
            f"{lab} is not a lab: it holds no {SIDECAR}; make it one with: {shell_command('init', lab)}"
        )


def settings(lab: Path) -> Settings:
    """Return the lab's settings; defaults without a lab.yaml.

    Raises YamlError on invalid YAML, ParticipantError on an unknown key or a value of the wrong kind.
    """
    file = lab / SETTINGS
    if not file.is_file():
        return Settings()
    document = load(file.read_bytes(), str(file))
    if not isinstance(document.data, dict):
        raise ParticipantError(f"{file}: keys and values are expected, as registry: URL")
    for key, value in document.data.items():
        where = f"{file}: line {document.lines[(key,)]}: {key}"
        if key not in _KEYS:
            raise ParticipantError(f"{where}: unknown key; {nearest(str(key), _KEYS)}")
        if key == "extensions" and not isinstance(value, bool):
            raise ParticipantError(f"{where}: found {value!r:.60}, true or false is expected")
        if key == "registry" and (not isinstance(value, str) or not value.strip()):
            raise ParticipantError(f"{where}: found {value!r:.60}, a text is expected")
    return Settings(**document.data)
