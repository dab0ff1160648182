"""What the verbs of several rooms share: the lab, and an answer as JSON. Imports nothing heavy and no device."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence, Sized
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar, cast

import click

from palpate.protocols.extras import demand_packages
from palpate.protocols.progress import Progress

T = TypeVar("T")
Command = TypeVar("Command", bound=Callable[..., Any])

LAB = click.option(
    "--lab", type=click.Path(file_okay=False, path_type=Path), default=Path(), show_default="the current folder",
    help="The lab's folder.",
)  # fmt: skip
JSON = click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON.")


def sessions_option(otherwise: str = "") -> Callable[[Command], Command]:
    """The option --sessions; `otherwise` tells what is taken without it. `only_simulated` says what it means."""
    usual = f"  [default: {otherwise}]" if otherwise else ""
    return click.option(
        "--sessions",
        type=click.Choice(["real", "simulated"]),
        help=f"Take only these, where the lab has both.{usual}",
    )


def only_simulated(sessions: str | None) -> bool | None:
    """Return the choice of --sessions: True for simulated ones alone, False for people's alone, None for both."""
    return None if sessions is None else sessions == "simulated"


def names_in(given: Sequence[str]) -> tuple[str, ...]:
    """The names of an option that takes some between commas and may be given more than once."""
    return tuple(name.strip() for part in given for name in part.split(",") if name.strip())


def with_options(command: Callable[..., Any], options: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    """Put all of these on a command; help shows them in their order."""
    for option in reversed(options):
        command = option(command)
    return command


def needs_packages(*packages: str) -> Callable[[Command], Command]:
    """Refuse a command before any work where a package is missing that an extra installs. Put it above the options."""

    def checked(command: Command) -> Command:
        @wraps(command)
        def run(*given: Any, **named: Any) -> Any:
            demand_packages(click.get_current_context().command_path, *packages)
            return command(*given, **named)

        return cast(Command, run)

    return checked


def echo_json(value: Any) -> None:
    """Print JSON for a script: one line, keys sorted."""
    from palpate.protocols.canonical import canonical

    click.echo(canonical(value).decode())


def progress(items: Iterable[T], doing: str, quiet: bool, total: int | None = None) -> Generator[T]:
    """The items one by one; on a terminal with a progress bar. `total` says how many, where `items` has no length."""
    count = len(items) if total is None and isinstance(items, Sized) else total or 0
    with progress_bar(quiet) as show:
        show(0, count, doing)
        for done, item in enumerate(items, start=1):
            yield item
            show(done, count, doing)


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Progress]:
    """A bar on a terminal with the time left, nothing elsewhere: call it with how many are done, of how many, of what.

    A smaller number done than before, or another total, begins a further part of the work.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda *_: None
        return
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
        TextColumn("left"), TimeRemainingColumn(compact=True),
    )  # fmt: skip
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=None)

        def show(done: int, total: int, what: str) -> None:
            now = bar.tasks[0]
            if now.total != total or done < now.completed:
                bar.reset(task, total=total)
            bar.update(task, completed=done, total=total, description=what)

        yield show
