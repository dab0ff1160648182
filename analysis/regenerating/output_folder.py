"""Files put in their places when all of them are written, and never over anything that was not made here."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath

from palpate.protocols.canonical import json_text
from palpate.protocols.files import staged_files, write_text

MARK = ".palpate-regenerated.json"
"""Lies in every folder of outputs and names them."""


class PlaceRefused(ValueError):
    """The outputs cannot be written there without loss."""


@contextmanager
def written_whole(folder: Path) -> Iterator[tuple[Path, list[str]]]:
    """An empty folder to write into, whose files then take their places in `folder`; the list then holds their names.

    What an earlier run listed and this one did not write is removed. Where writing fails or is stopped, `folder` stays
    as it was. Raises PlaceRefused where a file that no earlier run listed is in the way.
    """
    names, obsolete = list[str](), list[str]()
    with staged_files(folder, last=[MARK], obsolete=obsolete) as draft:
        yield draft, names
        names += sorted(path.relative_to(draft).as_posix() for path in draft.rglob("*") if path.is_file())
        earlier = listed(folder)
        _demand_ours(folder, earlier, names)
        obsolete += sorted(earlier - set(names))
        write_text(draft / MARK, json_text({"files": sorted(names)}, indent=1))
    for name in obsolete:
        with suppress(OSError):
            (folder / name).parent.rmdir()


def listed(folder: Path) -> frozenset[str]:
    """Return the files that an earlier run made in `folder`, none where none is listed."""
    try:
        files = json.loads((folder / MARK).read_text(encoding="utf-8"))["files"]
    except (OSError, ValueError, KeyError, TypeError):
        return frozenset()
    return frozenset(filter(_inside, map(str, files))) if isinstance(files, list) else frozenset()


def _inside(name: str) -> bool:
    path = PurePosixPath(name)
    return bool(path.parts) and not path.is_absolute() and ".." not in path.parts


def _demand_ours(folder: Path, earlier: Collection[str], names: Collection[str]) -> None:
    if foreign := [name for name in names if name not in earlier and (folder / name).exists()]:
        raise PlaceRefused(
            f"{folder}: {foreign[0]} is there already and no run of regenerate made it (none is listed in {MARK});"
            " nothing was written: give another folder with --to, or move that file away"
        )
