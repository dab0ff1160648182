"""Options that the commands of several kinds of models share, for training, evaluation and the place of the results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

SEED = click.option("--seed", type=click.IntRange(0, 10**6), default=0, show_default=True, help="For everything drawn.")
EPOCHS = click.option("--epochs", type=click.IntRange(1), help="At most this many.  [default: each method's own]")
WORKERS = click.option(
    "--workers", type=click.IntRange(1, 256), help="Processes at once.  [default: one for each core]"
)
TO_MODELS = click.option(
    "--to", type=click.Path(file_okay=False, path_type=Path), help="Where to.  [default: LAB/models]"
)


def cluster_option(does: str = "does the work") -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return the option --cluster; `does` says in its help what a cluster does."""
    return click.option("--cluster", metavar="ADDRESS", help=f"A Dask scheduler (tcp://HOST:8786) that {does}.")


def to_evaluated(field: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return the option --to of the evaluation of a field: doors, textures or attributes."""
    return click.option(
        "--to", type=click.Path(file_okay=False, path_type=Path), help=f"Where to.  [default: LAB/evaluated/{field}]"
    )
