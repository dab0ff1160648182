"""The verbs `palpate train` and `palpate evaluate`: each has a command for doors, textures and attributes."""

from __future__ import annotations

import click

from palpate.modeling.commands_attributes import evaluate_attributes, train_attributes
from palpate.modeling.commands_doors import evaluate_doors, train_doors
from palpate.modeling.commands_textures import evaluate_textures, train_textures


@click.group(
    commands=[train_doors, train_textures, train_attributes], options_metavar="", subcommand_metavar="WHAT [OPTIONS]"
)
def train() -> None:
    """Train the models that predict a feeling and make a profile."""


@click.group(
    commands=[evaluate_doors, evaluate_textures, evaluate_attributes],
    options_metavar="",
    subcommand_metavar="WHAT [OPTIONS]",
)
def evaluate() -> None:
    """Compare every method side by side: error and time."""
