"""Psych-DS: the tables as CSV files under data/, their columns described for schema.org."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from palpate.analysis.exporting.description import About, as_json, changes, palpate_version, readme, redacted, withheld
from palpate.analysis.exporting.guard import Guard
from palpate.analysis.exporting.source import Watch, unwatched
from palpate.analysis.exporting.stimuli import copy_files, stimulus_files
from palpate.analysis.exporting.tables import Shared, definition
from palpate.analysis.exporting.tabular import Column, Table, write_csv
from palpate.protocols.files import write_text

SCHEMA = "https://schema.org"
VERSION = "Psych-DS 0.4.0"


def write_psych_ds(shared: Shared, of: About, guard: Guard, draft: Path, watch: Watch = unwatched) -> None:
    """dataset_description.json, README.md, CHANGES.md, data/study-STUDY_description-TABLE_data.csv, materials/."""
    study = re.sub(r"[^A-Za-z0-9]", "", shared.source.study.study)
    holds = []
    for table in watch(shared.tables, "writing tables"):
        name = f"data/study-{study}_description-{table.name}_data.csv"
        guard.demand_columns(name, [column.name for column in table.columns])
        write_csv(draft / name, table, guard.watched(table, name))
        holds.append(f"`{name}`: {table.description}")
    write_text(draft / "dataset_description.json", as_json(_description(shared, of)))
    write_text(draft / "materials/study.json", as_json(definition(shared)))
    holds.append("`materials/study.json`: the study's definition, stimuli included.")
    files = stimulus_files(shared.source, shared.without)
    copy_files(files, draft / "materials/stimuli")
    holds.append(f"`materials/stimuli/`: {files.told}" if files.files else files.told)
    write_text(draft / "README.md", readme(of, shared.source, [*holds, *withheld(shared), *redacted(guard)]))
    write_text(draft / "CHANGES.md", changes(shared.source))
    write_text(draft / ".psychds-ignore", "materials\n.palpate-export.json\n")


def _description(shared: Shared, of: About) -> dict[str, Any]:
    lab = of.of_lab
    people = [{"@type": "Person", "name": name} for name in lab.get("Authors", [])]
    return {
        "@context": SCHEMA,
        "@type": "Dataset",
        "name": of.name,
        "description": of.description,
        "schemaVersion": VERSION,
        "license": of.licence,
        **({"author": people} if people else {}),
        **({"keywords": lab["Keywords"]} if "Keywords" in lab else {}),
        **({"identifier": lab["DatasetDOI"]} if "DatasetDOI" in lab else {}),
        "creditText": f"Exported by Palpate {palpate_version()}",
        "variableMeasured": list(_variables(shared.tables)),
    }


def _variables(tables: tuple[Table, ...]) -> Iterator[dict[str, Any]]:
    """Each column name once; where tables mean different things by it, each meaning is told."""
    found: dict[str, list[tuple[str, Column]]] = {}
    for table in tables:
        for column in table.columns:
            found.setdefault(column.name, []).append((table.name, column))
    for name, places in found.items():
        yield _variable(name, places)


def _variable(name: str, places: list[tuple[str, Column]]) -> dict[str, Any]:
    meanings = list(dict.fromkeys(column.description for _, column in places))
    told = meanings[0] if len(meanings) == 1 else " ".join(f"In {table}: {c.description}" for table, c in places)
    levels = {value: label for _, column in places for value, label in column.levels.items()}
    about: dict[str, Any] = {"@type": "PropertyValue", "name": name, "description": told}
    if units := {column.unit for _, column in places if column.unit}:
        about["unitText"] = ", ".join(sorted(units))
    if levels:
        about["valueReference"] = [
            {"@type": "PropertyValue", "value": value, "description": label} for value, label in levels.items()
        ]
    for key, bound in (("minValue", "low"), ("maxValue", "high")):
        found = [getattr(column, bound) for _, column in places if getattr(column, bound) is not None]
        about |= {key: found[0]} if found else {}
    return about
