"""A regenerated study as files: tidy tables, one CSV for each test and figure, and one JSON with every number."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import pandas as pd

from palpate.analysis.plans.answers import Answer
from palpate.analysis.regenerating.plan_tests import Answered
from palpate.analysis.regenerating.regeneration import Regenerated
from palpate.analysis.reports.csv_files import csv_text, json_row, table_csv
from palpate.analysis.reports.headings import heading

STATISTICS = "statistics.json"
OUTCOMES = "outcomes"
"""The key of statistics.json that says what outcomes mean; Palpate did not always write it."""
Seconds = Mapping[int, float]


def file_texts(found: Regenerated, seconds: Seconds) -> dict[str, str]:
    """The text of every table and of statistics.json by its path in the output folder; the same for equal inputs."""
    texts = {STATISTICS: statistics_json(found, seconds)}
    for name, table in material_tables(found).items():
        texts[f"tables/{name}.csv"] = table_csv(table)
    texts["tables/exclusions.csv"] = _table(("what", "who", "why", "rows", "into"), map(asdict, found.exclusions))
    for name, rows in test_rows(found.answered).items():
        texts[f"tests/{name}.csv"] = csv_text(rows)
    for each in found.pictured:
        if each.data is not None:
            texts[f"figures/{each.asked.name}.csv"] = csv_text(each.data.rows)
    return texts


def _table(columns: Sequence[str], rows: Iterable[dict[str, Any]]) -> str:
    """A table that has its head also where it has no rows."""
    found = list(rows)
    return csv_text(found) if found else ",".join(columns) + "\n"


def material_tables(found: Regenerated) -> dict[str, pd.DataFrame]:
    """The tidy tables that the answers rest on, after exclusions; those that the study does not have are left out."""
    material = found.material
    tables = {"trials": material.trials, "words": material.words, "forms": material.forms}
    if material.ratings is not None:
        tables = {"ratings": material.ratings.table, **tables}
    return {name: table for name, table in tables.items() if len(table)}


def test_rows(answered: Sequence[Answered]) -> dict[str, list[dict[str, Any]]]:
    """The rows of each test's CSV: its outcomes one after another, a refused one with its reason; `more` beside it."""
    tables: dict[str, list[dict[str, Any]]] = {}
    for each in answered:
        about = {"outcome": each.outcome} if each.outcome else {}
        rows = tables.setdefault(each.asked.name, [])
        if each.answer is None:
            rows.append({**about, "refused": each.refused})
            continue
        rows += [{**about, **row} for row in each.answer.rows]
        for name, more in each.answer.more.items():
            tables.setdefault(f"{each.asked.name}.{name}", []).extend({**about, **row} for row in more)
    return {name: rows for name, rows in tables.items() if rows}


def statistics_json(found: Regenerated, seconds: Seconds) -> str:
    """Every number with the hash of its inputs, the method, what each column is, n, exclusions and seconds."""
    return readable_json(_statistics(found, seconds)) + "\n"


def readable_json(value: Any, indent: int = 0) -> str:
    """JSON in which a row of plain values stands on one line: half as long, and a difference shows the whole row."""
    inner = list(value.values()) if isinstance(value, dict) else value
    if not isinstance(value, dict | list) or not any(isinstance(each, dict | list) and each for each in inner):
        return json.dumps(value, ensure_ascii=False, allow_nan=False)
    pad, texts = " " * (indent + 1), [readable_json(each, indent + 1) for each in inner]
    if isinstance(value, dict):
        names = (json.dumps(name, ensure_ascii=False) for name in value)
        texts = [f"{name}: {text}" for name, text in zip(names, texts, strict=True)]
    opened, closed = "{}" if isinstance(value, dict) else "[]"
    return f"{opened}\n{pad}" + f",\n{pad}".join(texts) + f"\n{' ' * indent}{closed}"


def _statistics(found: Regenerated, seconds: Seconds) -> dict[str, Any]:
    material, plan = found.material, found.plan
    return {
        "study": material.name,
        "title": found.title,
        "plan": {"file": plan.path.name, "sha256": plan.sha256, **_declared(found)},
        "simulated": material.simulated,
        "simulation_seeds": list(material.seeds),
        "participants": len(material.participants),
        **({"sample": found.sample} if found.sample else {}),
        **({OUTCOMES: outcomes} if (outcomes := _outcomes(found)) else {}),
        "trials": len(material.trials),
        "exclusions": [asdict(each) for each in found.exclusions],
        **({"notes": list(found.notes)} if found.notes else {}),
        "inputs": [asdict(each) for each in found.inputs],
        **({"versions": [asdict(version) for version in material.versions]} if material.versions else {}),
        "software": dict(found.software),
        "tests": [_test(each, seconds.get(place)) for place, each in enumerate(found.answered)],
        "figures": [
            {"name": each.asked.name, "figure": each.asked.figure, "refused": each.refused or None}
            for each in found.pictured
        ],
    }


def _outcomes(found: Regenerated) -> list[dict[str, Any]]:
    """What each rated outcome is called, and what the ends of its scale mean: a name may be that of the low end."""
    study = found.material.study
    if study is None or study.scale is None:
        return []
    ends = {"from": study.scale.low, "to": study.scale.high}
    return [{"name": each.name, "low": each.low, "high": each.high, **ends} for each in study.attributes]


def _declared(found: Regenerated) -> dict[str, Any]:
    declared = found.plan.declared
    return {name: getattr(declared, name) for name in ("alpha", "seed", "draws", "sessions", "missing", "normalise")}


def _test(each: Answered, seconds: float | None) -> dict[str, Any]:
    answer, told = each.answer, each.missing
    about: dict[str, Any] = {
        "name": each.asked.name,
        "test": each.asked.test,
        "outcome": each.outcome or None,
        "asked": each.asked.model_dump(mode="json", exclude={"name", "test", "outcomes"}, exclude_defaults=True),
        "inputs_sha256": each.inputs or None,
        "missing": {
            "policy": told.policy,
            "cells": told.cells,
            "participants_with_gaps": told.participants,
            "left_out": list(told.left_out),
        },
        "seconds": seconds,
        "refused": each.refused or None,
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
    """What each column of numbers is: as the answer says it, else the statistic's usual name."""
    rows = (*answer.rows, *(row for more in answer.more.values() for row in more))
    numbers = dict.fromkeys(name for row in rows for name, value in row.items() if isinstance(value, int | float))
    return {name: answer.kinds.get(name) or heading(name) for name in (*answer.kinds, *numbers)}
