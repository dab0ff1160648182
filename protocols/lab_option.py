"""The options that commands of every room share: the lab, whose extensions are then looked up by name, and JSON."""

from __future__ import annotations

from pathlib import Path

import click

from palpate.protocols.extensions import Lazily, used


def look_in(lab: Path) -> Path:
    """Let names of extensions be looked up in this lab until the command ends; return the lab."""
    finder = Lazily("palpate.studies.extensions.finder:LabExtensions", lab)
    click.get_current_context().with_resource(used(finder))
    return lab


LAB = click.option(
    "--lab", type=click.Path(file_okay=False, path_type=Path), default=Path(), show_default="the current folder",
    help="The lab's folder.", callback=lambda _context, _option, lab: look_in(lab),
)  # fmt: skip
JSON = click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON.")
