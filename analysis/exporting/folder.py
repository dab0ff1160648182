"""The folder of an export: complete or absent, and never in place of anything but an export."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from palpate.analysis.exporting.tabular import ExportRefused
from palpate.protocols.canonical import json_text
from palpate.protocols.files import staged_folder, write_text

MARK = ".palpate-export.json"
"""The file in every export that describes it and names its files."""


@contextmanager
def export_folder(folder: Path, replace: bool, about: dict[str, Any]) -> Iterator[Path]:
    """Yield an empty folder beside `folder` to write into, which replaces it if no error occurs.

    Raises ExportRefused if the folder exists, unless it is an export without added files.
    """
    demand_place(folder, replace)
    with staged_folder(folder) as draft:
        yield draft
        write_text(draft / MARK, json_text({**about, "files": sorted(_files(draft))}, indent=1))


def demand_place(folder: Path, replace: bool) -> None:
    """Raise ExportRefused unless `folder` is absent, empty, or an earlier export that is to be replaced."""
    if not folder.exists() and not folder.is_symlink():
        return
    if folder.is_symlink() or not folder.is_dir():
        raise ExportRefused(f"{folder}: is not a folder; give a new one with --to")
    if not any(folder.iterdir()):
        return
    if not (folder / MARK).is_file():
        raise ExportRefused(f"{folder}: holds files that no export wrote; give a new folder with --to")
    if not replace:
        raise ExportRefused(f"{folder}: holds an export already; replace it with --replace, or give another folder")
    if added := sorted(_files(folder).difference(map(str, read_mark(folder)["files"]))):
        raise ExportRefused(
            f"{folder}: {added[0]} was added to the export ({len(added)} such); move it away, or give another folder"
        )


def read_mark(folder: Path) -> dict[str, Any]:
    """Return the description of the export in `folder`. Raises ExportRefused if there is none."""
    try:
        mark = json.loads((folder / MARK).read_text("utf-8"))
        if isinstance(mark, dict) and isinstance(mark.get("files"), list):
            return mark
    except (OSError, ValueError):
        pass
    raise ExportRefused(f"{folder}: no export of Palpate's ({MARK} is missing or damaged)")


def _files(folder: Path) -> set[str]:
    return {
        path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir() and path.name != MARK
    }
