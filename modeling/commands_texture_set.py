"""`palpate textures simulate`: fill a lab with simulated textures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.modeling.commands_data import exit_on_interrupt, progress_lines
from palpate.modeling.options import SEED
from palpate.protocols.shell_command import shell_command
from palpate.studies.options import JSON, LAB, echo_json, names_in

if TYPE_CHECKING:
    from palpate.modeling.textures.simulator import GetSimulator, SetSession


@click.command()
@LAB
@click.option("--textures", metavar="IDS", multiple=True, help="Only these: T01,T02.  [default: all 50]")
@click.option("--seconds", type=float, help="How long each is stroked: 6 or more.  [default: 60]")
@click.option("--pictures", type=click.IntRange(1, 10), help="Of each texture, one under each light.  [default: 10]")
@click.option("--raters", type=click.IntRange(1, 999), help="Simulated people who rate all textures.  [default: 20]")
@SEED
@click.option("--workers", type=click.IntRange(1, 64), default=1, show_default=True, help="Processes that compute.")
@click.option("--quick", is_flag=True, help="10 textures x 8 s, 2 pictures, 6 raters: to try everything out.")
@JSON
@click.pass_obj
def simulate(
    get_simulator: GetSimulator, /, lab: Path, textures: tuple[str, ...], as_json: bool, **options: Any
) -> None:
    """Fill a lab with simulated textures: touched, photographed and rated, in real ledgers.

    Runs texture_capture (50 textures x 60 s), texture_photos (10 pictures of each) and texture_ratings (20 people)
    through the twins of the rig's devices; LAB becomes a lab where it is none. Fewer textures or other seconds are
    studies of the lab's own, in LAB/studies. No measurement of a material or of a person. Nothing is written
    over: what is complete is kept, and stopped (Ctrl-C), the same command goes on.

    \b
    Examples:
      palpate textures simulate --lab LAB
      palpate textures simulate --lab LAB --quick
      palpate textures simulate --lab LAB --textures T01,T15,T33 --seconds 20 --workers 2
    """
    named = names_in(textures)
    if textures and not named:
        raise click.UsageError("--textures names none: T01,T15,T33 for instance, or leave it out for all")
    with exit_on_interrupt("what is left"), progress_lines() as report:
        sessions = get_simulator().make_set(lab, report, textures=named, **options)
    if as_json:
        names = ("study", "participant", "done", "complete", "events", "ended")
        echo_json(
            [
                {"ledger": str(session.ledger), **{name: getattr(session, name) for name in names}}
                for session in sessions
            ]
        )
    else:
        _show(sessions, lab)
    if not all(session.complete for session in sessions):
        raise click.exceptions.Exit(130 if "SIGINT" in sessions[-1].ended else 1)


def _show(sessions: Sequence[SetSession], lab: Path) -> None:
    """Print the sessions by study, and the commands that can follow."""
    for study in dict.fromkeys(session.study for session in sessions):
        whole = [session for session in sessions if session.study == study and session.complete]
        done = ", ".join(f"{sum(e.done == how for e in whole)} {how}" for how in dict.fromkeys(e.done for e in whole))
        if whole:
            click.echo(f"{study}: {len(whole)} session{'s' if len(whole) > 1 else ''} complete ({done})")
    if sessions and not sessions[-1].complete:
        click.echo(
            f"{sessions[-1].study}: {sessions[-1].ended}. Finished parts are saved: "
            "run the same command again to continue.",
            err=True,
        )
        return
    if {session.done for session in sessions} == {"kept"}:
        click.echo("Everything exists already: nothing was changed.")
    click.echo("Simulated: no measurement of a material or of a person.")
    click.echo(
        f"Then: {shell_command('textures', 'index', '--lab', lab)}, or "
        f"{shell_command('evaluate', 'attributes', '--lab', lab)}"
    )
