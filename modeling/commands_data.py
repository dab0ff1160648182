"""Which data a model is trained on or judged by: a lab's sessions, a table, or simulated people."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.protocols.progress import Report
from palpate.studies.options import LAB, only_simulated, sessions_option

if TYPE_CHECKING:
    from palpate.modeling.doors.data import DoorData
    from palpate.modeling.doors.rated import Individual


@dataclass(frozen=True)
class Asked:
    """What was asked for on the command line."""

    lab: Path
    table: Path | None
    simulated: bool
    study: str
    sessions: str | None


def data_options(command: Callable[..., None]) -> Callable[..., None]:
    """The options that say which data are meant; the command receives them as one `Asked`."""

    @LAB
    @click.option(
        "--data", "table", type=click.Path(dir_okay=False, exists=True, path_type=Path),
        help="A table of profiles and mean ratings instead of the lab's sessions.",
    )  # fmt: skip
    @click.option(
        "--simulated", is_flag=True, help="40 simulated people rate the shipped stimuli, instead of the lab's."
    )
    @click.option("--study", default="door_ratings", show_default=True, help="The lab's study, or imported data set.")
    @sessions_option()
    @wraps(command)
    def with_data(
        *, lab: Path, table: Path | None, simulated: bool, study: str, sessions: str | None, **others: Any
    ) -> None:
        if table is not None and simulated:
            raise click.UsageError("--data and --simulated: one of the two is expected, or neither for the lab's own")
        command(Asked(lab, table, simulated, study, sessions), **others)

    return with_data


def read(asked: Asked) -> tuple[DoorData, Individual | None]:
    """The data and, where there are any, the single ratings. Raises ModelDataError or what reading a lab raises."""
    if asked.table is not None:
        from palpate.modeling.doors.reading_tables import read_table

        return read_table(asked.table), None
    if asked.simulated:
        from palpate.modeling.doors.reading import simulated_ratings

        rated = simulated_ratings()
    else:
        from palpate.modeling.doors.reading import rated_in_lab

        only = only_simulated(asked.sessions)
        rated = rated_in_lab(asked.lab, asked.study, only)
    return rated.data, rated.individual


@contextmanager
def progress_lines() -> Iterator[Report]:
    """On a terminal one line that changes; elsewhere a line for each step, beside the answer."""
    from rich.console import Console
    from rich.markup import escape

    console = Console(stderr=True)
    if console.is_terminal:
        with console.status("reading") as status:
            yield lambda line: status.update(escape(line))
    else:
        yield lambda line: print(line, file=sys.stderr)  # noqa: T201 - a log has no line that changes


@contextmanager
def going_on(what: str) -> Iterator[None]:
    """Ctrl-C ends the command with a word about how to go on, and exit code 130."""
    try:
        yield
    except KeyboardInterrupt:
        click.echo(f"Stopped. What is finished is kept: the same command goes on with {what}.", err=True)
        raise click.exceptions.Exit(130) from None
