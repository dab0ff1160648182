"""`palpate render`: feel a texture, or play it without a window."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from palpate.devices.options import JSON, LAB, RIG, window_options
from palpate.devices.render.texture_models import DEFAULT_METHOD

if TYPE_CHECKING:
    from palpate.devices.render.headless import Played
    from palpate.signals.textures.sounds import Sounds


@click.command()
@click.argument("texture")
@click.option("--method", default=DEFAULT_METHOD, show_default=True, help="The method of the texture's model.")
@click.option("--hand", metavar="FILE.csv|simulated", help="Play without a window for this hand: columns t_s, "
              "speed_mm_s, force_N or t_s, x_mm, y_mm, pressure; or a simulated one.")  # fmt: skip
@click.option("--seconds", type=click.FloatRange(0.1, 3600), help="With --hand: how much is played.  [default: all "
              "of a file, 10 s of a simulated hand]")  # fmt: skip
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), help="With --hand: write what was played, as "
              ".csv or .npz.")  # fmt: skip
@click.option("--paced", is_flag=True, help="With --hand: at 1 kHz into the actuator of --rig or a "
              "twin, not as fast as it goes.")  # fmt: skip
@click.option("--real-time", is_flag=True, help="Ask the system for real-time priority.")
@click.option("--ahead", type=click.IntRange(1, 10), default=10, show_default=True, help="Output buffer in ms.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="What random numbers come from.")
@click.option("--mean", is_flag=True, help="Take the mean of a model with a conditional scale, do not sample it.")
@click.option("--accept-missed", is_flag=True, help="Play a model, too, that missed an aim of its training.")
@RIG
@click.option("--twins", is_flag=True, help="A simulated stylus and actuator in place of the rig's.")
@window_options
@LAB
@JSON
def render(
    texture: str, method: str, hand: str | None, seconds: float | None, out: Path | None, paced: bool,
    real_time: bool, ahead: int, seed: int, mean: bool, accept_missed: bool,
    rig_file: Path | None, twins: bool, language: str,
    screen: int | None, windowed: tuple[int, int] | None, lab: Path, as_json: bool,
) -> None:  # fmt: skip
    """Feel TEXTURE: a window with its picture, a stylus or mouse, the model's vibration at 1 kHz.

    With --hand there is no window: a recorded or simulated hand is played, and the deadline statistics are printed.

    \b
    Example:
      palpate render cloth
      palpate render cloth --method ar --hand simulated --seconds 60 --paced
      palpate render steel_mesh --hand strokes.csv --out felt.csv
    """
    _require_together(hand is not None, paced)
    if twins and rig_file is not None:
        raise click.UsageError("--rig names devices to open, and with --twins none are: leave one out")
    from palpate.devices.render.texture_models import card_for

    card = card_for(texture, method, lab)
    if hand is None:
        from palpate.devices.render.window.app import RenderOptions, run_window

        run_window(RenderOptions(
            lab=lab, texture=texture, method=method, seed=seed, sampled=not mean, accept_missed=accept_missed,
            ahead=ahead, real_time=real_time, rig=rig_file, twins=twins, language=language, screen=screen,
            windowed=windowed,
        ))  # fmt: skip
        return
    from palpate.signals.textures.sounds import Sounds

    played = _played(
        Sounds(card, seed, not mean, accept_missed), hand, seconds, out, paced, (rig_file, ahead, real_time)
    )
    _tell(played, texture, method, out, as_json)


def _played(
    sounds: Sounds, hand: str, seconds: float | None, out: Path | None, paced: bool, how: tuple[Path | None, int, bool]
) -> Played:
    from palpate.devices.render import headless

    if out is not None:
        headless.require_out(out)
    script = headless.hand_of(hand, seconds, sounds.seed)
    if paced:
        played = headless.paced(headless.job_for(sounds, script, *how), script)
    else:
        played = headless.at_once(sounds, script)
    if out is not None:
        headless.write(out, played)
    return played


def _require_together(by_hand: bool, paced: bool) -> None:
    """Raise click.UsageError if an option has no effect together with the others."""
    if not by_hand and (odd := _given("seconds", "out", "paced", "as_json")):
        raise click.UsageError(f"{odd} goes with --hand: without a hand there is a window")
    if by_hand and (odd := _given("language", "screen", "windowed")):
        raise click.UsageError(f"{odd} is for the window, and with --hand there is none: leave one out")
    if by_hand and not paced and (odd := _given("rig_file", "ahead", "real_time")):
        raise click.UsageError(f"{odd} is for what is played at 1 kHz: give --paced too")


def _given(*names: str) -> str:
    """Return the first of these options that was given, as it is written; "" for none."""
    context = click.get_current_context()
    by_user = (name for name in names if context.get_parameter_source(name) is ParameterSource.COMMANDLINE)
    written = {param.name: param.opts[0] for param in context.command.params}
    return next((written[option] for option in by_user), "")


def _tell(played: Played, texture: str, method: str, out: Path | None, as_json: bool) -> None:
    from palpate.devices.render.headless import in_words, level_m_s2
    from palpate.protocols.canonical import canonical

    level, seconds = level_m_s2(played.signals), played.signals.shape[1] / 1000
    if as_json:
        answer = {"texture": texture, "method": method, "seconds": seconds, "level_m_s2": level, **played.record}
        click.echo(canonical(answer).decode())
        return
    click.echo("\n".join(in_words(played.record, seconds, level)))
    if out is not None:
        click.echo(f"wrote {out}")
