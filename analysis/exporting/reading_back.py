"""The ratings of an export, read back bit for bit as the table that every analysis begins with."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from palpate.analysis.exporting.folder import read_mark
from palpate.analysis.exporting.tabular import NOT_AVAILABLE, ExportRefused
from palpate.analysis.ratings.reading import column_name
from palpate.protocols.study import Study
from palpate.protocols.tables import read_table
from palpate.studies.sessions.tables import session_name

Cells = dict[str, str]


def exported_ratings(folder: Path) -> pd.DataFrame:
    """Return the ratings of a BIDS or CSV export that count, without practice, one per row.

    Equal to `read_ratings(...).table` of the sessions that were exported. Raises ExportRefused where the folder is no
    such export, or the study has no ratings.
    """
    mark = read_mark(folder)
    if mark.get("format") not in ("bids", "csv"):
        raise ExportRefused(f"{folder}: an export to {mark.get('format')}; one to bids or csv is read back")
    bids = mark["format"] == "bids"
    path = folder / ("code/study.json" if bids else "study.json")
    study = Study.model_validate(json.loads(path.read_text("utf-8")))
    every = _bids_ratings(folder) if bids else _csv_ratings(folder)
    rows = [row for row in every if row["counts"] == "true" and row["practice"] == "false"]
    if not rows:
        raise ExportRefused(f"{folder}: holds no rating")
    place = {attribute.name: n for n, attribute in enumerate(study.attributes)}
    stimuli = {stimulus.id: stimulus.columns for stimulus in study.stimuli}
    names = [session_name(study.study, row["participant"], int(row["session"])) for row in rows]
    order = sorted(
        range(len(rows)),
        key=lambda n: (rows[n]["participant"], names[n], int(rows[n]["trial"]), place[rows[n]["attribute"]]),
    )
    rows, names = [rows[n] for n in order], [names[n] for n in order]
    columns = [name for name in study.stimuli[0].columns if all(name in stimulus for stimulus in stimuli.values())]
    return pd.DataFrame(
        {
            "participant": [row["participant"] for row in rows],
            "attribute": [row["attribute"] for row in rows],
            "value": pd.Series([_number(row["value"]) for row in rows], dtype="float64"),
            "group": [row["group"] for row in rows],
            **{column_name(name): [stimuli[row["stimulus"]][name] for row in rows] for name in columns},
            "study": [study.study for _ in rows],
            "session": names,
            "trial": [int(row["trial"]) for row in rows],
            "block": [row["block"] for row in rows],
            "stimulus": [row["stimulus"] for row in rows],
            "response_time_s": pd.Series([_number(row["response_time_s"]) for row in rows], dtype="float64"),
            "revised": pd.Series([row["revised"] == "true" for row in rows], dtype="bool"),
        }
    )


def _csv_ratings(folder: Path) -> Iterator[Cells]:
    groups = {row["participant"]: row["group"] for row in _csv_rows(folder / "participants.csv")}
    for row in _csv_rows(folder / "ratings.csv"):
        yield {**row, "group": groups[row["participant"]]}


def _bids_ratings(folder: Path) -> Iterator[Cells]:
    """Yield the tables of sessions whose columns have ratings."""
    groups = {row["participant_id"]: row["group"] for row in _tsv_rows(folder / "participants.tsv")}
    for path in sorted(folder.glob("sub-*/ses-*/beh/*_beh.tsv")):
        subject, session = path.relative_to(folder).parts[:2]
        for row in _tsv_rows(path):
            if row.get("value"):
                yield {**row, "participant": subject.removeprefix("sub-"), "session": session.removeprefix("ses-"),
                       "group": groups[subject], "response_time_s": row["response_time"]}  # fmt: skip


def _csv_rows(path: Path) -> Iterator[Cells]:
    if not path.is_file():
        return
    yield from (dict(row.cells) for row in read_table(path).rows())


def _tsv_rows(path: Path) -> Iterator[Cells]:
    """Yield the rows of a BIDS table, which has no quotes; n/a becomes an empty text."""
    header, *lines = path.read_text("utf-8").removesuffix("\n").split("\n")
    for line in lines:
        cells = ["" if cell == NOT_AVAILABLE else cell for cell in line.split("\t")]
        yield dict(zip(header.split("\t"), cells, strict=True))


def _number(text: str) -> float:
    return float(text) if text else float("nan")
