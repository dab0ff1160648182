"""`palpate author`: the designer's window."""

from __future__ import annotations

from pathlib import Path

import click

from palpate.devices.options import LAB, RIG, window_options


@click.command()
@LAB
@click.option("--model", metavar="NAME|CARD", help="The model that makes doors: one of the lab's or of those shipped, "
              "or a card.  [default: door-force]")  # fmt: skip
@RIG
@click.option("--twins", is_flag=True, help="A simulated door in place of the rig's.")
@window_options
def author(
    lab: Path, model: str | None, rig_file: Path | None, twins: bool, language: str, screen: int | None,
    windowed: tuple[int, int] | None,
) -> None:  # fmt: skip
    """Make a door that feels as wished: seven sliders, its force at once, played on the door.

    Designs lie in LAB/designs, and work that is not saved is kept there at every change.

    \b
    Example:
      palpate author --lab LAB --twins
      palpate author --lab LAB --rig LAB/stations/DOORLAB/rig.yaml
    """
    if twins and rig_file is not None:
        raise click.UsageError("--rig names a door to open, and with --twins none is: leave one out")
    from palpate.devices.author.app import run_window
    from palpate.devices.door.making import maker_for
    from palpate.devices.window.app import WindowOptions

    options = WindowOptions(lab=lab, rig=rig_file, twins=twins, language=language, screen=screen, windowed=windowed)
    run_window(maker_for(lab, model), options)
