"""A regenerated study as files: tidy tables, a CSV for each test and figure, statistics.json, documents, the report.

Files are moved into place when all of them are written, and never replace anything that was not made here.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path, PurePosixPath
from typing import Any

import pandas as pd

from palpate.analysis.crosschecking.checks import FILE as CROSSCHECK
from palpate.analysis.crosschecking.checks import crosscheck_json
from palpate.analysis.plans.answers import Answer, QuestionResult
from palpate.analysis.plans.kinds import FIGURES, TESTS
from palpate.analysis.plans.sources import source_of
from palpate.analysis.regenerating.page import numbered_tables, report_html
from palpate.analysis.regenerating.plan_figures import draw_all
from palpate.analysis.regenerating.regeneration import RegeneratedStudy
from palpate.analysis.reports.csv_files import csv_text, json_row, table_csv
from palpate.analysis.reports.latex import latex_text
from palpate.analysis.reports.tables import heading
from palpate.analysis.reports.word import word_bytes
from palpate.protocols.canonical import json_text
from palpate.protocols.files import staged_files, write_bytes, write_text, write_texts
from palpate.protocols.progress import Progress

STATISTICS = "statistics.json"
OUTCOMES = "outcomes"
"""The key of the outcomes' descriptions in statistics.json, which early versions did not write."""
FOLDER = "regenerated"
"""The folder of a lab's regenerated studies."""
SIMULATED = "Simulated participants: no person gave these answers."
TIMES = "seconds.json"
"""Times of answers, measured once in a lab and kept by later runs, so that bytes are equal."""
MARK = ".palpate-regenerated.json"
"""The file in every folder of outputs that lists them."""
Seconds = Mapping[int, float]


class PlaceRefused(ValueError):
    """The outputs cannot be written there without loss."""


def file_texts(study: RegeneratedStudy, seconds: Seconds) -> dict[str, str]:
    """Return the text of every table and of statistics.json by path in the folder; equal inputs give equal texts."""
    texts = {STATISTICS: statistics_json(study, seconds)}
    for name, table in material_tables(study).items():
        texts[f"tables/{name}.csv"] = table_csv(table)
    lines = [asdict(line) for line in study.exclusions]
    texts["tables/exclusions.csv"] = csv_text(lines) if lines else "what,who,why,rows,into\n"
    for name, rows in test_rows(study.answered).items():
        texts[f"tests/{name}.csv"] = csv_text(rows)
    for figure in study.figures:
        if figure.data is not None:
            texts[f"figures/{figure.settings.name}.csv"] = csv_text(figure.data.rows)
    return texts


def material_tables(study: RegeneratedStudy) -> dict[str, pd.DataFrame]:
    """Return the tidy tables of the data used, after exclusions, without empty ones."""
    material = study.material
    tables = {"trials": material.trials, "words": material.words, "forms": material.forms, **own_tables_used(study)}
    if material.ratings is not None:
        tables = {"ratings": material.ratings.table, **tables}
    return {name: table for name, table in tables.items() if len(table)}


def own_tables_used(study: RegeneratedStudy) -> dict[str, pd.DataFrame]:
    """Return the own table with the study's answers, and any other that a test or figure is about."""
    plan, own = study.plan, study.material.own
    used = {source_of(test, TESTS[test.test]) for test in plan.tests}
    used |= {source_of(figure, FIGURES[figure.figure]) for figure in plan.figures}
    return {name: table for place, (name, table) in enumerate(own.items()) if place == 0 or name in used}


def test_rows(results: Sequence[QuestionResult]) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of each test's CSV file by outcome, with reasons of refused ones, and the tables in `more`."""
    tables: dict[str, list[dict[str, Any]]] = {}
    for result in results:
        about = {"outcome": result.outcome} if result.outcome else {}
        rows = tables.setdefault(result.settings.name, [])
        if result.answer is None:
            rows.append({**about, "refused": result.refused})
            continue
        rows += [{**about, **row} for row in result.answer.rows]
        for name, more in result.answer.more.items():
            tables.setdefault(f"{result.settings.name}.{name}", []).extend({**about, **row} for row in more)
    return {name: rows for name, rows in tables.items() if rows}


