"""The files of an evaluation of textures: tables, a JSON file with every number, figures and the report."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from palpate.modeling.evaluate.outputs import evaluation_folder, read_results, tables_as_json, write_evaluation
from palpate.modeling.textures.evaluation.evaluate import RULE, TextureEvaluation
from palpate.modeling.textures.evaluation.report import choice_of
from palpate.modeling.textures.evaluation.tables import (
    Row,
    curve_rows,
    figure_4_5,
    free_rows,
    grid_rows,
    method_rows,
    table_4_1,
    table_4_2,
    table_4_3,
    texture_rows,
    warm_up_rows,
)
from palpate.modeling.textures.recording import Recording, recording_digest
from palpate.modeling.textures.registry import DEFAULT, METHODS
from palpate.modeling.training.run_card import versions
from palpate.protocols.progress import Report, silent

NAME = "textures"
LONG = ("learning_curves",)
"""Tables with a row for each epoch, which are written as CSV only."""


def tables(evaluation: TextureEvaluation) -> dict[str, list[Row]]:
    """Return every table of the evaluation by the name of its CSV file, without empty ones."""
    every = {
        "methods": method_rows(evaluation),
        "textures": texture_rows(evaluation),
        "free_running": free_rows(evaluation),
        "warm_up": warm_up_rows(evaluation),
        "table_4_1": table_4_1(evaluation),
        "table_4_2": table_4_2(evaluation),
        "table_4_3": table_4_3(evaluation),
        "figure_4_5": figure_4_5(evaluation),
        "windows_and_losses": grid_rows(evaluation),
        "learning_curves": curve_rows(evaluation),
    }
    return {name: rows for name, rows in every.items() if rows}


def as_json(evaluation: TextureEvaluation) -> dict[str, Any]:
    """Return every number with its inputs, settings and software; NaN and infinity become null."""
    chosen, domain = choice_of(evaluation), evaluation.domain
    return {
        "data": {
            name: {"digest": recording_digest(recording), "label": recording.label, "seconds": recording.seconds,
                   "made_from": list(recording.made_from), "notes": list(evaluation.notes[name]),
                   "parts": {part: list(map(list, getattr(domain.parts[name], part)))
                             for part in ("train", "validation", "test")}}
            for name, recording in domain.recordings.items()
        },
        "left_out": dict(domain.left_out),
        "free_running": {"seconds": domain.seconds,
                         "hand": {name: drive.origin for name, drive in evaluation.drives.items()}},
        "explored": evaluation.options.explore,
        "quick": evaluation.options.quick,
        "seed": evaluation.options.seed,
        "settings": {name: str(value) for name, value in domain.settings.items()},
        "software": versions(),
        "seconds": evaluation.seconds,
        "jobs": len(evaluation.results),
        "jobs_kept": evaluation.results.loaded,
        "default": chosen.as_json(RULE),
        "tables": tables_as_json(tables(evaluation), LONG),
    }  # fmt: skip


def write_all(
    evaluation: TextureEvaluation, folder: Path, report: Report = silent, drawings: bool = True
) -> list[Path]:
    """Write tables, figures, results and the report, and return the paths, the report last; see `write_evaluation`."""
    from palpate.modeling.textures.evaluation.figures import figures
    from palpate.modeling.textures.evaluation.report import report_html

    return write_evaluation(
        folder, tables(evaluation), partial(figures, evaluation) if drawings else None,
        partial(report_html, evaluation), partial(as_json, evaluation), report,
    )  # fmt: skip


def default_of(lab: Path, recordings: Sequence[Recording]) -> str:
    """Return the method that a lab's own evaluation of the same recordings chose, else the shipped default.

    The shipped default also stays where the evaluation was quick or did not include it.
    """
    results = read_results(evaluation_folder(lab, NAME))
    try:
        same = {recording["digest"] for recording in results["data"].values()} == set(map(recording_digest, recordings))
        evaluated = {row["method"] for row in results["tables"]["methods"]}
        if same and not results["quick"] and DEFAULT in evaluated and results["default"]["method"] in METHODS:
            return str(results["default"]["method"])
    except (KeyError, TypeError, AttributeError):
        pass
    return DEFAULT
