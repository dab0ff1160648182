"""Psych-DS: tables as CSV files under data/, with columns described for schema.org."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from palpate.analysis.exporting.description import (
    Description,
    changes_text,
    json_for_people,
    palpate_version,
    readme_text,
    redacted_lines,
    withheld_lines,
)
from palpate.analysis.exporting.guard import Guard
from palpate.analysis.exporting.source import Watch, no_progress
from palpate.analysis.exporting.stimuli import copy_files, stimulus_files
from palpate.analysis.exporting.tables import DataSet, shared_definition
from palpate.analysis.exporting.tabular import Column, write_csv
from palpate.protocols.files import write_text

SCHEMA = "https://schema.org"
VERSION = "Psych-DS 0.4.0"
NO_LETTER = re.compile("[^A-Za-z0-9]")
"""What a value in the name of a file cannot contain."""


def write_psych_ds(
    data_set: DataSet, description: Description, guard: Guard, draft: Path, watch: Watch = no_progress
) -> None:
    """Write dataset_description.json, README.md, CHANGES.md, data/ and materials/.

    Tables are data/study-STUDY_description-TABLE_data.csv.
    """
    study = re.sub(NO_LETTER, "", data_set.source.study.study)
    holds = []
    for table in watch(data_set.tables, "writing tables"):
        name = f"data/study-{study}_description-{re.sub(NO_LETTER, '', table.name)}_data.csv"
        guard.demand_columns(name, [column.name for column in table.columns])
        write_csv(draft / name, table, guard.watched(table, name))
        holds.append(f"`{name}`: {table.description}")
    write_text(draft / "dataset_description.json", json_for_people(_description(data_set, description)))
    write_text(draft / "materials/study.json", json_for_people(shared_definition(data_set)))
    holds.append("`materials/study.json`: the study's definition, stimuli included.")
    files = stimulus_files(data_set.source, data_set.without)
    copy_files(files, draft / "materials/stimuli")
    holds.append(f"`materials/stimuli/`: {files.note}" if files.files else files.note)
    write_text(
        draft / "README.md",
        readme_text(description, data_set.source, [*holds, *withheld_lines(data_set), *redacted_lines(guard)]),
    )
    write_text(draft / "CHANGES.md", changes_text(data_set.source))
    write_text(draft / ".psychds-ignore", "materials\n.palpate-export.json\n")


def _description(data_set: DataSet, description: Description) -> dict[str, Any]:
    lab = description.of_lab
    people = [{"@type": "Person", "name": name} for name in lab.get("Authors", [])]
    # Each column name once; where tables mean different things by it, with each meaning.
    variables: list[dict[str, Any]] = []
    places_of: dict[str, list[tuple[str, Column]]] = {}
    for table in data_set.tables:
        for column in table.columns:
            places_of.setdefault(column.name, []).append((table.name, column))
    for name, places in places_of.items():
        meanings = list(dict.fromkeys(column.description for _, column in places))
        meaning = meanings[0] if len(meanings) == 1 else " ".join(f"In {table}: {c.description}" for table, c in places)
        levels = {value: label for _, column in places for value, label in column.levels.items()}
        about: dict[str, Any] = {"@type": "PropertyValue", "name": name, "description": meaning}
        if units := {column.unit for _, column in places if column.unit}:
            about["unitText"] = ", ".join(sorted(units))
        if levels:
            about["valueReference"] = [
                {"@type": "PropertyValue", "value": value, "description": label} for value, label in levels.items()
            ]
        for key, bound in (("minValue", "low"), ("maxValue", "high")):
            bounds = [getattr(column, bound) for _, column in places if getattr(column, bound) is not None]
            about |= {key: bounds[0]} if bounds else {}
        variables.append(about)
    return {
        "@context": SCHEMA,
        "@type": "Dataset",
        "name": description.name,
        "description": description.description,
        "schemaVersion": VERSION,
        "license": description.licence,
        **({"author": people} if people else {}),
        **({"keywords": lab["Keywords"]} if "Keywords" in lab else {}),
        **({"identifier": lab["DatasetDOI"]} if "DatasetDOI" in lab else {}),
        "creditText": f"Exported by Palpate {palpate_version()}",
        "variableMeasured": variables,
    }
