"""Options of the data to train or evaluate with: a lab's sessions, a table, recordings, simulated people."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.protocols.progress import Report
from palpate.studies.options import LAB, only_simulated, sessions_option, with_options

if TYPE_CHECKING:
    from palpate.modeling.attributes.reading_recordings import Recordings
    from palpate.modeling.doors.data import DoorData
    from palpate.modeling.doors.rated import Individual
    from palpate.modeling.textures.reading_tables import Held

FILES, HELD = ("tables", "hatt", "cluster_data"), ("rate_hz", "speed_mm_s", "force_n")
"""The parameter names of the options."""
FILE_OPTIONS = (
    click.option(
        "--tables", type=click.Path(exists=True, path_type=Path), multiple=True,
        help="Tables with time, acceleration, speed, force instead of the lab's captures: a folder, or files.",
    ),
    click.option(
        "--hatt", type=click.Path(exists=True, path_type=Path), metavar="PATH",
        help="Recordings of the Penn Haptic Texture Toolkit instead: a file, or a folder.",
    ),
    click.option(
        "--cluster-data", type=click.Path(exists=True, file_okay=False, path_type=Path), metavar="FOLDER",
        help="The Cluster Haptic Texture Dataset instead; its textures are called cluster_0 and so on.",
    ),
)  # fmt: skip
HELD_OPTIONS = (
    click.option("--rate-hz", type=click.FloatRange(1), help="Of tables without a column of times."),
    click.option("--speed-mm-s", type=click.FloatRange(0), help="Held still, for tables without a speed."),
    click.option("--force-n", type=click.FloatRange(0), help="Held still, for tables without a force."),
)
RECORDING_OPTIONS = (
    *FILE_OPTIONS,
    *HELD_OPTIONS,
    click.option(
        "--trim-s", type=click.FloatRange(0),
        help="Left out at both ends of such a recording.  [default: 2.5; 0 of the Cluster data set]",
    ),
)  # fmt: skip
"""The options of recordings for the textures of a folder's table of ratings."""


@dataclass(frozen=True)
class DataOptions:
    """The data that the command line selects."""

    lab: Path
    table: Path | None
    simulated: bool
    study: str
    sessions: str | None


def data_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with the options of its data, which it receives as one `DataOptions`."""

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
        command(DataOptions(lab, table, simulated, study, sessions), **others)

    return with_data


def read(options: DataOptions) -> tuple[DoorData, Individual | None]:
    """Return the data and, if available, the individual ratings. Raises ModelDataError or errors of reading a lab."""
    if options.table is not None:
        from palpate.modeling.doors.reading_tables import read_table

        return read_table(options.table), None
    if options.simulated:
        from palpate.modeling.doors.reading import simulated_ratings

        rated = simulated_ratings()
    else:
        from palpate.modeling.doors.reading import rated_in_lab

        only = only_simulated(options.sessions)
        rated = rated_in_lab(options.lab, options.study, only)
    return rated.data, rated.individual


@contextmanager
def progress_lines() -> Iterator[Report]:
    """Yield a progress report to stderr: on a terminal one line that changes, elsewhere a line for each step."""
    from rich.console import Console
    from rich.markup import escape

    console = Console(stderr=True)
    if console.is_terminal:
        with console.status("reading") as status:
            yield lambda line: status.update(escape(line))
    else:
        yield lambda line: print(line, file=sys.stderr)  # noqa: T201 - a log has no line that changes


@contextmanager
def exit_on_interrupt(what: str) -> Iterator[None]:
    """End the command at Ctrl-C with a message on how to continue, and exit code 130."""
    try:
        yield
    except KeyboardInterrupt:
        click.echo(
            f"Stopped. Finished results are saved: run the same command again to continue with {what}.", err=True
        )
        raise click.exceptions.Exit(130) from None


def recording_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with `RECORDING_OPTIONS`."""
    return with_options(command, RECORDING_OPTIONS)


def option_names(options: Mapping[str, Any], names: Sequence[str]) -> list[str]:
    """Return the names of the options that have a value, as on the command line."""
    return [f"--{name.replace('_', '-')}" for name in names if options[name]]


def demand_one(options: Mapping[str, Any], names: Sequence[str]) -> None:
    """Raise UsageError where more than one of the options has a value."""
    if len(lines := option_names(options, names)) > 1:
        raise click.UsageError(f"{' and '.join(lines)}: one of them is expected, or none for the lab's own")


def held_in(options: dict[str, Any], tables: Sequence[Path]) -> Held | None:
    """Remove the constants for columns that tables lack from the options, and return them; None without tables.

    Raises UsageError for constants without tables.
    """
    rate_hz, speed_mm_s, force_N = held = tuple(options.pop(name) for name in HELD)
    if any(value is not None for value in held) and not tables:
        raise click.UsageError(
            "--rate-hz, --speed-mm-s and --force-n give what is missing in tables: --tables is expected"
        )
    if not tables:
        return None
    from palpate.modeling.textures.reading_tables import Held

    return Held(rate_hz, speed_mm_s, force_N)


def demand_folder_alone(options: Mapping[str, Any]) -> None:
    """Raise UsageError for options of a folder's table without a folder, and for a folder together with sessions."""
    for name in ("ratings", "scale"):
        if options[name] is not None and options["folder"] is None:
            raise click.UsageError(f"--{name} goes with --folder: a folder of images is expected")
    if options["sessions"] is not None and options["folder"] is not None:
        raise click.UsageError("--sessions chooses among the lab's, and --folder takes none of them: leave one out")


def requested_recordings(options: dict[str, Any]) -> Recordings | None:
    """Remove the options of recordings and return the recordings; None where none are requested. Raises UsageError."""
    demand_one(options, FILES)
    files = option_names(options, FILES)
    if files and options["folder"] is None:
        text = "a folder with a table of ratings, and perhaps images, is expected"
        raise click.UsageError(f"{files[0]} goes with --folder: {text}")
    if options["trim_s"] is not None and not files:
        raise click.UsageError("--trim-s goes with --tables, --hatt or --cluster-data")
    tables, hatt, cluster_data, trim_s = (options.pop(name) for name in (*FILES, "trim_s"))
    held = held_in(options, tables)
    if not files:
        return None
    from palpate.modeling.attributes.reading_recordings import Recordings

    return Recordings(tables, hatt, cluster_data, held, trim_s)
