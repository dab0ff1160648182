"""A regenerated study as files: tidy tables, one CSV for each test and figure, and one JSON with every number."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import pandas as pd

from palpate.analysis.plans.answers import Answer
from palpate.analysis.regenerating.plan_tests import QuestionResult
from palpate.analysis.regenerating.regeneration import RegeneratedStudy
from palpate.analysis.reports.csv_files import csv_text, json_row, table_csv
from palpate.analysis.reports.headings import heading

STATISTICS = "statistics.json"
OUTCOMES = "outcomes"
"""The key of statistics.json that says what outcomes mean; Palpate did not always write it."""
Seconds = Mapping[int, float]


def file_texts(study: RegeneratedStudy, seconds: Seconds) -> dict[str, str]:
    """Return the text of every table and of statistics.json by its path in the folder; the same for equal inputs."""
    texts = {STATISTICS: statistics_json(study, seconds)}
    for name, table in material_tables(study).items():
        texts[f"tables/{name}.csv"] = table_csv(table)
    texts["tables/exclusions.csv"] = _table(("what", "who", "why", "rows", "into"), map(asdict, study.exclusions))
    for name, rows in test_rows(study.answered).items():
        texts[f"tests/{name}.csv"] = csv_text(rows)
    for figure in study.figures:
        if figure.data is not None:
            texts[f"figures/{figure.settings.name}.csv"] = csv_text(figure.data.rows)
    return texts


def _table(columns: Sequence[str], rows: Iterable[dict[str, Any]]) -> str:
    """Return a table that has its head also where it has no rows."""
    records = list(rows)
    return csv_text(records) if records else ",".join(columns) + "\n"


def material_tables(study: RegeneratedStudy) -> dict[str, pd.DataFrame]:
    """Return the tidy tables that the answers rest on, after exclusions; those that are empty are left out."""
    material = study.material
    tables = {"trials": material.trials, "words": material.words, "forms": material.forms}
    if material.ratings is not None:
        tables = {"ratings": material.ratings.table, **tables}
    return {name: table for name, table in tables.items() if len(table)}


def test_rows(results: Sequence[QuestionResult]) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of each test's CSV: its outcomes in order, a refused one with its reason; `more` beside it."""
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
    return readable_json(_statistics(study, seconds)) + "\n"


def readable_json(value: Any, indent: int = 0) -> str:
    """JSON in which a row of plain values stands on one line: half as long, and a difference shows the whole row."""
    inner = list(value.values()) if isinstance(value, dict) else value
    if not isinstance(value, dict | list) or not any(isinstance(item, dict | list) and item for item in inner):
        return json.dumps(value, ensure_ascii=False, allow_nan=False)
    pad, texts = " " * (indent + 1), [readable_json(item, indent + 1) for item in inner]
    if isinstance(value, dict):
        names = (json.dumps(name, ensure_ascii=False) for name in value)
        texts = [f"{name}: {text}" for name, text in zip(names, texts, strict=True)]
    opened, closed = "{}" if isinstance(value, dict) else "[]"
    return f"{opened}\n{pad}" + f",\n{pad}".join(texts) + f"\n{' ' * indent}{closed}"


def _statistics(study: RegeneratedStudy, seconds: Seconds) -> dict[str, Any]:
    material, plan = study.material, study.plan
    return {
        "study": material.name,
        "title": study.title,
        "plan": {"file": plan.path.name, "sha256": plan.sha256, **_declared(study)},
        "simulated": material.simulated,
        "simulation_seeds": list(material.seeds),
        "participants": len(material.participants),
        **({"sample": study.sample} if study.sample else {}),
        **({OUTCOMES: outcomes} if (outcomes := _outcomes(study)) else {}),
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


def _outcomes(regenerated: RegeneratedStudy) -> list[dict[str, Any]]:
    """Return what each rated outcome is called, and what the ends of its scale mean: the name may be the low end."""
    study = regenerated.material.study
    if study is None or study.scale is None:
        return []
    ends = {"from": study.scale.low, "to": study.scale.high}
    return [
        {"name": attribute.name, "low": attribute.low, "high": attribute.high, **ends} for attribute in study.attributes
    ]


def _declared(study: RegeneratedStudy) -> dict[str, Any]:
    declared = study.plan.declared
    return {name: getattr(declared, name) for name in ("alpha", "seed", "draws", "sessions", "missing", "normalise")}


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
    """Return what each column of numbers is: as the answer says it, else the statistic's usual name."""
    rows = (*answer.rows, *(row for more in answer.more.values() for row in more))
    numbers = dict.fromkeys(name for row in rows for name, value in row.items() if isinstance(value, int | float))
    return {name: answer.kinds.get(name) or heading(name) for name in (*answer.kinds, *numbers)}