def statistics_json(study: RegeneratedStudy, seconds: Seconds) -> str:
    """Return every number with the hash of its inputs, the method, what each column is, n, exclusions and seconds."""
    material, plan = study.material, study.plan
    settings = ("alpha", "seed", "draws", "sessions", "missing", "normalise")
    declared = {name: getattr(plan.declared, name) for name in settings}
    outcomes = []  # what the ends of each rated outcome's scale mean: its name may be the low end
    if material.study is not None and material.study.scale is not None:
        ends = {"from": material.study.scale.low, "to": material.study.scale.high}
        outcomes = [{"name": a.name, "low": a.low, "high": a.high, **ends} for a in material.study.attributes]
    statistics = {
        "study": material.name,
        "title": study.title,
        "plan": {"file": plan.path.name, "sha256": plan.sha256, **declared},
        "simulated": material.simulated,
        "simulation_seeds": list(material.seeds),
        "participants": len(material.participants),
        **({"sample": study.sample} if study.sample else {}),
        **({OUTCOMES: outcomes} if outcomes else {}),
        "trials": len(material.trials),
        "exclusions": [asdict(line) for line in study.exclusions],
        **({"notes": list(study.notes)} if study.notes else {}),
        "inputs": [asdict(entry) for entry in study.inputs],
        **({"versions": [asdict(version) for version in material.versions]} if material.versions else {}),
        "software": dict(study.software),
        "tests": [_test(result, seconds.get(place)) for place, result in enumerate(study.answered)],
        "figures": [
            {"name": figure.settings.name, "figure": figure.settings.figure, "refused": figure.refused or None}
            for figure in study.figures
        ],
    }
    return readable_json(statistics) + "\n"


def readable_json(value: Any, indent: int = 0) -> str:
    """Return JSON with a row of plain values per line: half as long, and a difference shows the whole row."""
    inner = list(value.values()) if isinstance(value, dict) else value
    if not isinstance(value, dict | list) or not any(isinstance(item, dict | list) and item for item in inner):
        return json.dumps(value, ensure_ascii=False, allow_nan=False)
    pad, texts = " " * (indent + 1), [readable_json(item, indent + 1) for item in inner]
    if isinstance(value, dict):
        names = (json.dumps(name, ensure_ascii=False) for name in value)
        texts = [f"{name}: {text}" for name, text in zip(names, texts, strict=True)]
    opened, closed = "{}" if isinstance(value, dict) else "[]"
    return f"{opened}\n{pad}" + f",\n{pad}".join(texts) + f"\n{' ' * indent}{closed}"


def _test(result: QuestionResult, seconds: float | None) -> dict[str, Any]:
    answer, missing = result.answer, result.missing
    about: dict[str, Any] = {
        "name": result.settings.name,
        "test": result.settings.test,
        "outcome": result.outcome or None,
        "asked": result.settings.model_dump(mode="json", exclude={"name", "test", "outcomes"}, exclude_defaults=True),
        "inputs_sha256": result.inputs or None,
        "missing": {
            "policy": missing.policy,
            "cells": missing.cells,
            "participants_with_gaps": missing.participants,
            "left_out": list(missing.left_out),
        },
        "seconds": seconds,
        "refused": result.refused or None,
    }
    if answer is None:
        return about
    return about | {
        "method": answer.method,
        "kinds": kinds_of(answer),
        "participants": answer.participants,
        "values": answer.values,
        "headline": answer.headline or None,
        "notes": list(answer.notes),
        "results": [json_row(row) for row in answer.rows],
        "more": {name: [json_row(row) for row in rows] for name, rows in answer.more.items()},
    }


