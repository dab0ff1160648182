"""The reference values that tests, benchmarks and the demonstration use: see `reference/NOTICE`."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.analysis.statistics.refusals import StatisticsError
from palpate.protocols.tables import read_table

FOLDER = Path(__file__).resolve().parent.parent / "reference"
NUMBERS = ("y", "days")


class NoSuchReference(StatisticsError):
    """A reference that is not shipped."""


def reference_path(name: str) -> Path:
    """Return the path of a reference file by name, such as "csv/sk2011.1.csv". Raises NoSuchReference."""
    path = FOLDER / name
    if not path.is_file():
        known = ", ".join(sorted(file.name for file in path.parent.glob("*")) or sorted(folders()))
        raise NoSuchReference(f"no reference {name!r}; there is {known}")
    return path


def folders() -> list[str]:
    """Return the names of the files in the reference folder."""
    return [path.name for path in FOLDER.iterdir()]


def reference_values(name: str) -> dict[str, Any]:
    """Read a JSON file of expected values by its stem: "r_reference", "exact_reference", "edge_cases_exact"."""
    values: dict[str, Any] = json.loads(reference_path(f"{name}.json").read_text(encoding="utf-8"))
    return values


def reference_table(name: str) -> pd.DataFrame:
    """Read a long table, labels as text and `y` as the double nearest to the decimal number in the file."""
    table = read_table(reference_path(name))
    rows = [row.cells for row in table.rows()]
    return pd.DataFrame(
        {key: [float(row[key]) if key in NUMBERS else row[key] for row in rows] for key in table.header}
    )


def edge_cases() -> list[str]:
    """Return the names of the tables that break common implementations and have an exact answer."""
    return [name for name in reference_values("edge_cases_exact") if (FOLDER / "edge_cases" / f"{name}.csv").is_file()]


def edge_table(name: str) -> pd.DataFrame:
    """Read one edge case: columns subject, cond, y."""
    return reference_table(f"edge_cases/{name}.csv")


def nist_values() -> dict[str, Any]:
    """Read the certified and exact values of the NIST StRD one-way sets, by set."""
    return dict(reference_values("nist/nist_anova"))


def nist_table(name: str) -> pd.DataFrame:
    """Read one NIST StRD set: columns group (text) and y."""
    lines = reference_path(f"nist/{name}.dat").read_text(encoding="ascii").splitlines()
    named = (re.search(r"Data\s+\(lines\s+(\d+)\s+to\s+(\d+)\)", line) for line in lines[:20])
    match = next(filter(None, named), None)
    if match is None:
        raise NoSuchReference(f"{name}.dat does not say on which lines its data stand")
    first, last = int(match[1]), int(match[2])
    pairs = [line.split() for line in lines[first - 1 : last]]
    return pd.DataFrame({"group": [pair[0] for pair in pairs], "y": [float(pair[1]) for pair in pairs]})
