"""The options of a session with a real window or of a rehearsal, and their command-line options."""

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
    """How a session is run.

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
    click.option("--accept-timing", is_flag=True, help="Start though no session is due now; recorded."),
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
    click.option("--accept-change", is_flag=True, help="Resume though study, model, screen or rig changed; recorded."),
)


def start_options(verb: Callable[..., Any]) -> Callable[..., Any]:
    """Add all options to a verb that starts sessions; it is called with live=LiveOptions in their place."""
    return _with(verb, (*_TO_START, *_ALWAYS))


def resume_options(verb: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of resuming to a verb; it is called with live=LiveOptions in their place."""
    return _with(verb, _ALWAYS)


def _with(verb: Callable[..., Any], options: tuple[Callable[..., Any], ...]) -> Callable[..., Any]:
    @functools.wraps(verb)
    def gathered(**given: Any) -> Any:
        ours = {
            option.name: given.pop(option.name)
            for option in fields(LiveOptions)
            if option.name in given and option.name != "as_json"
        }
        live = LiveOptions(**ours, as_json=bool(given.get("as_json", False)))
        if live.no_window and not live.rehearse:
            raise click.UsageError("--no-window goes with --rehearse: a participant answers in the window")
        if live.rig is not None and (live.twins or live.rehearse):
            raise click.UsageError("--rig names devices to open, and with --twins or --rehearse none is: leave one out")
        return verb(**given, live=live)

    return with_options(gathered, options)
