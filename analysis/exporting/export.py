"""From what is asked for to a folder that holds it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from palpate.analysis.exporting.bids import write_bids
from palpate.analysis.exporting.csv_and_parquet import demand_parquet, write_parquet, write_plain
from palpate.analysis.exporting.description import about, palpate_version
from palpate.analysis.exporting.folder import demand_place, made
from palpate.analysis.exporting.guard import Guard
from palpate.analysis.exporting.psych_ds import write_psych_ds
from palpate.analysis.exporting.source import Source, Watch, opened, unwatched
from palpate.analysis.exporting.tables import Shared, shared
from palpate.analysis.ratings.sources import Wanted
from palpate.studies.participants.identities import identities

LEAST_PEOPLE = 3
"""So many share an answer about themselves that leaves a lab, as in an analysis plan."""
Format = Literal["bids", "psych-ds", "csv", "parquet"]


@dataclass(frozen=True)
class Choices:
    """How a data set is to be shared.

    `without` names columns and questions to leave out, `dates` keeps when sessions began, `free_text` what was written
    in an interview; `least_people` is how many must share an answer about themselves for it to be shown; `redact`
    blackens texts that look as if they said who somebody is, `recordings` says whether BIDS gets the streams.
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
    """What was written."""

    folder: Path
    format: Format
    participants: int
    sessions: int
    left_out: tuple[str, ...]
    redacted: tuple[str, ...]
    simulated: bool
    withheld: tuple[str, ...] = ()


def _shared(source: Source, choices: Choices) -> Shared:
    return shared(source, choices.without, choices.dates, choices.free_text, choices.least_people)


def export(wanted: Wanted, folder: Path, choices: Choices, watch: Watch = unwatched) -> Exported:
    """Write the study's data to `folder`, all of it or nothing.

    Raises ExportRefused on what may not or cannot be shared, DataRefused where no session is left, ParticipantError on
    a lab's files about people that cannot be used, StreamError on recordings whose blocks do not fit together.
    """
    demand_place(folder, choices.replace)
    if choices.format == "parquet":
        demand_parquet()
    guard = Guard(identities(wanted.lab), choices.redact)
    with opened(wanted, watch) as source:
        guard.demand_pseudonyms(source.participants)
        data, of = _shared(source, choices), about(source, choices.dates)
        mark = {
            "format": choices.format,
            "study": source.study.study,
            "digest": source.digest,
            "palpate": palpate_version(),
        }
        with made(folder, choices.replace, mark) as draft:
            match choices.format:
                case "bids":
                    write_bids(data, of, guard, draft, watch, choices.recordings)
                case "psych-ds":
                    write_psych_ds(data, of, guard, draft, watch)
                case "csv":
                    write_plain(data, of, guard, draft, watch)
                case "parquet":
                    write_parquet(data, of, guard, draft, watch)
        left_out = tuple(f"{each.session}: {why}" for each, why in source.left_out)
        return Exported(
            folder, choices.format, len(source.participants), len(source.kept), left_out, tuple(guard.redacted),
            source.simulated, data.withheld,
        )  # fmt: skip
