"""The picture that shows a texture of the library; one that is missing leaves a plain tile, and a note."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from palpate.modeling.attributes.material import MaterialError
from palpate.modeling.attributes.reading_folder import is_picture
from palpate.modeling.attributes.reading_pictures import STUDY, folders_of, picture_of, pictured_trials
from palpate.modeling.library.entries import LibraryError
from palpate.protocols.wording import some
from palpate.studies.collecting.study_sessions import real_or_simulated

NUMBER = re.compile(r"[_\-. ](\d+)")
"""What may stand behind a texture's name: the number of its picture."""
NAMED = 5
"""So many textures without a picture are named in a note."""


@dataclass(frozen=True)
class Pictures:
    """By texture its picture's file; and why of others there is none, though one was taken."""

    files: Mapping[str, Path] = field(default_factory=dict)
    lacking: Mapping[str, str] = field(default_factory=dict)


def pictures_taken(lab: Path, simulated: bool | None = None) -> Pictures:
    """The first picture that counts of each texture that texture_photos saw, and that lies unchanged where it was kept.

    Which sessions and trials count is decided as by `reading_pictures.photographed`, which wants all of the pictures.
    Raises MaterialError on a damaged ledger.
    """
    files: dict[str, Path] = {}
    lacking: dict[str, str] = {}
    counting, _ = real_or_simulated(list(pictured_trials(lab, STUDY)), simulated, "pictures")
    for trial in counting:
        folders = folders_of(lab, trial.record)
        for picture in trial.pictures:
            if trial.stimulus not in files and "file" in picture:
                file, sha256 = str(picture["file"]), str(picture["sha256"])
                try:
                    files[trial.stimulus] = picture_of(trial.record.path.stem, file, sha256, folders).path
                except MaterialError as error:
                    lacking.setdefault(trial.stimulus, str(error))
    return Pictures(files, {name: why for name, why in lacking.items() if name not in files})


def pictures_in(folder: Path, names: Sequence[str]) -> Iterator[tuple[str, Path]]:
    """The first picture of each name: NAME.png, NAME_1.jpg, NAME/anything.png. Raises LibraryError for no folder.

    Where one name begins another (T1 and T1_2, oak and oak-dark), a file is the one's that its name is nearest to.
    """
    if not folder.is_dir():
        raise LibraryError(f"{folder}: there is no such folder; one with pictures named as the textures is expected.")
    first: dict[str, tuple[int, Path]] = {}
    for path in sorted(filter(is_picture, folder.rglob("*"))):
        if (claimed := _whose(path.relative_to(folder), names)) is not None:
            name, number = claimed
            if name not in first or number < first[name][0]:
                first[name] = (number, path)
    yield from ((name, first[name][1]) for name in names if name in first)


def _whose(path: Path, names: Sequence[str]) -> tuple[str, int] | None:
    """Which texture a file shows, and as which of its pictures: in a texture's own folder its, else by its name."""
    if len(path.parts) > 1 and path.parts[0] in names:
        return path.parts[0], 0
    for name in sorted(names, key=len, reverse=True):
        if path.stem == name:
            return name, -1
        if path.stem.startswith(name) and (number := NUMBER.fullmatch(path.stem[len(name) :])):
            return name, int(number[1])
    return None


def told_lacking(lacking: Mapping[str, str]) -> tuple[str, ...]:
    """A note on the textures whose picture could not be had, with why of the first; none where there are none."""
    if not lacking:
        return ()
    names = list(lacking)
    return (f"no picture is shown of {some(names, NAMED)}: {lacking[names[0]].rstrip('.')}",)
