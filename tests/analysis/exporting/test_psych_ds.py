"""Psych-DS: the rules of its schema (github.com/psych-ds/psych-DS, rules_and_conventions.md), checked one by one."""

from __future__ import annotations

import csv
import json
import re

import pytest

from tests.analysis.exporting.labs import exported, lab_of

NAME = re.compile(r"([a-z]+-[a-zA-Z0-9]+)(_[a-z]+-[a-zA-Z0-9]+)*_data\.csv")
"""fileRegex of rules.files.tabular_data.data.Datafile in the schema, for CSV."""
KEYS = {"study", "site", "subject", "session", "task", "condition", "trial", "stimulus", "description"}
"""The official keywords."""


@pytest.mark.parametrize("study", ["door_ratings", "door_authoring", "door_adjectives", "texture_capture"])
def test_the_rules_of_psych_ds_hold(study, tmp_path):
    exported(lab_of(tmp_path / "lab", study), study, tmp_path / "out", "psych-ds")
    about = json.loads((tmp_path / "out/dataset_description.json").read_text())
    assert about["@type"] == "Dataset" and about["@context"] == "https://schema.org"
    assert about["name"] and about["description"]
    files = [path for path in (tmp_path / "out/data").rglob("*") if path.is_file()]
    assert files and all(NAME.fullmatch(path.name) for path in files)
    assert {part.split("-")[0] for path in files for part in path.name.split("_")[:-1]} <= KEYS
    described = {variable["name"]: variable for variable in about["variableMeasured"]}
    assert all(variable["@type"] == "PropertyValue" and variable["description"] for variable in described.values())
    for path in files:
        with path.open(encoding="utf-8", newline="") as file:
            header, *rows = list(csv.reader(file))
        assert len(set(header)) == len(header) and set(header) <= set(described)
        assert all(len(row) == len(header) for row in rows)
    assert set(described) == {name for path in files for name in path.read_text("utf-8").split("\n")[0].split(",")}
    assert (tmp_path / "out/README.md").is_file() and (tmp_path / "out/CHANGES.md").is_file()


def test_a_variable_that_means_two_things_says_both(tmp_path):
    exported(lab_of(tmp_path / "lab", "door_ratings"), "door_ratings", tmp_path / "out", "psych-ds")
    about = json.loads((tmp_path / "out/dataset_description.json").read_text())
    value = next(variable for variable in about["variableMeasured"] if variable["name"] == "value")
    assert "In ratings: The rating" in value["description"] and "In answers: The answer" in value["description"]
    assert (value["minValue"], value["maxValue"]) == (-10, 10)
