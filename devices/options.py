"""Options that the command lines of devices share; studies has its own, which analysis may reach."""

from __future__ import annotations

from pathlib import Path

import click

LAB = click.option(
    "--lab", type=click.Path(file_okay=False, path_type=Path), default=Path(), show_default="the current folder",
    help="The lab's folder.",
)  # fmt: skip
JSON = click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON.")
