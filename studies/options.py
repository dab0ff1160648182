"""What the verbs of several folders share: options, progress, answers as JSON. Imports nothing heavy and no device."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence, Sized
from contextlib import contextmanager
from functools import wraps
from typing import Any, TypeVar, cast

import click

from palpate.protocols.extras import demand_packages
from palpate.protocols.lab_option import JSON, LAB, look_in
from palpate.protocols.progress import Progress

T = TypeVar("T")
Command = TypeVar("Command", bound=Callable[..., Any])

__all__ = ["JSON", "LAB", "look_in"]


def sessions_option(otherwise: str = "") -> Callable[[Command], Command]:
    """Return the option --sessions; `otherwise` says what is used without it. `only_simulated` interprets its value."""
    usual = f"  [default: {otherwise}]" if otherwise else ""
    return click.option(
        "--sessions",
        type=click.Choice(["real", "simulated"]),
        help=f"Take only these, where the lab has both.{usual}",
    )


def only_simulated(sessions: str | None) -> bool | None:
    """Interpret --sessions: True for simulated ones alone, False for real ones alone, None for both."""
    return None if sessions is None else sessions == "simulated"


def names_in(given: Sequence[str]) -> tuple[str, ...]:
    """Return the names given to an option that takes several between commas and may be repeated."""
    return tuple(name.strip() for part in given for name in part.split(",") if name.strip())


def with_options(command: Callable[..., Any], options: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    """Add all these options to a command, in the order in which help lists them."""
    for option in reversed(options):
        command = option(command)
    return command


def needs_packages(*packages: str) -> Callable[[Command], Command]:
    """Refuse a command at once where a package of an extra is missing. Put this decorator above the options."""

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
    """Yield the items, with a progress bar on a terminal; `total` is their number if `items` has no length."""
    count = len(items) if total is None and isinstance(items, Sized) else total or 0
    with progress_bar(quiet) as show:
        show(0, count, doing)
        for done, item in enumerate(items, start=1):
            yield item
            show(done, count, doing)


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Progress]:
    """Show a progress bar on a terminal, nothing elsewhere: call it with the number done, the total and what they are.

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
