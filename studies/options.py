"""What the verbs of several rooms share: the lab, and an answer as JSON. Imports nothing heavy and no device."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

LAB = click.option(
    "--lab", type=click.Path(file_okay=False, path_type=Path), default=Path(), show_default="the current folder",
    help="The lab's folder.",
)  # fmt: skip
JSON = click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON.")


def echo_json(value: Any) -> None:
    """Print JSON for a script: one line, keys sorted."""
    from protocols.canonical import canonical

    click.echo(canonical(value).decode())
