"""What command lines about a window share."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])
_SIZE = re.compile(r"([1-9][0-9]{2,4})x([1-9][0-9]{2,4})")


def size_px(_ctx: click.Context, _parameter: click.Parameter, value: str | None) -> tuple[int, int] | None:
    """The callback of an option that takes a size, as 1280x720."""
    if value is None:
        return None
    found = _SIZE.fullmatch(value)
    if found is None:
        raise click.BadParameter(f"{value!r}: a size in pixels is expected, as 1280x720")
    return int(found[1]), int(found[2])


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
