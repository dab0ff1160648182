"""Verbs about sessions: run, resume, replay, collect."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from studies.commands import JSON, LAB, echo_json

if TYPE_CHECKING:
    from studies.catalogue import Found
    from studies.session import RigAt, Sat

T = TypeVar("T")
_SEVERAL = re.compile(r"^([A-Za-z]+)([0-9]+)\.\.\1([0-9]+)$")


@click.command()
@click.argument("study")
@click.option("--participant", required=True, help="A pseudonym, as P001; with --simulate also several, as P001..P040.")
@click.option("--simulate", is_flag=True, help="A simulated participant at simulated devices, in virtual time.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of randomised orders and simulated people.")
@click.option("--group", help="The participant's group, if not by the pseudonym's number.")
@click.option("--row", type=click.IntRange(min=0), help="Row of the square, if not by the pseudonym's number.")
@click.option("--session", "number", type=click.IntRange(min=1), default=1, show_default=True, help="Which session.")
@LAB
@JSON
def run(
    study: str, participant: str, simulate: bool, seed: int, group: str | None, row: int | None, number: int, lab: Path,
    as_json: bool,
) -> None:  # fmt: skip
    """Run a session of STUDY; every event is on disk before the next thing happens.

    P001, P002, ... go round the study's groups in turn and take the next row of its square with every round.
    Ctrl-C ends a session safely; go on with palpate resume.

    Example: palpate run door_ratings --participant P001 --simulate --seed 1 --lab LAB
    """
    from protocols.plan import compile_plan
    from studies.allocation import allocate
    from studies.catalogue import find, read_study
    from studies.session import start

    found = read_study(find(study, lab))
    people = _people(participant, simulate)
    plans = [compile_plan(found.study, allocate(found.study, who, group, row), seed) for who in people]
    rig_at = _rig_at(simulate, found)
    sat = []
    for plan in _progress(plans, "running", as_json):
        sat.append(start(lab, plan, rig_at, number))
        if not sat[-1].complete:
            break
    _report(sat, as_json)


@click.command()
@click.argument("ledger", type=click.Path(path_type=Path))
@click.option("--study", help="The study's name or path, if it is not among the lab's or the shipped ones.")
@JSON
def resume(ledger: Path, study: str | None, as_json: bool) -> None:
    """Go on with an interrupted session: what is recorded is replayed, then the session goes on at the exact act.

    Example: palpate resume LAB/sessions/door_ratings_P001_s1.sqlite
    """
    from studies.catalogue import find, read_study
    from studies.record import read
    from studies.session import resume as go_on

    header = read(ledger).header
    found = read_study(find(study or header["study"]["study"], ledger.parent.parent))
    _report([go_on(ledger, _rig_at(header["rig"]["kind"] == "simulated", found))], as_json)


@click.command()
@click.argument("ledger", nargs=-1, type=click.Path(path_type=Path))
@LAB
@JSON
def replay(ledger: tuple[Path, ...], lab: Path, as_json: bool) -> None:
    """Replay recorded sessions and compare every event byte for byte; without LEDGER, all of the lab's.

    The stored study is compiled anew, must give the plan that was recorded, and its tasks must do what they did.
    Exit code 1 if a session is refused or differs; the message says which event and how.

    Example: palpate replay LAB/sessions/*.sqlite
    """
    from studies.collect import CollectError, ledgers_in

    paths = [inner for path in ledger for inner in _ledgers(path)] or ledgers_in(lab)
    if not paths:
        raise CollectError(f"no ledgers in {lab / 'sessions'}; run a session first, or name ledgers")
    rows = [_replayed(path) for path in _progress(paths, "replaying", as_json)]
    failed = [row for row in rows if not row["ok"]]
    if as_json:
        echo_json(rows)
    else:
        _show_replayed(rows, failed)
    if failed:
        raise click.exceptions.Exit(1)


@click.command()
@click.option("--to", "url", help="SQLAlchemy URL of the database.  [default: sqlite:///LAB/lab.sqlite]")
@LAB
@JSON
def collect(url: str | None, lab: Path, as_json: bool) -> None:
    """Gather the lab's sessions into one database; again is as good as once.

    Tables: studies, participants, sessions, trials, responses, events, streams; and the view `ratings`,
    one row per rating that counts. The database can be dropped and rebuilt at any time.

    Example: palpate collect --lab LAB --to postgresql+psycopg://user@host/lab
    """
    from studies.collect import CollectError, ledgers_in, open_database
    from studies.collect import collect as gather

    paths = ledgers_in(lab)
    if not paths:
        raise CollectError(f"no ledgers in {lab / 'sessions'}; run a session first")
    engine = open_database(url or f"sqlite:///{lab / 'lab.sqlite'}")
    try:
        rows = [row for path in _progress(paths, "collecting", as_json) for row in gather([path], engine)]
    finally:
        engine.dispose()
    counts = {what: sum(row.what == what for row in rows) for what in ("new", "grown", "unchanged")}
    if as_json:
        echo_json({"sessions": len(rows), **counts})
    else:
        told = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
        click.echo(f"{len(rows)} sessions collected ({told}) into {engine.url.render_as_string(hide_password=True)}")


def _people(participant: str, simulate: bool) -> list[str]:
    several = _SEVERAL.match(participant)
    if several is None:
        return [participant]
    from studies.allocation import AllocationError

    letters, first, last = several.groups()
    if not simulate:
        raise AllocationError(f"participant {participant!r}: only simulated sessions run several at once")
    if not 0 < int(last) - int(first) + 1 <= 10_000:
        raise AllocationError(f"participant {participant!r}: from first to last is expected, as P001..P040")
    return [f"{letters}{number:0{len(first)}d}" for number in range(int(first), int(last) + 1)]


def _rig_at(simulate: bool, found: Found) -> RigAt:
    from studies.rig import real, simulated

    if simulate:
        return lambda plan, t_ns: simulated(plan, found.folder, t_ns)
    return lambda plan, _t_ns: real(plan)


def _progress(items: Sequence[T], doing: str, quiet: bool) -> Iterable[T]:
    """The items one by one, with a progress bar on a terminal where it may take long."""
    if quiet or len(items) < 2:
        return items
    from rich.console import Console
    from rich.progress import track

    return track(items, doing, console=Console(stderr=True), transient=True)


def _report(sat: list[Sat], as_json: bool) -> None:
    if as_json:
        rows = [{"ledger": str(s.path), "complete": s.complete, "events": s.events, "ended": s.reason} for s in sat]
        echo_json(rows)
    else:
        for line in _told(sat):
            click.echo(line)
    if not all(each.complete for each in sat):
        raise click.exceptions.Exit(1)


def _told(sat: list[Sat]) -> Iterator[str]:
    done = [each for each in sat if each.complete]
    if len(done) > 1:
        yield f"{len(done)} sessions complete, {sum(each.events for each in done)} events, in {done[0].path.parent}"
    elif done:
        yield f"complete: {done[0].events} events in {done[0].path}"
    for each in sat:
        if not each.complete:
            yield f"{each.reason}; {each.events} events are kept. Go on with: palpate resume {each.path}"


def _ledgers(path: Path) -> list[Path]:
    return sorted(path.glob("*.sqlite")) if path.is_dir() else [path]


def _replayed(path: Path) -> dict[str, Any]:
    from protocols.worlds import Divergence
    from studies.record import LedgerError
    from studies.replay import replay as repeat

    try:
        found = repeat(path)
    except (LedgerError, Divergence) as error:
        return {"ledger": str(path), "ok": False, "problem": str(error)}
    return {
        "ledger": str(path),
        "ok": True,
        "events": found.events,
        "complete": found.complete,
        "session_s": found.session_s,
        "seconds": round(found.seconds, 4),
    }


def _show_replayed(rows: list[dict[str, Any]], failed: list[dict[str, Any]]) -> None:
    for row in failed:
        click.echo(f"DIFFERS  {row['ledger']}\n         {row['problem']}")
    good = [row for row in rows if row["ok"]]
    for row in good:
        if not row["complete"]:
            click.echo(f"(interrupted after {row['events']} events: {row['ledger']})")
    if good:
        took, lasted = sum(row["seconds"] for row in good), sum(row["session_s"] for row in good)
        click.echo(
            f"{len(good)} of {len(rows)} sessions repeat exactly: {sum(row['events'] for row in good)} events, "
            f"{lasted / 3600:.1f} h of sessions in {took:.1f} s ({lasted / max(took, 1e-9):,.0f} times as fast)"
        )
