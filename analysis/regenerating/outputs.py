"""Everything that a regenerated study is written to: tables, statistics, figures, documents and the report."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Any

from palpate.analysis.crosschecking.checks import FILE as CROSSCHECK
from palpate.analysis.crosschecking.checks import crosscheck_json
from palpate.analysis.regenerating.descriptions import numbered_tables
from palpate.analysis.regenerating.files import file_texts
from palpate.analysis.regenerating.output_folder import written_whole
from palpate.analysis.regenerating.page import report_html
from palpate.analysis.regenerating.plan_figures import draw_all
from palpate.analysis.regenerating.plan_tests import QuestionResult
from palpate.analysis.regenerating.regeneration import RegeneratedStudy
from palpate.analysis.reports.latex import latex_text
from palpate.analysis.reports.word import word_bytes
from palpate.protocols.canonical import json_text
from palpate.protocols.files import write_bytes, write_text, write_texts
from palpate.protocols.progress import Progress

FOLDER = "regenerated"
"""Where a lab keeps what was regenerated."""
SIMULATED = "Simulated participants: no person gave these answers."
TIMES = "seconds.json"
"""How long each number took, measured once in a lab: a run that makes it again leaves its time, for equal bytes."""


def write_all(
    study: RegeneratedStudy,
    folder: Path,
    seconds: dict[int, float],
    figures: bool,
    progress: Progress = lambda *_: None,
) -> list[Path]:
    """Write every output to `folder` and give the paths: equal inputs give equal bytes.

    Without `figures` neither pictures nor the report are made. What an earlier run made and this one does not is
    removed; nothing else in the folder is touched. Raises PlaceRefused where another's file is in the way.
    """
    with written_whole(folder) as (draft, names):
        # The pictures first: of all that is written they take the most memory.
        pictures = list(draw_all(study.figures, draft / "figures", progress)) if figures else []
        write_texts(draft, file_texts(study, seconds))
        if study.checks is not None:
            write_texts(draft, {CROSSCHECK: crosscheck_json(study.checks)})
        write_documents(study, draft)
        if figures:
            page = report_html(study, pictures, sum(seconds.values()))
            write_text(draft / "report.html", page)
    return [folder / name for name in names]


def write_documents(study: RegeneratedStudy, folder: Path) -> list[Path]:
    """Write tables.docx and tables.tex."""
    simulated = SIMULATED if study.material.simulated else ""
    tables = list(numbered_tables(study))
    word, latex = folder / "tables.docx", folder / "tables.tex"
    write_bytes(word, word_bytes(study.title, simulated, tables))
    write_text(latex, latex_text(study.title, simulated, tables))
    return [word, latex]


def times_of(study: RegeneratedStudy, lab: Path) -> dict[int, float]:
    """Return the seconds of each answer by its place: as first measured in this lab, else as measured now and saved."""
    file = lab / FOLDER / TIMES
    known = _read(file)
    seconds, fresh = {}, False
    for place, result in enumerate(study.answered):
        key = _key(result, study)
        if key not in known:
            known[key], fresh = float(f"{result.seconds:.2g}"), True
        seconds[place] = known[key]
    if fresh:
        write_text(file, json_text(known, indent=0, sort_keys=True))
    return seconds


def _read(file: Path) -> dict[str, float]:
    """Return what is on file; a file that is no such record is begun anew, for it holds nothing but times."""
    try:
        times: Any = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    if not isinstance(times, dict):
        return {}
    return {key: value for key, value in times.items() if isinstance(value, float) and 0 <= value < math.inf}


def _key(result: QuestionResult, study: RegeneratedStudy) -> str:
    """Return the key of a time: the question with all that the plan says about it, its inputs and the software."""
    declared = study.plan.declared
    settings = {"asked": result.settings.model_dump(mode="json"), "outcome": result.outcome, "inputs": result.inputs}
    plans = {"alpha": declared.alpha, "seed": declared.seed, "draws": declared.draws, "missing": result.missing.policy}
    text = json.dumps(settings | plans | {"software": dict(study.software)}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:24]
