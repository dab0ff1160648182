"""An evaluation on disk: tables, figures, the report, and one JSON with every number; what it left before goes."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

from analysis.regenerating.files import readable_json
from analysis.reporting.csv_files import csv_text, write_texts

RESULTS, REPORT = "evaluation.json", "report.html"


class Named(Protocol):
    """A figure that was drawn."""

    @property
    def name(self) -> str:
        """The stem of its files."""


Drawn = TypeVar("Drawn", bound=Named)


def write_evaluation(
    folder: Path,
    tables: Mapping[str, Sequence[Mapping[str, Any]]],
    draw: Callable[[Path], Sequence[Drawn]],
    page: Callable[[Sequence[Drawn]], str],
    told: Callable[[], Mapping[str, Any]],
) -> list[Path]:
    """Write everything and give the paths, the report last; what an earlier evaluation wrote here and this one does
    not is removed, nothing else is touched. `draw` puts its figures (SVG, PNG) into the folder that it is given."""
    earlier = _earlier(folder)
    texts = {f"tables/{name}.csv": csv_text([plain(row) for row in rows]) for name, rows in tables.items()}
    paths = write_texts(texts, folder)
    drawn = draw(folder / "figures")
    paths += [folder / "figures" / f"{each.name}.{kind}" for each in drawn for kind in ("svg", "png")]
    report = folder / REPORT
    report.write_text(page(drawn), encoding="utf-8", newline="\n")
    names = sorted(path.relative_to(folder).as_posix() for path in (*paths, report))
    results = readable_json({**told(), "files": names}) + "\n"
    (folder / RESULTS).write_text(results, encoding="utf-8", newline="\n")
    _remove(folder, [name for name in earlier if name not in names])
    return [*paths, folder / RESULTS, report]


def plain(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row as JSON holds it: a number that is not finite is none."""
    return {name: None if isinstance(v, float) and not math.isfinite(v) else v for name, v in row.items()}


def read_results(folder: Path) -> dict[str, Any]:
    """What the evaluation that lies here says of itself; nothing where there is none, or none that can be read."""
    try:
        told = json.loads((folder / RESULTS).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return told if isinstance(told, dict) else {}


def _earlier(folder: Path) -> list[str]:
    """The files that the evaluation which lies here says that it wrote."""
    names = read_results(folder).get("files", [])
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


def _remove(folder: Path, names: Sequence[str]) -> None:
    for name in names:
        path = folder / name
        if path.resolve().is_relative_to(folder.resolve()):
            path.unlink(missing_ok=True)
