"""An evaluation as files: tables, one JSON with every number, figures and the report."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from analysis.regenerating.files import readable_json
from analysis.reporting.csv_files import csv_text, write_texts
from modeling.doors.data import DoorData
from modeling.doors.evaluating_whole import Evaluation
from modeling.doors.evaluation_results import as_json, plain, tables
from modeling.doors.folding import Kinds
from modeling.doors.registry import DEFAULT, NO_FILE, Direction, methods_of

RESULTS, REPORT = "evaluation.json", "report.html"
KEPT = ".jobs"


def folder_for(lab: Path, split: Kinds) -> Path:
    """Where a lab's evaluation lies: the one on grouped folds counts, another split's stands beside it."""
    name = "doors" if split == "grouped" else f"doors-{split.replace('_', '-')}"
    return lab / "evaluated" / name


def kept_in(lab: Path) -> Path:
    """Where a lab keeps finished trainings, whatever the split."""
    return lab / "evaluated" / "doors" / KEPT


def write_all(
    found: Evaluation, folder: Path, report: Callable[[str], None] = lambda _line: None, drawings: bool = True
) -> list[Path]:
    """Write everything and give the paths, the report last; what an earlier evaluation wrote here and this one does
    not is removed, nothing else is touched."""
    from modeling.doors.evaluation_figures import figures
    from modeling.doors.evaluation_report import report_html

    earlier = _earlier(folder)
    texts = {f"tables/{name}.csv": csv_text([plain(row) for row in rows]) for name, rows in tables(found).items()}
    paths = write_texts(texts, folder)
    report("drawing")
    drawn = list(figures(found, folder / "figures")) if drawings else []
    paths += [folder / "figures" / f"{each.name}.{kind}" for each in drawn for kind in ("svg", "png")]
    page = folder / REPORT
    page.write_text(report_html(found, drawn), encoding="utf-8", newline="\n")
    names = sorted(path.relative_to(folder).as_posix() for path in (*paths, page))
    told = readable_json({**as_json(found), "files": names}) + "\n"
    (folder / RESULTS).write_text(told, encoding="utf-8", newline="\n")
    _remove(folder, [name for name in earlier if name not in names])
    return [*paths, folder / RESULTS, page]


def _earlier(folder: Path) -> list[str]:
    """The files that the evaluation which lies here says that it wrote."""
    names = _read(folder).get("files", [])
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


def _remove(folder: Path, names: Sequence[str]) -> None:
    for name in names:
        path = folder / name
        if path.resolve().is_relative_to(folder.resolve()):
            path.unlink(missing_ok=True)


def _read(folder: Path) -> dict[str, Any]:
    try:
        told = json.loads((folder / RESULTS).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return told if isinstance(told, dict) else {}


def default_of(lab: Path, data: DoorData, direction: Direction) -> str:
    """The method that a lab's own evaluation of the very same data chose, else the shipped default.

    An evaluation without the shipped default among its methods says nothing against it.
    """
    told = _read(folder_for(lab, "grouped"))
    try:
        evaluated = {row["method"] for row in told["tables"][f"methods_{direction}"]}
        if told["data"]["digest"] == data.digest and not told["quick"] and DEFAULT[direction] in evaluated:
            chosen = str(told["default"][direction]["method"])
            return chosen if _can_be_trained(direction, chosen) else DEFAULT[direction]
    except (KeyError, TypeError):
        pass
    return DEFAULT[direction]


def _can_be_trained(direction: Direction, method: str) -> bool:
    return method in methods_of(direction) and (direction, method) not in NO_FILE
