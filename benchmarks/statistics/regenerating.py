"""The time of a whole study from session files to report, and whether the next run gives the same bytes."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from palpate.protocols.bench import Case

AREA = "statistics"
STUDY = "door_ratings"


@dataclass
class _Lab:
    """A lab of simulated sessions, made in the first run, and the files of that run."""

    people: int
    runs: int = 0
    folder: tempfile.TemporaryDirectory[str] | None = None

    def again(self) -> Path:
        """Regenerate into a fresh folder; before the first time, simulate the sessions and regenerate once."""
        if self.folder is None:
            self.folder = tempfile.TemporaryDirectory()
            who = f"P001..P{self.people:03d}"
            _palpate("run", STUDY, "--participant", who, "--simulate", "--seed", "1", "--lab", self.folder.name)
            _regenerated(Path(self.folder.name), "first")
        self.runs += 1
        return _regenerated(Path(self.folder.name), f"again{self.runs}")

    def close(self) -> None:
        """Remove the lab."""
        if self.folder is not None:
            self.folder.cleanup()


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of `palpate regenerate` of the door study from the shell: 40 participants, 8 if `quick`."""
    lab = _Lab(8 if quick else 40)
    input_name = f"{STUDY}, {lab.people} participants, statistics, figures and report"
    try:
        yield Case(
            AREA, "a study regenerated", "palpate regenerate", input_name, lab.people * 45 * 7,
            "files that differ from the first run's", lab.again,
            lambda folder: float(len(_different(folder.parent / "first", folder))), 3,
        )  # fmt: skip
    finally:
        lab.close()


def _regenerated(lab: Path, name: str) -> Path:
    _palpate("regenerate", STUDY, "--lab", str(lab), "--to", str(lab / name))
    return lab / name


def _palpate(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "palpate", *arguments], check=True, capture_output=True)


def _different(first: Path, folder: Path) -> list[str]:
    """Return the files of either folder that are missing in the other or have other bytes there."""
    one, other = ({p.relative_to(at).as_posix(): p for p in at.rglob("*") if p.is_file()} for at in (first, folder))
    shared = set(one) & set(other)
    return sorted({*one, *other} - shared) + [n for n in shared if one[n].read_bytes() != other[n].read_bytes()]
