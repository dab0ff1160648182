"""Files put in their places when all of them are written, and never over anything that was not made here."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath

MARK = ".palpate-regenerated.json"
"""Lies in every folder of outputs and names them."""
DRAFT = ".unfinished-"


class PlaceRefused(ValueError):
    """The outputs cannot be written there without loss."""


@contextmanager
def written_whole(folder: Path) -> Iterator[tuple[Path, list[str]]]:
    """An empty folder to write into, whose files then take their places in `folder`; the list then holds their names.

    What an earlier run listed and this one did not write is removed. Where writing fails or is stopped, `folder` stays
    as it was. Raises PlaceRefused where a file that no earlier run listed is in the way.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=DRAFT, dir=folder) as name:
        draft, names = Path(name), list[str]()
        yield draft, names
        names += sorted(path.relative_to(draft).as_posix() for path in draft.rglob("*") if path.is_file())
        _put(draft, folder, names)


def listed(folder: Path) -> frozenset[str]:
    """The files that an earlier run made in `folder`, none where none is listed."""
    try:
        found = json.loads((folder / MARK).read_text(encoding="utf-8"))["files"]
    except (OSError, ValueError, KeyError, TypeError):
        return frozenset()
    return frozenset(filter(_inside, map(str, found))) if isinstance(found, list) else frozenset()


def _inside(name: str) -> bool:
    path = PurePosixPath(name)
    return bool(path.parts) and not path.is_absolute() and ".." not in path.parts


def _put(draft: Path, folder: Path, names: Collection[str]) -> None:
    earlier = listed(folder)
    if foreign := [name for name in names if name not in earlier and (folder / name).exists()]:
        raise PlaceRefused(
            f"{folder}: {foreign[0]} is there already and no run of regenerate made it (none is listed in {MARK});"
            " nothing was written: give another folder with --to, or move that file away"
        )
    _list(draft, folder, {*earlier, *names})
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (draft / name).replace(folder / name)
    for name in earlier - set(names):
        _remove(folder / name)
    _list(draft, folder, names)


def _list(draft: Path, folder: Path, names: Collection[str]) -> None:
    text = json.dumps({"files": sorted(names)}, indent=1, ensure_ascii=False) + "\n"
    (draft / MARK).write_text(text, encoding="utf-8", newline="\n")
    (draft / MARK).replace(folder / MARK)


def _remove(path: Path) -> None:
    """A file, and its folder where it was the last one in it."""
    path.unlink(missing_ok=True)
    with suppress(OSError):
        path.parent.rmdir()
