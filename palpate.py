"""The front door: one command line, a thin table of verbs, each importing its room only when called."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import click

ROOMS = ("protocols", "devices", "studies", "analysis", "modeling")
VERBS = {
    "studies": ("studies.commands:studies", "List the studies that can be run here."),
    "check": ("studies.commands:check", "Check a study file and everything it names."),
    "plan": ("studies.commands:plan", "Show what a participant will meet, and how balanced the orders are."),
    "run": ("studies.commands_sessions:run", "Run a session of a study."),
    "resume": ("studies.commands_sessions:resume", "Go on with an interrupted session where it stopped."),
    "replay": ("studies.commands_sessions:replay", "Prove that recorded sessions repeat, event by event."),
    "collect": ("studies.commands_sessions:collect", "Gather a lab's sessions into one database."),
    "doors": ("devices.door.commands:doors", "Make car-door stimuli: normalise, simulate, augment."),
    "import": ("analysis.commands:import_", "Read a foreign table of ratings into a lab."),
    "analyse": ("analysis.commands:analyse", "Compute a study's tables and statistics."),
    "report": ("analysis.commands:report", "Write a study's report as one HTML file."),
    "demo": ("analysis.demo:demo", "See the whole loop: 40 participants, from study file to report."),
    "bench": ("analysis.bench_command:bench", "Measure errors and times side by side."),
}


class Verbs(click.Group):
    """A group that knows its verbs without importing them."""

    def list_commands(self, _ctx: click.Context) -> list[str]:
        """The verbs, in the order of a study's life."""
        return list(VERBS)

    def get_command(self, _ctx: click.Context, name: str) -> click.Command | None:
        """Import the verb's room and hand over its command."""
        if name not in VERBS:
            return None
        module, _, attribute = VERBS[name][0].partition(":")
        command: click.Command = getattr(import_module(module), attribute)
        return command

    def format_commands(self, _ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the verbs with their one line each."""
        with formatter.section("Verbs"):
            formatter.write_dl([(name, line) for name, (_, line) in VERBS.items()])

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """As click does, but an unknown verb names the nearest known one."""
        if args and args[0] not in VERBS and not args[0].startswith("-"):
            from protocols.consistency import nearest

            ctx.fail(f"no verb {args[0]!r}; {nearest(args[0], VERBS)}")
        return super().resolve_command(ctx, args)


def _version(ctx: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
    if wanted:
        try:
            click.echo(f"palpate {version('palpate')}")
        except PackageNotFoundError:
            click.echo("palpate (not installed)")
        ctx.exit()


@click.group(cls=Verbs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.option("--version", is_flag=True, callback=_version, is_eager=True, expose_value=False, help="Show the version.")
def cli() -> None:
    """Palpate: experiments on touch, from a declared study to a report, and one that proves it.

    A lab is a folder (--lab, default: the current one). Sessions lie in LAB/sessions/*.sqlite.
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 the thing checked failed, 2 a mistake in what was asked."""
    sys.exit(_status(arguments))


def _status(arguments: Sequence[str] | None) -> int:
    try:
        return int(cli.main(arguments, prog_name="palpate", standalone_mode=False) or 0)
    except click.ClickException as error:
        error.show()
        return 2
    except (click.Abort, KeyboardInterrupt):
        click.echo("stopped", err=True)
        return 1
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (ValueError, OSError) as error:
        if not _a_mistake_of_use(error):
            raise
        click.echo(f"Error: {error}", err=True)
        return 2


def _a_mistake_of_use(error: Exception) -> bool:
    """Errors that our rooms raise by name, and files that are not to be had; anything else is a fault of ours."""
    if os.environ.get("PALPATE_DEBUG"):
        return False
    return type(error).__module__.partition(".")[0] in ROOMS or (isinstance(error, OSError) and bool(error.filename))


if __name__ == "__main__":
    main()
