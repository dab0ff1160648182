"""The front door: one command line, a thin table of verbs, each importing its room only when called."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from palpate.protocols.command_group import NearestGroup
from palpate.protocols.extras import installed_version
from palpate.protocols.registry import load_object

INTERRUPTED = 130
"""The exit code after Ctrl-C, as shells give it: 128 and the number of the signal."""
VERBS = {
    "init": ("palpate.studies.participants.commands:init", "Make a folder a lab."),
    "participants": (
        "palpate.studies.participants.commands:participants",
        "Add, list, withdraw people; who holds which row.",
    ),
    "studies": ("palpate.studies.commands:studies", "List the studies that can be run here."),
    "check": ("palpate.studies.commands:check", "Check a study file and everything it names."),
    "plan": ("palpate.studies.commands:plan", "Show a participant's trials, and how balanced the orders are."),
    "run": ("palpate.studies.commands_sessions:run", "Run a session of a study."),
    "record": ("palpate.studies.commands_sessions:record", "Record stimuli with the station's sensors."),
    "resume": ("palpate.studies.commands_sessions:resume", "Go on with an interrupted session where it stopped."),
    "replay": ("palpate.studies.commands_recorded:replay", "Prove that recorded sessions repeat, event by event."),
    "collect": ("palpate.studies.commands_recorded:collect", "Gather a lab's sessions into one database."),
    "extensions": (
        "palpate.studies.extensions.commands:extensions",
        "Your own tasks, devices, statistics: list, new, check.",
    ),
    "rig": ("palpate.devices.rig.commands:rig", "Check a lab's devices; write a rig of simulated ones."),
    "window": ("palpate.devices.window.commands:window", "Calibrate and check the participant's window."),
    "monitor": ("palpate.analysis.monitoring.commands:monitor", "Watch a lab's sessions on a small local page."),
    "streams": (
        "palpate.analysis.streams.commands:streams",
        "What a session recorded: streams, gaps, drift; aligned export.",
    ),
    "doors": ("palpate.devices.door.commands:doors", "Make car-door stimuli: normalise, simulate, augment."),
    "author": ("palpate.devices.author.commands:author", "Make a door that feels as wished, with seven sliders."),
    "render": (
        "palpate.devices.render.commands:render",
        "Feel a texture; or play it for a recorded or simulated hand.",
    ),
    "samples": ("palpate.analysis.commands:samples", "Write sample files to try commands on."),
    "import": ("palpate.analysis.commands:import_", "Read a foreign table of ratings into a lab."),
    "regenerate": (
        "palpate.analysis.regenerating.commands:regenerate",
        "Every number, table and figure that a plan asks for.",
    ),
    "export": ("palpate.analysis.exporting.commands:export", "Share a study's data: BIDS, Psych-DS, CSV or Parquet."),
    "power": ("palpate.analysis.power.commands:power", "How many participants an effect needs, by simulated sessions."),
    "train": ("palpate.modeling.commands:train", "Train the models that predict a feeling and make a profile."),
    "evaluate": ("palpate.modeling.commands:evaluate", "Compare every method side by side: error and time."),
    "textures": ("palpate.modeling.commands_library:textures", "A library of textures, searched by how they feel."),
    "predict": ("palpate.devices.models.commands:predict", "How a profile would feel; a profile for a wished feeling."),
    "models": ("palpate.devices.models.commands:models", "List trained models, show their cards, compare them."),
    "analyse": ("palpate.analysis.commands:analyse", "Compute a study's tables and statistics."),
    "report": ("palpate.analysis.commands:report", "Write a study's report as one HTML file."),
    "demo": ("palpate.command_line:demo", "See the whole loop: 40 participants, from study file to report."),
    "bench": ("benchmarks.command:bench", "Measure errors and times side by side."),
}

DEMO = (
    "run door_ratings --participant P001..P040 --simulate --seed 1",
    "replay",
    "collect",
    "regenerate door_ratings",
    "import sk2011",
    "analyse sk2011 --reference r",
)
DEMO_MARK = ".palpate-demo"


class Verbs(NearestGroup):
    """A group that knows its verbs without importing them."""

    called = "verb"

    def list_commands(self, _ctx: click.Context) -> list[str]:
        """Return the verbs in the order of a study's life."""
        return list(VERBS)

    def get_command(self, _ctx: click.Context, name: str) -> click.Command | None:
        """Import the module of a verb and return its command."""
        if name not in VERBS:
            return None
        place = VERBS[name][0]
        command: click.Command = load_object(place) if name != "bench" or _has_benchmarks() else _no_benchmarks
        return command

    def format_commands(self, _ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the verbs with their one line each."""
        with formatter.section("Verbs"):
            formatter.write_dl([(name, line) for name, (_, line) in VERBS.items()])


def _has_benchmarks() -> bool:
    """Return whether the repository's benchmarks lie beside this package, and let them be imported if so."""
    beside = Path(__file__).resolve().parent.parent
    if not (beside / "benchmarks" / "command.py").is_file():
        return False
    if str(beside) not in sys.path:
        sys.path.append(str(beside))
    return True


@click.command("bench", add_help_option=False, context_settings={"ignore_unknown_options": True})
@click.argument("_arguments", nargs=-1)
def _no_benchmarks(_arguments: tuple[str, ...]) -> None:
    raise click.ClickException(
        "the benchmarks come with the repository, not with the package: run this in a clone of it"
    )


def _version(ctx: click.Context, _parameter: click.Parameter, requested: bool) -> None:
    if requested:
        click.echo(f"palpate {installed_version('palpate') or '(not installed)'}")
        ctx.exit()


@click.group(cls=Verbs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.option("--version", is_flag=True, callback=_version, is_eager=True, expose_value=False, help="Show the version.")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Palpate: experiments on touch, from a declared study to its report.

    A lab is a folder (--lab, default: the current one). Sessions lie in LAB/sessions/*.sqlite.
    """
    ctx.obj = texture_simulator


def texture_simulator() -> Any:
    """Return the simulator of textures: it is handed to modeling, which may not import a device."""
    return load_object("palpate.studies.simulation.texture_simulator:SimulatedTextures")()


@click.command()
@click.option("--lab", type=click.Path(file_okay=False, path_type=Path), default=Path("demo-lab"), show_default=True)
def demo(lab: Path) -> None:
    """See the whole loop: 40 simulated participants, replayed, collected and regenerated by plan; then real ratings.

    Each step is an ordinary command, shown before it runs. The lab is created anew every time.
    """
    from palpate.protocols.files import write_text
    from palpate.protocols.shell_command import shell_command

    _fresh(lab)
    for line in DEMO:
        click.secho(f"\n$ {shell_command(*line.split(), '--lab', lab)}", bold=True)
        try:
            status = _status([*line.split(), "--lab", str(lab)])
        finally:
            write_text(lab / DEMO_MARK, "".join(f"{name}\n" for name in sorted(_files_in(lab))))
        if status:
            raise click.exceptions.Exit(status)


def _fresh(lab: Path) -> None:
    """Empty the lab of an earlier demo, or make a new one; a folder that holds anything else is refused."""
    if lab.exists() and any(lab.iterdir()):
        mark = lab / DEMO_MARK
        if not mark.is_file():
            raise click.UsageError(f"{lab} exists and is not a demo lab; give another folder with --lab")
        listed = mark.read_text(encoding="utf-8").splitlines()
        if others := _files_in(lab) - set(listed):
            why = (
                f"holds {min(others)}, which the demo did not list as its own" if listed else
                "was written by a demo of an older version, or by one that was killed, and does not list its own files"
            )  # fmt: skip
            raise click.UsageError(
                f"{lab} {why}; if nothing in it is yours, remove it, else give another folder with --lab"
            )
        import shutil

        shutil.rmtree(lab)
    from palpate.protocols.files import write_text

    write_text(lab / DEMO_MARK, "")


def _files_in(lab: Path) -> set[str]:
    """Return the names of all files in the lab, except the mark and what a killed writer left."""
    from palpate.protocols.files import UNFINISHED

    paths = (path for path in lab.rglob("*") if path.is_symlink() or not path.is_dir())
    names = {path.relative_to(lab).as_posix() for path in paths}
    return {name for name in names if UNFINISHED not in name} - {DEMO_MARK}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 the thing checked failed, 2 a mistake or a fault, 130 interrupted."""
    sys.exit(_status(arguments))


def import_room(verb: str) -> None:
    """Import the module of a verb's command; an unknown verb or a failing import is reported when the command runs."""
    if verb in VERBS:
        with suppress(ImportError):
            import_module(VERBS[verb][0].partition(":")[0])


def _status(arguments: Sequence[str] | None) -> int:
    try:
        status = int(cli.main(arguments, prog_name="palpate", standalone_mode=False) or 0)
        sys.stdout.flush()
    except click.ClickException as error:
        error.show()
        return 2
    except KeyboardInterrupt:
        return _stopped()
    except click.Abort as error:
        return _stopped() if isinstance(error.__context__, KeyboardInterrupt) else _declined()
    except BrokenPipeError:
        _discard_output()
        return 1
    except Exception as error:
        if (message := _message(error)) is None:
            raise
        click.echo(f"Error: {message}", err=True)
        return 2
    return status


def _stopped() -> int:
    click.echo("stopped", err=True)
    return INTERRUPTED


def _declined() -> int:
    click.echo("stopped: not confirmed", err=True)
    return 1


def _message(error: Exception) -> str | None:
    """Return what to tell the user; None for a fault of ours, or where PALPATE_DEBUG asks for the traceback."""
    try:
        sys.stdout.flush()
    except OSError as full:
        _discard_output()
        full.filename = "the standard output"
        error = full if not isinstance(error, OSError) or error.filename is None else error
    if os.environ.get("PALPATE_DEBUG"):
        return None
    from palpate.studies.messages import describe_error

    return describe_error(error)


def _discard_output() -> None:
    """Let what is still buffered for the standard output go nowhere, so that the exit does not fail on it again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    main()
