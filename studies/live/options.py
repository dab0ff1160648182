"""What can be asked of a session with a real window, or of a rehearsal, and the command-line options for it."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import click

from palpate.devices.options import size_px
from palpate.studies.options import with_options

PACE_S = 0.4
REHEARSALS = "rehearsals"
"""The folder of a lab in which rehearsals lie, apart from its sessions."""


@dataclass(frozen=True)
class LiveOptions:
    """How a session is to be had.

    `rig` None: the station's rig file. `language` and `screen` None: as recorded, as calibrated, else English.
    `windowed` is a size in pixels, in place of the full screen; `as_json` keeps standard output for the answer.
    """

    twins: bool = False
    rig: Path | None = None
    rehearse: bool = False
    pace_s: float = PACE_S
    no_window: bool = False
    language: str | None = None
    screen: int | None = None
    windowed: tuple[int, int] | None = None
    accept_change: bool = False
    accept_timing: bool = False
    as_json: bool = False


_TO_START = (
    click.option("--rehearse", is_flag=True, help="Play the whole study fast, with a simulated participant's answers."),
    click.option("--pace", "pace_s", type=click.FloatRange(0, 60), default=PACE_S, show_default=True, metavar="SECONDS",
                 help="With --rehearse: how long each screen stays."),
    click.option("--no-window", is_flag=True, help="With --rehearse: the console alone."),
    click.option("--accept-timing", is_flag=True, help="Begin though no session is due now; put on record."),
)  # fmt: skip
_ALWAYS = (
    click.option("--twins", is_flag=True, help="Simulated devices in place of the rig; every record says so."),
    click.option(
        "--rig",
        type=click.Path(dir_okay=False, path_type=Path),
        show_default="LAB/stations/HOST/rig.yaml",
        help="The rig file.",
    ),
    click.option("--language", help="The participant's language, as ko.  [default: en, or as recorded]"),
    click.option("--screen", type=click.IntRange(min=0), help="The participant's screen.  [default: as calibrated]"),
    click.option("--windowed", callback=size_px, metavar="WxH", help="A window of this size, not the full screen."),
    click.option("--accept-change", is_flag=True, help="Go on though study, model, screen or rig changed; on record."),
)


def to_start(verb: Callable[..., Any]) -> Callable[..., Any]:
    """Give a verb that starts sessions all options; it is called with live=LiveOptions in their place."""
    return _with(verb, (*_TO_START, *_ALWAYS))


def to_go_on(verb: Callable[..., Any]) -> Callable[..., Any]:
    """Give a verb that goes on with sessions its options; it is called with live=LiveOptions in their place."""
    return _with(verb, _ALWAYS)


def _with(verb: Callable[..., Any], options: tuple[Callable[..., Any], ...]) -> Callable[..., Any]:
    @functools.wraps(verb)
    def gathered(**given: Any) -> Any:
        ours = {
            each.name: given.pop(each.name)
            for each in fields(LiveOptions)
            if each.name in given and each.name != "as_json"
        }
        as_json = bool(given.get("as_json", False))
        return verb(**given, live=_checked(LiveOptions(**ours, as_json=as_json)))

    return with_options(gathered, options)


def _checked(options: LiveOptions) -> LiveOptions:
    if options.no_window and not options.rehearse:
        raise click.UsageError("--no-window goes with --rehearse: a participant answers in the window")
    if options.rig is not None and (options.twins or options.rehearse):
        raise click.UsageError("--rig names devices to open, and with --twins or --rehearse none is: leave one out")
    return options
