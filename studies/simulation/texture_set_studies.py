"""The studies of a set of textures: the shipped ones, or a lab's own with fewer textures or seconds, written once."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from palpate.protocols.did_you_mean import nearest
from palpate.protocols.files import staged_folder, write_text
from palpate.protocols.study import Study
from palpate.protocols.tables import table_text
from palpate.studies.catalogue import SHIPPED, STUDY_FILE, Found, read_study, stimulus_rows

STUDIES = ("texture_capture", "texture_photos", "texture_ratings")
GROUPS = {"texture_capture": "perception", "texture_photos": "all", "texture_ratings": None}
"""The group of each study that is the set."""
SECONDS = 60.0
LEAST_S, MOST_S = 6.0, 3600.0
"""Features of touch leave out 2.5 s at both ends and take segments of 0.5 s; the speed's window takes 0.06 s more."""
FEWEST = 2
"""Simulated people feel a texture by how it stands among the others: of one alone nothing can be said."""
Row = dict[str, str]


class TextureSetError(ValueError):
    """A set of textures that cannot be made: the message says where, what was found and what to do."""


@dataclass(frozen=True)
class Chosen:
    """Which textures, in the studies' order, and for how long each is stroked."""

    textures: tuple[str, ...]
    seconds: float = SECONDS

    @property
    def whole(self) -> bool:
        """Whether this is the shipped set."""
        return self.seconds == SECONDS and self.textures == all_textures()


def all_textures() -> tuple[str, ...]:
    """The ids of the fifty textures."""
    return tuple(row["id"] for row in _rows("texture_ratings"))


def chosen(textures: tuple[str, ...] = (), seconds: float = SECONDS) -> Chosen:
    """The textures by their ids, all where none is named. Raises TextureSetError on an odd id or time, and on one."""
    known = all_textures()
    for name in textures:
        if name not in known:
            raise TextureSetError(f"no texture is called {name!r}; {_meant(name, known)}")
    wanted = tuple(name for name in known if name in textures) if textures else known
    if len(wanted) < FEWEST:
        raise TextureSetError(f"{len(wanted)} texture: {FEWEST} or more are needed, as people compare them")
    if not LEAST_S <= seconds <= MOST_S:
        raise TextureSetError(
            f"{seconds:g} s of each texture: from {LEAST_S:g} to {MOST_S:g} s are expected, as 2.5 s are left out at"
            " both ends when it is described, and a segment of touch takes 0.5 s"
        )
    return Chosen(wanted, float(seconds))


def _meant(name: str, known: tuple[str, ...]) -> str:
    """What may have been meant: T1 and t01 are T01, whatever other names are as near."""
    padded = f"{name[:1].upper()}{name[1:].zfill(2)}"
    return f"did you mean {padded!r}?" if padded in known else nearest(name, known)


def planned(lab: Path, wanted: Chosen) -> dict[str, Study]:
    """The three studies with these textures, by name; nothing is written.

    Raises TextureSetError where the lab has one of its own by that name that is another.
    """
    found = {}
    for name in STUDIES:
        found[name] = _planned(name, wanted)
        _demand_ours(lab / "studies" / name, found[name], wanted)
    return found


def written(lab: Path, wanted: Chosen) -> dict[str, Found]:
    """The three studies at their folders: the shipped ones, else LAB/studies, written where they are not there yet."""
    if wanted.whole:
        return {name: read_study(SHIPPED / name / STUDY_FILE) for name in STUDIES}
    for name in STUDIES:
        if not (lab / "studies" / name).exists():
            with staged_folder(lab / "studies" / name) as folder:
                _draft(folder, name, wanted)
    return {name: read_study(lab / "studies" / name / STUDY_FILE) for name in STUDIES}


def told(wanted: Chosen) -> str:
    """In words: 50 textures x 60 s."""
    return f"{len(wanted.textures)} textures x {wanted.seconds:g} s"


def _planned(name: str, wanted: Chosen) -> Study:
    if wanted.whole:
        return read_study(SHIPPED / name / STUDY_FILE).study
    with TemporaryDirectory() as place:
        return read_study(_draft(Path(place), name, wanted) / STUDY_FILE).study


def _demand_ours(folder: Path, study: Study, wanted: Chosen) -> None:
    if not folder.exists():
        return
    file = folder / STUDY_FILE
    if not wanted.whole and file.is_file() and read_study(file).study.definition() == study.definition():
        return
    raise TextureSetError(
        f"{folder}: the lab has a {folder.name} of its own, which is not of {told(wanted)}; it is left as it is. Ask"
        " for the textures and seconds that the set there was made with, or give another lab"
    )


def _draft(folder: Path, name: str, wanted: Chosen) -> Path:
    """Put the shipped study's files, with fewer rows or other seconds, into an empty folder."""
    shutil.copytree(SHIPPED / name, folder, dirs_exist_ok=True)
    _rewrite(folder / STUDY_FILE, lambda text: _yaml(text, name, wanted))
    _rewrite(folder / "stimuli.csv", lambda _text: _table(name, wanted))
    _rewrite(folder / "README.md", lambda _text: _readme(name, wanted))
    return folder


def _rewrite(file: Path, change: Callable[[str], str]) -> None:
    write_text(file, change(file.read_text("utf-8")))


def _yaml(text: str, name: str, wanted: Chosen) -> str:
    """The shipped study; its comments, which speak of fifty textures, give way to one that says what this is."""
    bare = re.sub(r"(?m)^#.*\n|[ \t]+#.*$", "", text)
    return f"# The shipped {name} with other textures or seconds: {told(wanted)}, by palpate textures simulate\n{bare}"


def _rows(name: str) -> list[Row]:
    return [dict(row.cells) for row in stimulus_rows(SHIPPED / name / "stimuli.csv")]


def _table(name: str, wanted: Chosen) -> str:
    rows = [changed for row in _rows(name) if (changed := _changed(row, name, wanted)) is not None]
    return table_text(rows[0], (row.values() for row in rows))


def _changed(row: Row, name: str, wanted: Chosen) -> Row | None:
    """A row as the set has it; None where it is left out. Rows of other groups stay as they are."""
    if GROUPS[name] is not None and row["set"] != GROUPS[name]:
        return row
    if row["id"] not in wanted.textures:
        return None
    return {**row, "seconds": f"{wanted.seconds:g}"} if "seconds" in row else row


def _readme(name: str, wanted: Chosen) -> str:
    return f"""# {name}, {told(wanted)}

Written by `palpate textures simulate`: the study that Palpate ships, with these textures or seconds only.
{", ".join(wanted.textures)}.

Simulated people feel a texture by how it stands among the study's others: their ratings of a texture in a smaller set
are not those of the full one.
"""
