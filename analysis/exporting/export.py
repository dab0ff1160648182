"""Writing the requested data set to a folder, all or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from palpate.analysis.exporting.bids import write_bids
from palpate.analysis.exporting.csv_and_parquet import demand_parquet, write_csv_files, write_parquet_files
from palpate.analysis.exporting.description import describe, palpate_version
from palpate.analysis.exporting.folder import demand_place, export_folder
from palpate.analysis.exporting.guard import Guard
from palpate.analysis.exporting.psych_ds import write_psych_ds
from palpate.analysis.exporting.source import Watch, no_progress, open_source
from palpate.analysis.exporting.tables import build_data_set
from palpate.analysis.ratings.sources import DataRequest
from palpate.studies.participants.identities import identities

LEAST_PEOPLE = 3
"""The least number of people who share an answer about themselves that is exported, as in an analysis plan."""
Format = Literal["bids", "psych-ds", "csv", "parquet"]


@dataclass(frozen=True)
class Choices:
    """How a data set is shared.

    `without` names columns and questions to leave out, `dates` includes the times at which sessions began, `free_text`
    what was written in an interview; `least_people` is how many must share an answer about themselves for it to be
    included; `redact` replaces texts that may identify somebody, `recordings` includes the streams in BIDS.
    """

    format: Format
    without: Sequence[str] = ()
    dates: bool = False
    redact: bool = False
    recordings: bool = True
    replace: bool = False
    free_text: bool = False
    least_people: int = LEAST_PEOPLE


@dataclass(frozen=True)
class Exported:
    """The outcome of an export."""

    folder: Path
    format: Format
    participants: int
    sessions: int
    left_out: tuple[str, ...]
    redacted: tuple[str, ...]
    simulated: bool
    withheld: tuple[str, ...] = ()


def export(request: DataRequest, folder: Path, choices: Choices, watch: Watch = no_progress) -> Exported:
    """Write the study's data to `folder`, all of it or nothing.

    Raises ExportRefused on data that may not or cannot be shared, DataRefused if no session is left, ParticipantError
    if a lab's file about people is unusable, StreamError on recordings whose blocks do not fit together.
    """
    demand_place(folder, choices.replace)
    if choices.format == "parquet":
        demand_parquet()
    guard = Guard(identities(request.lab), choices.redact)
    with open_source(request, watch) as source:
        guard.demand_pseudonyms(source.participants)
        data = build_data_set(source, choices.without, choices.dates, choices.free_text, choices.least_people)
        description = describe(source, choices.dates)
        mark = {
            "format": choices.format,
            "study": source.study.study,
            "digest": source.digest,
            "palpate": palpate_version(),
        }
        with export_folder(folder, choices.replace, mark) as draft:
            match choices.format:
                case "bids":
                    write_bids(data, description, guard, draft, watch, choices.recordings)
                case "psych-ds":
                    write_psych_ds(data, description, guard, draft, watch)
                case "csv":
                    write_csv_files(data, description, guard, draft, watch)
                case "parquet":
                    write_parquet_files(data, description, guard, draft, watch)
        left_out = tuple(f"{session.session}: {why}" for session, why in source.left_out)
        return Exported(
            folder, choices.format, len(source.participants), len(source.sessions), left_out, tuple(guard.redacted),
            source.simulated, data.withheld,
        )  # fmt: skip
