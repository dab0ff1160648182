"""Options for recordings of textures that lie in files, not in a lab's sessions: texture models and attributes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.studies.options import with_options

if TYPE_CHECKING:
    from palpate.modeling.attributes.reading_recordings import Recordings
    from palpate.modeling.textures.reading_tables import Held

FILES, HELD = ("tables", "hatt", "cluster_data"), ("rate_hz", "speed_mm_s", "force_n")
"""What the options are called."""
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
BESIDE_A_TABLE = (
    *FILE_OPTIONS,
    *HELD_OPTIONS,
    click.option(
        "--trim-s", type=click.FloatRange(0),
        help="Left out at both ends of such a recording.  [default: 2.5; 0 of the Cluster data set]",
    ),
)  # fmt: skip
"""Where recordings go with a folder's table of ratings."""


def beside_options(command: Callable[..., None]) -> Callable[..., None]:
    """All of `BESIDE_A_TABLE` on a command."""
    return with_options(command, BESIDE_A_TABLE)


def said(given: Mapping[str, Any], names: Sequence[str]) -> list[str]:
    """Which of these options were given, as they are written."""
    return [f"--{name.replace('_', '-')}" for name in names if given[name]]


def demand_one(given: Mapping[str, Any], names: Sequence[str]) -> None:
    """Raise UsageError where more than one source is given."""
    if len(found := said(given, names)) > 1:
        raise click.UsageError(f"{' and '.join(found)}: one of them is expected, or none for the lab's own")


def held_in(given: dict[str, Any], tables: Sequence[Path]) -> Held | None:
    """What tables do not say, taken out of what was given. Raises UsageError where there is no table."""
    rate_hz, speed_mm_s, force_N = held = tuple(given.pop(name) for name in HELD)
    if any(each is not None for each in held) and not tables:
        raise click.UsageError("--rate-hz, --speed-mm-s and --force-n say what tables lack: --tables is expected")
    if not tables:
        return None
    from palpate.modeling.textures.reading_tables import Held

    return Held(rate_hz, speed_mm_s, force_N)


def demand_folder_alone(given: Mapping[str, Any]) -> None:
    """Raise UsageError for options of a folder's table without a folder, and for a folder beside the lab's sessions."""
    for name in ("ratings", "scale"):
        if given[name] is not None and given["folder"] is None:
            raise click.UsageError(f"--{name} goes with --folder: a folder of images is expected")
    if given["sessions"] is not None and given["folder"] is not None:
        raise click.UsageError("--sessions chooses among the lab's, and --folder takes none of them: leave one out")


def beside_a_table(given: dict[str, Any]) -> Recordings | None:
    """The recordings that go with `folder`, all their options taken out of what was given. Raises UsageError."""
    demand_one(given, FILES)
    files = said(given, FILES)
    if files and given["folder"] is None:
        told = "a folder with a table of ratings, and perhaps images, is expected"
        raise click.UsageError(f"{files[0]} goes with --folder: {told}")
    if given["trim_s"] is not None and not files:
        raise click.UsageError("--trim-s goes with --tables, --hatt or --cluster-data")
    tables, hatt, cluster_data, trim_s = (given.pop(name) for name in (*FILES, "trim_s"))
    held = held_in(given, tables)
    if not files:
        return None
    from palpate.modeling.attributes.reading_recordings import Recordings

    return Recordings(tables, hatt, cluster_data, held, trim_s)
