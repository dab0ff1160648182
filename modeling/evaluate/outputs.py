"""The files of an evaluation (tables, figures, report, a JSON file with every number), and the default's choice."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from palpate.analysis.regenerating.outputs import readable_json
from palpate.analysis.reports.csv_files import csv_text, json_row
from palpate.analysis.reports.figures import DrawnFigure
from palpate.analysis.reports.page import Column, Points, Section, TableBlock, table
from palpate.modeling.training.run_card import versions
from palpate.protocols.files import staged_files, write_text, write_texts
from palpate.protocols.progress import Report

RESULTS, REPORT = "evaluation.json", "report.html"
Row = Mapping[str, Any]
Tables = Mapping[str, Sequence[Row]]


@dataclass(frozen=True)
class Choice:
    """The default method, the reason, and sentences that compare the proposed method with the others."""

    method: str
    why: str
    of_ours: tuple[str, ...] = ()

    def as_json(self, rule: str) -> dict[str, Any]:
        """Return the decision, with its rule, as JSON holds it."""
        return {"method": self.method, "why": self.why, "of_ours": list(self.of_ours), "rule": rule}

    def section(self, rule: str, points: Iterable[tuple[str, str]]) -> Section:
        """Return the report's summary: the default and the rule, and further points."""
        return Section(
            "short", "In short", (Points((("Default", f"{self.method}. {self.why}"), ("The rule", rule), *points)),)
        )


def evaluation_folder(lab: Path, name: str) -> Path:
    """Return the folder of a lab's evaluation."""
    return lab / "evaluated" / name


def jobs_folder(lab: Path, name: str) -> Path:
    """Return the folder of the finished jobs of a lab's evaluation."""
    return evaluation_folder(lab, name) / ".jobs"


def write_evaluation(
    folder: Path,
    tables: Tables,
    figures: Callable[[Path], Iterable[DrawnFigure]] | None,
    page: Callable[[Sequence[DrawnFigure]], str],
    results: Callable[[], Mapping[str, Any]],
    report: Report,
) -> list[Path]:
    """Write everything and return the paths, the report last.

    Files that an earlier evaluation wrote and this one does not are removed; no others are touched. `figures` writes
    them (SVG, PNG) into the folder that it is given; None: no figures.
    """
    texts = {f"tables/{name}.csv": csv_text([json_row(row) for row in rows]) for name, rows in tables.items()}
    obsolete: list[str] = []
    with staged_files(folder, last=[RESULTS], obsolete=obsolete) as draft:
        write_texts(draft, texts)
        report("drawing")
        drawn = [] if figures is None else list(figures(draft / "figures"))
        names = [*texts, *(f"figures/{figure.name}.{kind}" for figure in drawn for kind in ("svg", "png"))]
        write_text(draft / REPORT, page(drawn))
        content = {**results(), "files": sorted([*names, REPORT])}
        write_text(draft / RESULTS, readable_json(content) + "\n")
        # files that the earlier evaluation in the folder names as its own
        earlier = read_results(folder).get("files", [])
        earlier = [name for name in earlier if isinstance(name, str)] if isinstance(earlier, list) else []
        inside = [name for name in earlier if (folder / name).resolve().is_relative_to(folder.resolve())]
        obsolete += [name for name in inside if name not in content["files"]]
    return [folder / name for name in (*names, RESULTS, REPORT)]


def read_results(folder: Path) -> dict[str, Any]:
    """Return the JSON data of the evaluation in the folder; empty where it is missing or unreadable."""
    try:
        results = json.loads((folder / RESULTS).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return results if isinstance(results, dict) else {}


def tables_as_json(tables: Tables, long: Sequence[str]) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of the tables without the long ones, which are written as CSV only."""
    return {name: [json_row(row) for row in rows] for name, rows in tables.items() if name not in long}


def software_table() -> TableBlock:
    """Return the table of the packages that determine a result, with their versions."""
    rows = [{"package": name, "version": version or "not installed"} for name, version in versions().items()]
    return table("Software", rows, [Column("package", "package"), Column("version", "version")])


@cache
def printed_numbers(file: Path) -> Mapping[str, Any]:
    """Return the numbers in the file, which is read once."""
    import yaml

    content: Mapping[str, Any] = yaml.safe_load(file.read_text(encoding="utf-8"))
    return content