def kinds_of(answer: Answer) -> dict[str, str]:
    """Return the meaning of each column of numbers: the answer's own, else the statistic's usual name."""
    rows = (*answer.rows, *(row for more in answer.more.values() for row in more))
    numbers = dict.fromkeys(name for row in rows for name, value in row.items() if isinstance(value, int | float))
    return {name: answer.kinds.get(name) or heading(name) for name in (*answer.kinds, *numbers)}


def write_all(
    study: RegeneratedStudy,
    folder: Path,
    seconds: dict[int, float],
    figures: bool,
    progress: Progress = lambda *_: None,
) -> list[Path]:
    """Write every output to `folder` and return the paths; equal inputs give equal bytes.

    Without `figures` neither pictures nor the report are made. Files of an earlier run that this one does not write are
    removed; no others are touched. Raises PlaceRefused if a file of other origin is in the way.
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
    """Return the seconds of each answer by its place: as first measured in this lab, else as measured and saved now."""
    file = lab / FOLDER / TIMES
    stored: Any = None  # a file that is no such record is written anew, for it holds nothing but times
    with suppress(OSError, ValueError):
        stored = json.loads(file.read_text(encoding="utf-8"))
    entries = stored.items() if isinstance(stored, dict) else ()
    known = {key: value for key, value in entries if isinstance(value, float) and 0 <= value < math.inf}
    seconds, fresh = {}, False
    for place, result in enumerate(study.answered):
        # A time belongs to the question with all that the plan says about it, its inputs and the software.
        question = {
            "asked": result.settings.model_dump(mode="json"),
            "outcome": result.outcome,
            "inputs": result.inputs,
        }
        declared, policy = study.plan.declared, result.missing.policy
        plan = {"alpha": declared.alpha, "seed": declared.seed, "draws": declared.draws, "missing": policy}
        text = json.dumps(question | plan | {"software": dict(study.software)}, sort_keys=True)
        key = hashlib.sha256(text.encode()).hexdigest()[:24]
        if key not in known:
            known[key], fresh = float(f"{result.seconds:.2g}"), True
        seconds[place] = known[key]
    if fresh:
        write_text(file, json_text(known, indent=0, sort_keys=True))
    return seconds


@contextmanager
def written_whole(folder: Path) -> Iterator[tuple[Path, list[str]]]:
    """Yield an empty folder to write into, and a list that has the files' names once they are in `folder`.

    Files that an earlier run listed and this one did not write are removed. If writing fails or is stopped, `folder` is
    unchanged. Raises PlaceRefused if a file that no earlier run listed is in the way.
    """
    names, obsolete = list[str](), list[str]()
    with staged_files(folder, last=[MARK], obsolete=obsolete) as draft:
        yield draft, names
        names += sorted(path.relative_to(draft).as_posix() for path in draft.rglob("*") if path.is_file())
        earlier = listed(folder)
        if foreign := [name for name in names if name not in earlier and (folder / name).exists()]:
            raise PlaceRefused(
                f"{folder}: {foreign[0]} exists and was not written by regenerate (it is not listed in {MARK});"
                " nothing was written: give another folder with --to, or move that file away"
            )
        obsolete += sorted(earlier - set(names))
        write_text(draft / MARK, json_text({"files": sorted(names)}, indent=1))
    for name in obsolete:
        with suppress(OSError):
            (folder / name).parent.rmdir()


def listed(folder: Path) -> frozenset[str]:
    """Return the files that an earlier run listed in `folder`, none without a list."""
    try:
        files = json.loads((folder / MARK).read_text(encoding="utf-8"))["files"]
    except (OSError, ValueError, KeyError, TypeError):
        return frozenset()
    paths = {str(name): PurePosixPath(str(name)) for name in files} if isinstance(files, list) else {}
    return frozenset(n for n, path in paths.items() if path.parts and not path.is_absolute() and ".." not in path.parts)
