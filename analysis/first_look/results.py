"""The files of an analysis: one JSON file with every number, and a CSV file for each table."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from palpate.analysis.first_look.analysis import Analysis, correction, reported_p, software
from palpate.analysis.first_look.figures import shown_factors
from palpate.analysis.first_look.study_statistics import Row, Test
from palpate.analysis.ratings.design_report import data_notes
from palpate.analysis.reports.csv_files import csv_text, records
from palpate.protocols.canonical import json_text
from palpate.protocols.files import write_texts

METHODS = {
    "crossed": "repeated-measures analysis of variance",
    "pooled": "repeated-measures analysis of variance",
    "between": "one-way analysis of variance between groups",
    "pairs": "paired t tests, two-sided",
}
EFFECT = {
    "Source": "effect",
    "SS": "sum_of_squares",
    "SS_error": "error_sum_of_squares",
    "MS": "mean_square",
    "ddof1": "df1",
    "ddof2": "df2",
    "F": "F",
    "p_unc": "p_uncorrected",
    "p_GG_corr": "p_greenhouse_geisser",
    "p_HF_corr": "p_huynh_feldt",
    "eps": "epsilon_greenhouse_geisser",
    "eps_HF": "epsilon_huynh_feldt",
    "np2": "partial_eta_squared",
    "ng2": "generalized_eta_squared",
    "eta2": "eta_squared",
    "note": "note",
}
PAIR = {
    "Contrast": "factor",
    "A": "a",
    "B": "b",
    "mean_diff": "mean_difference",
    "ci_low": "ci95_low",
    "ci_high": "ci95_high",
    "T": "t",
    "dof": "df",
    "p_unc": "p_uncorrected",
    "p_bonferroni": "p_bonferroni",
    "p_holm": "p_holm",
    "dz": "cohens_dz",
    "note": "note",
}


def write_results(analysis: Analysis, folder: Path) -> list[Path]:
    """Write statistics.json and the CSV tables to `folder`; return the paths. Equal inputs give equal bytes."""
    tables = {name: csv_text(rows) for name, rows in result_tables(analysis).items()}
    return write_texts(folder, {"statistics.json": statistics_json(analysis), **tables})


def statistics_json(analysis: Analysis) -> str:
    """Return every number of the analysis as JSON, with method, n, exclusions and the hash of every input.

    Keys are sorted and no value is NaN: an undefined number is null, and the `note` beside it says why.
    `ratings_per_cell` are the fewest and the most ratings that one participant's value is the mean of.
    """
    return json_text(statistics_data(analysis), indent=1, sort_keys=True)


def statistics_data(analysis: Analysis) -> dict[str, Any]:
    """Return the content of statistics.json as data."""
    ratings, design = analysis.ratings, analysis.design
    tests = []
    for test in analysis.statistics.tests:
        question = test.question
        tests.append(
            {
                "attribute": test.attribute,
                "kind": question.kind,
                "method": METHODS[question.kind],
                "factors": list(question.factors),
                "scope": question.scope,
                "averaged_over": list(question.averaged_over),
                "participants": test.participants,
                "ratings_per_cell": list(test.ratings_per_cell) if test.rows else None,
                "ratings_per_level": {level: list(ends) for level, ends in test.ratings_per_level.items()},
                "refused": test.refused or None,
                "results": [named(row) for row in test.rows],
            }
        )
    return {
        "name": ratings.name,
        "title": analysis.title,
        "simulated": ratings.simulated,
        "participants": len(ratings.participants),
        "ratings": len(ratings.table),
        "attributes": list(ratings.attributes),
        "design": {
            "complete": design.ok,
            "problems": [problem.text() for problem in design.problems],
            "notes": list(data_notes(design.notes, ratings.exclusions, ratings.sessions)),
        },
        "interrupted_sessions_included": list(ratings.interrupted),
        "simulation_seeds": list(ratings.seeds),
        "stimulus_sources": dict(ratings.stimulus_sources),
        "exclusions": [asdict(line) for line in ratings.exclusions],
        "inputs": [asdict(entry) for entry in ratings.inputs],
        "means": {"levels": records(analysis.levels), "stimuli": records(analysis.stimuli)},
        "tests": tests,
        "software": dict(software()),
    }


def result_tables(analysis: Analysis) -> dict[str, list[dict[str, Any]]]:
    """Return the rows of each CSV file by name; level means are named by their factor: variant_means.csv."""
    levels = re.sub(r"\W+", "_", "_".join(shown_factors(analysis.ratings))).strip("_") or "level"
    tests = analysis.statistics.tests
    return {
        "ratings.csv": records(analysis.ratings.table),
        "stimulus_means.csv": records(analysis.stimuli),
        f"{levels}_means.csv": records(analysis.levels),
        "anova.csv": [row for test in tests if test.question.kind != "pairs" for row in _flat(test)],
        "pairwise.csv": [row for test in tests if test.question.kind == "pairs" for row in _flat(test)],
    }


def named(row: Row) -> dict[str, Any]:
    """Return a row of a test with descriptive names of its numbers."""
    if "Contrast" in row:
        return {name: row[column] for column, name in PAIR.items() if column in row}
    effect = {name: row[column] for column, name in EFFECT.items() if column in row}
    return {**effect, "p": reported_p(row), "correction": correction(row) or None}


def _flat(test: Test) -> Iterator[dict[str, Any]]:
    about = {"attribute": test.attribute, "scope": test.question.scope, "factors": " x ".join(test.question.factors)}
    if test.refused:
        yield {**about, "participants": test.participants, "note": test.refused}
    for row in test.rows:
        yield {**about, "participants": test.participants, **named(row)}
