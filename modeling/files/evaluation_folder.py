"""An evaluation on disk: tables, figures, the report, and one JSON with every number; what it left before goes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

from palpate.analysis.regenerating.files import readable_json
from palpate.analysis.reports.csv_files import csv_text, json_row
from palpate.protocols.files import staged_files, write_text, write_texts

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
    texts = {f"tables/{name}.csv": csv_text([json_row(row) for row in rows]) for name, rows in tables.items()}
    obsolete: list[str] = []
    with staged_files(folder, last=[RESULTS], obsolete=obsolete) as draft:
        write_texts(draft, texts)
        drawn = draw(draft / "figures")
        names = [*texts, *(f"figures/{each.name}.{kind}" for each in drawn for kind in ("svg", "png"))]
        write_text(draft / REPORT, page(drawn))
        results = {**told(), "files": sorted([*names, REPORT])}
        write_text(draft / RESULTS, readable_json(results) + "\n")
        obsolete += [name for name in _earlier(folder) if name not in results["files"]]
    return [folder / name for name in (*names, RESULTS, REPORT)]


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
    names = [name for name in names if isinstance(name, str)] if isinstance(names, list) else []
    return [name for name in names if (folder / name).resolve().is_relative_to(folder.resolve())]
