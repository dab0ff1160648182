"""`palpate record`: run a capture study, and say what every stream came to."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from studies.commands_sessions import report, sat_through, session_options

if TYPE_CHECKING:
    from studies.session import Sat


@click.command()
@session_options
def record(study: str, as_json: bool, **asked: Any) -> None:
    """Record the stimuli of a capture STUDY with the station's sensors, and say what every stream came to.

    The devices are those of LAB/stations/HOST/rig.yaml (palpate rig simulate writes one of twins). What the sensors
    give is on disk while it is recorded; what is lost is counted; a recording that a fault breaks off is made again.

    \b
    Examples:
      palpate record texture_capture --participant P001 --group pilot --lab LAB
      palpate record texture_capture --participant P001 --simulate --lab LAB
    """
    from studies.catalogue import find, read_study

    found = read_study(find(study, asked["lab"]))
    if found.study.task != "capture":
        raise click.UsageError(f"{found.study.study} asks and records nothing: palpate run {study}")
    sat = sat_through(found, **asked)
    if not as_json:
        for line in (line for each in sat for line in _streams(each)):
            click.echo(line)
    report(sat, as_json, study)


def _streams(sat: Sat) -> Iterator[str]:
    """What the recordings that count came to, a line each."""
    from studies.record import read

    for event in read(sat.path).events:
        if event.kind == "reply" and event.value.get("recorded"):
            for name, stream in event.value.get("streams", {}).items():
                yield f"trial {event.trial}, {name}: {_told(stream)}"


def _told(stream: dict[str, Any]) -> str:
    lost = f"{stream['lost']} LOST in {stream['gaps']} gaps" if stream["lost"] else "none lost"
    drift = "" if stream.get("drift_ppm") is None else f", clock {stream['drift_ppm']:+.0f} ppm"
    return f"{stream['samples']} samples, {stream['rate_hz']:.2f} Hz, {lost}{drift}"
