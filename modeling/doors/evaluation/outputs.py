"""The files of an evaluation: tables, a JSON file with every number, figures and the report."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from palpate.modeling.doors.data import DoorData
from palpate.modeling.doors.evaluation.evaluate import DoorEvaluation
from palpate.modeling.doors.evaluation.result_tables import as_json, tables
from palpate.modeling.doors.folding import Kinds
from palpate.modeling.doors.registry import DEFAULT, NO_FILE, Direction, methods_of
from palpate.modeling.evaluate.outputs import evaluation_folder, read_results, write_evaluation
from palpate.protocols.progress import Report, silent

NAME = "doors"


def folder_for(lab: Path, split: Kinds) -> Path:
    """Return the folder of a lab's evaluation; splits other than grouped folds have a folder of their own beside it."""
    return evaluation_folder(lab, NAME if split == "grouped" else f"{NAME}-{split.replace('_', '-')}")


def write_all(evaluation: DoorEvaluation, folder: Path, report: Report = silent, drawings: bool = True) -> list[Path]:
    """Write tables, figures, results and the report, and return the paths, the report last; see `write_evaluation`."""
    from palpate.modeling.doors.evaluation.figures import figures
    from palpate.modeling.doors.evaluation.report import report_html

    return write_evaluation(
        folder, tables(evaluation), partial(figures, evaluation) if drawings else None,
        partial(report_html, evaluation), partial(as_json, evaluation), report,
    )  # fmt: skip


def default_of(lab: Path, data: DoorData, direction: Direction) -> str:
    """Return the method that a lab's own evaluation of the same data chose, else the shipped default.

    The shipped default also stays where the evaluation was quick or did not include it.
    """
    results = read_results(folder_for(lab, "grouped"))
    try:
        evaluated = {row["method"] for row in results["tables"][f"methods_{direction}"]}
        if results["data"]["digest"] == data.digest and not results["quick"] and DEFAULT[direction] in evaluated:
            chosen = str(results["default"][direction]["method"])
            can_be_trained = chosen in methods_of(direction) and (direction, chosen) not in NO_FILE
            return chosen if can_be_trained else DEFAULT[direction]
    except (KeyError, TypeError):
        pass
    return DEFAULT[direction]
