"""`palpate author`: the designer's window."""

from __future__ import annotations

from pathlib import Path

import click

from palpate.devices.options import LAB
from palpate.devices.rig.options import RIG
from palpate.devices.window.options import size_px


@click.command()
@LAB
@click.option("--model", metavar="NAME|CARD", help="The model that makes doors: one of the lab's or of those shipped, "
              "or a card.  [default: door-force]")  # fmt: skip
@RIG
@click.option("--twins", is_flag=True, help="A simulated door in place of the rig's.")
@click.option("--language", default="en", show_default=True, help="The language of the window.")
@click.option("--screen", type=click.IntRange(0, 15), help="The screen, from 0.  [default: as calibrated]")
@click.option("--windowed", callback=size_px, metavar="WxH", help="A window of this size, not the full screen.")
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
    from palpate.devices.author.making import maker_for
    from palpate.devices.author.open import Options, run_window

    run_window(maker_for(lab, model), Options(lab, twins, rig_file, language, screen, windowed))
