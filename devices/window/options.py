"""What command lines about a window share."""

from __future__ import annotations

import re

import click

_SIZE = re.compile(r"([1-9][0-9]{2,4})x([1-9][0-9]{2,4})")


def size_px(_ctx: click.Context, _parameter: click.Parameter, value: str | None) -> tuple[int, int] | None:
    """The callback of an option that takes a size, as 1280x720."""
    if value is None:
        return None
    found = _SIZE.fullmatch(value)
    if found is None:
        raise click.BadParameter(f"{value!r}: a size in pixels is expected, as 1280x720")
    return int(found[1]), int(found[2])
