"""Options that the command lines of devices share; `studies` has its own, which `analysis` may import."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from palpate.protocols.lab_option import JSON, LAB

__all__ = ["JSON", "LAB"]
RIG = click.option(
    "--rig", "rig_file", type=click.Path(dir_okay=False, path_type=Path), show_default="LAB/stations/HOST/rig.yaml",
    help="The rig file.",
)  # fmt: skip
Command = TypeVar("Command", bound=Callable[..., Any])
_SIZE = re.compile(r"([1-9][0-9]{2,4})x([1-9][0-9]{2,4})")


def size_px(_ctx: click.Context, _parameter: click.Parameter, value: str | None) -> tuple[int, int] | None:
    """Parse an option's size, such as 1280x720, as its click callback."""
    if value is None:
        return None
    match = _SIZE.fullmatch(value)
    if match is None:
        raise click.BadParameter(f"{value!r}: a size in pixels is expected, as 1280x720")
    return int(match[1]), int(match[2])


def window_options(command: Command) -> Command:
    """Add --language, --screen and --windowed."""
    options = (
        click.option("--language", default="en", show_default=True, help="The language of the window."),
        click.option("--screen", type=click.IntRange(0, 15), help="The screen, from 0.  [default: as calibrated]"),
        click.option("--windowed", callback=size_px, metavar="WxH", help="A window of this size, not the full screen."),
    )
    for option in reversed(options):
        command = option(command)
    return command
