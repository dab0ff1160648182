"""An evaluation as files: tables, one JSON with every number, figures and the report."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.evaluation import DoorEvaluation
from palpate.modeling.doors.evaluation_results import as_json, tables
from palpate.modeling.doors.folding import Kinds
from palpate.modeling.doors.registry import DEFAULT, NO_FILE, Direction, methods_of
from palpate.modeling.files.evaluation_folder import read_results, write_evaluation

KEPT = ".jobs"


def folder_for(lab: Path, split: Kinds) -> Path:
    """Where a lab's evaluation lies: the one on grouped folds counts, another split's stands beside it."""
    name = "doors" if split == "grouped" else f"doors-{split.replace('_', '-')}"
    return lab / "evaluated" / name


def kept_in(lab: Path) -> Path:
    """Where a lab keeps finished trainings, whatever the split."""
    return lab / "evaluated" / "doors" / KEPT


def write_all(
    evaluation: DoorEvaluation, folder: Path, report: Callable[[str], None] = lambda _line: None, drawings: bool = True
) -> list[Path]:
    """Write everything and give the paths, the report last; what an earlier evaluation wrote here and this one does
    not is removed, nothing else is touched."""
    from palpate.analysis.reports.figures import DrawnFigure
    from palpate.modeling.doors.evaluation_figures import figures
    from palpate.modeling.doors.evaluation_report import report_html

    def draw(place: Path) -> list[DrawnFigure]:
        report("drawing")
        return list(figures(evaluation, place)) if drawings else []

    return write_evaluation(
        folder, tables(evaluation), draw, partial(report_html, evaluation), lambda: as_json(evaluation)
    )


def default_of(lab: Path, data: DoorData, direction: Direction) -> str:
    """The method that a lab's own evaluation of the very same data chose, else the shipped default.

    An evaluation without the shipped default among its methods says nothing against it.
    """
    told = read_results(folder_for(lab, "grouped"))
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
