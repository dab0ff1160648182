"""`palpate window`: calibrate the participant's screen, check it, and paint all screens to files."""

from __future__ import annotations

from pathlib import Path

import click

from palpate.devices.options import JSON, LAB, size_px

LANGUAGE = click.option("--language", default="en", show_default=True, help="The language of the screens.")


@click.group()
def window() -> None:
    """The participant's window: calibrate the screen, check it, see every screen.

    \b
    Example:
      palpate window calibrate --lab LAB --width-mm 531
      palpate window check --lab LAB
      palpate window screens --out pictures --size 1280x720 --language ko
    """


@window.command()
@LAB
@LANGUAGE
@click.option("--screen", type=click.IntRange(0, 15), default=0, show_default=True, help="Which screen, from 0.")
@click.option("--width-mm", type=click.FloatRange(50, 5000), help="Width of the screen's lit area, as a first guess.")
@click.option("--measured", type=click.FloatRange(1, 5000), metavar="MM",
              help="What the ruler read on the first line, seen before: nothing is shown or asked.")  # fmt: skip
@click.option("--windowed", callback=size_px, metavar="WxH", help="A window of this size in place of the full screen.")
def calibrate(
    lab: Path, language: str, screen: int, width_mm: float | None, measured: float | None,
    windowed: tuple[int, int] | None,
) -> None:  # fmt: skip
    """Measure this station's screen with a ruler, so that lengths on it are what they should be.

    A line is shown that would be 127 mm long by the first guess. Measure it, type what the ruler reads; a corrected
    line is shown until it reads 127 mm. The result lies in LAB/stations/HOST/window.yaml, one for each computer.

    \b
    Example:
      palpate window calibrate --lab LAB --width-mm 531
    """
    from palpate.devices.window.calibration import write_calibration
    from palpate.devices.window.commands_calibrate import calibrated, describe_calibration

    calibration = calibrated(screen, language, width_mm, measured, windowed)
    saved = write_calibration(lab, calibration)
    click.echo(f"{describe_calibration(calibration)}\nsaved {saved}; every session begins with the ruler once more")


@window.command()
@LAB
@JSON
def check(lab: Path, as_json: bool) -> None:
    """Say whether the calibration fits the screen as it is now, and which fonts and languages there are.

    Exit code 1 if a window cannot be opened here as calibrated.

    \b
    Example:
      palpate window check --lab LAB
    """
    from palpate.devices.window.commands_check import describe_findings, findings

    state = findings(lab)
    if as_json:
        from palpate.protocols.canonical import canonical

        click.echo(canonical(state).decode())
    else:
        click.echo(describe_findings(state))
    if state["problems"]:
        raise click.exceptions.Exit(1)


@window.command()
@LANGUAGE
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), required=True, help="Folder for the pictures.")
@click.option("--size", callback=size_px, default="1280x720", show_default=True, metavar="WxH", help="Size in pixels.")
def screens(language: str, out: Path, size: tuple[int, int]) -> None:
    """Paint every kind of screen to a PNG file, as a participant would see it; no window is opened.

    \b
    Example:
      palpate window screens --out pictures --size 1920x1080 --language ko
    """
    from palpate.devices.window.pictures import pictures

    for path in pictures(out, size, language):
        click.echo(str(path))
