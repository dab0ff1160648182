"""`palpate record`: run a capture study, and say what every stream came to."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from palpate.protocols.shell_command import shell_command
from palpate.protocols.wording import count
from palpate.studies.commands_sessions import report, sat_through, session_options

if TYPE_CHECKING:
    from palpate.protocols.events import Event
    from palpate.studies.record import Record


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
    from palpate.studies.catalogue import find, read_study

    found = read_study(find(study, asked["lab"]))
    if found.study.task != "capture":
        told = f"{found.study.study} is no capture study: it asks, and no sensor records. {shell_command('run', study)}"
        raise click.UsageError(told)
    sat = sat_through(found, **asked)
    if not as_json:
        from palpate.studies.record import read

        for line in (line for each in sat for line in recorded(read(each.path))):
            click.echo(line)
    report(sat, as_json, study, asked["live"].rig)


def recorded(record: Record) -> Iterator[str]:
    """What the recordings of a session that count came to, a line each."""
    for attempt in record.state.counting:
        for event in record.events_of(attempt):
            if event.kind == "reply" and event.value.get("recorded"):
                yield from (f"trial {event.trial}, {line}" for line in _of_reply(event))


def _of_reply(event: Event) -> Iterator[str]:
    """Of each stream what came and what was lost; the samples of a simulated session lie in its reply."""
    for name, stream in event.value.get("streams", {}).items():
        yield f"{name}: {_told(stream)}"
    for samples in event.samples:
        yield f"{samples.stream}: {count(samples.count, 'sample')}, {samples.rate_hz:.2f} Hz, simulated"
    if pictures := event.value.get("pictures"):
        flagged = sum(bool(each.get("flags")) for each in pictures)
        yield f"camera: {count(len(pictures), 'picture')}" + (f", {flagged} of them flagged" if flagged else "")


def _told(stream: dict[str, Any]) -> str:
    lost = f"{stream['lost']} LOST in {count(stream['gaps'], 'gap')}" if stream["lost"] else "none lost"
    drift = "" if stream.get("drift_ppm") is None else f", clock {stream['drift_ppm']:+.0f} ppm"
    rate = "rate not measured" if stream["rate_hz"] is None else f"{stream['rate_hz']:.2f} Hz"
    return f"{count(stream['samples'], 'sample')}, {rate}, {lost}{drift}"
