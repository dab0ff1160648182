"""A new lab made from the template; nothing is ever overwritten."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from palpate.protocols.files import UNFINISHED, staged_files, write_bytes
from palpate.protocols.wording import some
from palpate.studies.lab import SETTINGS, SIDECAR, TEMPLATE, ParticipantError
from palpate.studies.participants.lab_forms import unfilled

FOLDERS = ("sessions", "studies")
_OF_A_LAB = {*FOLDERS, SETTINGS, "analysis", "imported", "lab.sqlite", "bench"}
"""What a folder may hold before it becomes a lab: the tutorial begins with studies of one's own."""


@dataclass(frozen=True)
class NewLab:
    """The files and folders that were made, and the blanks to fill in, by file."""

    lab: Path
    made: tuple[str, ...]
    blanks: dict[str, int]


def make_lab(lab: Path) -> NewLab:
    """Copy the template's files and empty folders into a folder that is new, empty, or has only studies and sessions.

    Raises ParticipantError where the folder is a lab already, is a file, or holds anything else.
    """
    if lab.exists() and not lab.is_dir():
        raise ParticipantError(f"{lab} is a file; name a folder that is new or empty")
    if (lab / SIDECAR).exists():
        raise ParticipantError(f"{lab} is a lab already (it holds {SIDECAR}); nothing was changed")
    known = _OF_A_LAB | {source.name for source in template_files()}
    held = sorted(path.name for path in lab.iterdir()) if lab.exists() else []
    others = [name for name in held if name not in known and not name.startswith((".git", UNFINISHED))]
    if others:
        raise ParticipantError(f"{lab} holds {some(others, 3)}; name a folder that is new or empty")
    folders = [name for name in FOLDERS if not (lab / name).is_dir()]
    files = [source for source in template_files() if not (lab / source.name).exists()]
    with staged_files(lab, last=[SIDECAR]) as draft:
        for name in folders:
            (draft / name).mkdir()
        for source in files:
            write_bytes(draft / source.name, source.read_bytes())
    made = [*(f"{name}/" for name in folders), *(source.name for source in files)]
    texts = {source.name: (lab / source.name).read_text("utf-8") for source in template_files()}
    blanks = {name: len(unfilled(text)) for name, text in texts.items() if name.endswith(".md") and name != "README.md"}
    return NewLab(lab, tuple(sorted(made)), {name: count for name, count in sorted(blanks.items()) if count})


def template_files() -> list[Path]:
    """Return the template's files."""
    files = sorted(path for path in TEMPLATE.glob("*.*") if path.suffix in {".md", ".json", ".tsv"})
    if not any(path.name == SIDECAR for path in files):
        raise ParticipantError(f"{TEMPLATE}: the template for labs is missing: reinstall Palpate")
    return files
