"""`palpate export`: a study's data in a form that others can read."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.analysis.commands import source_options
from palpate.protocols.wording import count
from palpate.studies.options import JSON, echo_json, progress

if TYPE_CHECKING:
    from palpate.analysis.ratings.sources import DataRequest

FORMATS = ("bids", "psych-ds", "csv", "parquet")


@click.command()
@source_options
@click.option("--to", "folder", type=click.Path(path_type=Path), required=True, help="The folder to write; a new one.")
@click.option("--bids", is_flag=True, help="As BIDS (1.11.1), recordings included.")
@click.option("--psych-ds", is_flag=True, help="As Psych-DS.")
@click.option("--csv", is_flag=True, help="As tidy CSV files with a codebook.")
@click.option("--parquet", is_flag=True, help='As Parquet files; needs pip install "palpate[export]".')
@click.option("--without", multiple=True, metavar="COLUMN", help="Leave out this column or question. Repeatable.")
@click.option("--redact", is_flag=True, help="Blacken texts that look as if they identify a person.")
@click.option("--free-text", is_flag=True, help="Also what people wrote in an interview: read it first.")
@click.option("--least-people", type=click.IntRange(1), default=3, show_default=True,
              help="Withhold answers about themselves that fewer participants share; 1 shows all.")  # fmt: skip
@click.option("--with-dates", is_flag=True, help="Also tell when sessions began.")
@click.option("--recordings/--no-recordings", default=True, help="Whether BIDS gets the recorded streams.")
@click.option("--replace", is_flag=True, help="Replace an earlier export in that folder.")
@JSON
def export(request: DataRequest, folder: Path, as_json: bool, without: tuple[str, ...], redact: bool, with_dates: bool,
           free_text: bool, least_people: int, recordings: bool, replace: bool, **formats: bool) -> None:  # fmt: skip
    """Write the data of the study NAME to a folder that can be shared.

    Participants appear by pseudonym; people who withdrew, declined or were not eligible do not appear. Columns
    and texts that look like names, addresses, numbers or dates of birth are refused, with file, column and
    row. All of it is written, or nothing. Equal data give equal bytes.

    \b
    Examples:
      palpate export door_ratings --lab LAB --to shared/doors --bids
      palpate export door_ratings --lab LAB --to shared/doors-csv --csv --without handedness
      palpate export door_ratings --database postgresql+psycopg://user@host/lab --lab LAB --to shared/doors --parquet
    """
    from palpate.analysis.exporting.export import Choices
    from palpate.analysis.exporting.export import export as write

    chosen: list[Any] = [name for name in FORMATS if formats[name.replace("-", "_")]]
    if len(chosen) != 1:
        named = " and ".join(f"--{name}" for name in chosen) or "none of them"
        raise click.UsageError(f"one of --{', --'.join(FORMATS)} is expected; found {named}")
    choices = Choices(chosen[0], without, with_dates, redact, recordings, replace, free_text, least_people)
    exported = write(request, folder, choices, _Watched(as_json))
    if as_json:
        echo_json({**vars(exported), "folder": str(exported.folder)})
    else:
        who = count(exported.participants, "simulated participant" if exported.simulated else "participant")
        click.echo(f"{exported.folder}: {exported.format}, {who}, {count(exported.sessions, 'session')}")
        for line in exported.left_out:
            click.echo(f"  left out: {line}")
        for line in exported.withheld:
            click.echo(f"  few people: {line} --least-people 1 shows all")
        for line in exported.redacted:
            click.echo(f"  blackened: {line}")


class _Watched:
    """A progress bar on a terminal."""

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet

    def __call__(self, items: Any, doing: str, total: int | None = None) -> Any:
        with closing(progress(items, doing, self._quiet, total)) as steps:
            yield from steps
