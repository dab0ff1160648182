"""An evaluation of textures as files: tables, one JSON with every number, figures, models and the report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from palpate.analysis.reports.csv_files import json_row
from palpate.modeling.files.evaluation_folder import read_results, write_evaluation
from palpate.modeling.textures.evaluation_report import choice_of
from palpate.modeling.textures.evaluation_tables import (
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
from palpate.modeling.textures.judging_default import RULE
from palpate.modeling.textures.judging_kept import recording_digest
from palpate.modeling.textures.judging_whole import Judged
from palpate.modeling.textures.recording import Recording
from palpate.modeling.textures.registry import DEFAULT, METHODS
from palpate.modeling.training.run_card import versions

KEPT = ".jobs"
LONG = ("learning_curves",)
"""Tables of a row for each epoch: they stand in their CSV alone."""


def folder_for(lab: Path) -> Path:
    """Where a lab's evaluation lies."""
    return lab / "evaluated" / "textures"


def kept_in(lab: Path) -> Path:
    """Where a lab keeps finished jobs."""
    return folder_for(lab) / KEPT


def tables(found: Judged) -> dict[str, list[Row]]:
    """Every table of the evaluation, by the name of its CSV; one that has no rows is left out."""
    every = {
        "methods": method_rows(found),
        "textures": texture_rows(found),
        "free_running": free_rows(found),
        "warm_up": warm_up_rows(found),
        "table_4_1": table_4_1(found),
        "table_4_2": table_4_2(found),
        "table_4_3": table_4_3(found),
        "figure_4_5": figure_4_5(found),
        "windows_and_losses": grid_rows(found),
        "learning_curves": curve_rows(found),
    }
    return {name: rows for name, rows in every.items() if rows}


def as_json(found: Judged) -> dict[str, Any]:
    """Every number with what it rests on; what is no number is null."""
    chosen, context = choice_of(found), found.context
    return {
        "data": {
            name: {"digest": recording_digest(each), "label": each.label, "seconds": each.seconds,
                   "made_from": list(each.made_from), "notes": list(found.notes[name]),
                   "parts": {part: list(map(list, getattr(context.parts[name], part)))
                             for part in ("train", "validation", "test")}}
            for name, each in context.recordings.items()
        },
        "left_out": dict(context.left_out),
        "free_running": {"seconds": context.seconds,
                         "hand": {name: drive.origin for name, drive in found.drives.items()}},
        "explored": found.wanted.explore,
        "quick": found.wanted.quick,
        "seed": found.wanted.seed,
        "settings": {name: str(value) for name, value in context.settings.items()},
        "software": versions(),
        "seconds": found.seconds,
        "jobs": found.jobs,
        "jobs_kept": found.taken,
        "default": {"method": chosen.method, "why": chosen.why, "of_ours": list(chosen.of_ours), "rule": RULE},
        "tables": {name: [json_row(row) for row in rows] for name, rows in tables(found).items() if name not in LONG},
    }  # fmt: skip


def write_all(
    found: Judged, folder: Path, report: Callable[[str], None] = lambda _line: None, drawings: bool = True
) -> list[Path]:
    """Write everything and give the paths, the report last; what an earlier evaluation wrote here and this one does
    not is removed, nothing else is touched."""
    from palpate.analysis.reports.figures import DrawnFigure
    from palpate.modeling.textures.evaluation_figures import figures
    from palpate.modeling.textures.evaluation_report import report_html

    def draw(place: Path) -> list[DrawnFigure]:
        report("drawing")
        return list(figures(found, place)) if drawings else []

    return write_evaluation(folder, tables(found), draw, partial(report_html, found), lambda: as_json(found))


def default_of(lab: Path, recordings: Sequence[Recording]) -> str:
    """The method that a lab's own evaluation of the very same recordings chose, else the shipped default.

    An evaluation without the shipped default among its methods says nothing against it.
    """
    told = read_results(folder_for(lab))
    try:
        same = {each["digest"] for each in told["data"].values()} == set(map(recording_digest, recordings))
        evaluated = {row["method"] for row in told["tables"]["methods"]}
        if same and not told["quick"] and DEFAULT in evaluated and told["default"]["method"] in METHODS:
            return str(told["default"]["method"])
    except (KeyError, TypeError, AttributeError):
        pass
    return DEFAULT
