"""The option that names a rig file."""

from __future__ import annotations

from pathlib import Path

import click

RIG = click.option(
    "--rig", "rig_file", type=click.Path(dir_okay=False, path_type=Path), show_default="LAB/stations/HOST/rig.yaml",
    help="The rig file.",
)  # fmt: skip
