"""Options for recordings of textures that lie in files, not in a lab's sessions: texture models and attributes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import click

FILES, HELD = ("tables", "hatt", "cluster_data"), ("rate_hz", "speed_mm_s", "force_n")
"""What the options are called."""
Held: TypeAlias = tuple[float | None, float | None, float | None]
"""A rate in Hz, a speed in mm/s, a force in N that tables do not say."""
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


def said(given: Mapping[str, Any], names: Sequence[str]) -> list[str]:
    """Which of these options were given, as they are written."""
    return [f"--{name.replace('_', '-')}" for name in names if given[name]]


def demand_one(given: Mapping[str, Any], names: Sequence[str]) -> None:
    """Raise UsageError where more than one source is given."""
    if len(found := said(given, names)) > 1:
        raise click.UsageError(f"{' and '.join(found)}: one of them is expected, or none for the lab's own")


def held_in(given: dict[str, Any], tables: Sequence[Path]) -> Held:
    """What tables lack, taken out of what was given. Raises UsageError where there is no table."""
    rate_hz, speed_mm_s, force_N = held = tuple(given.pop(name) for name in HELD)
    if any(each is not None for each in held) and not tables:
        raise click.UsageError("--rate-hz, --speed-mm-s and --force-n say what tables lack: --tables is expected")
    return rate_hz, speed_mm_s, force_N
