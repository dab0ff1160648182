"""Verbs about sessions: run, resume, replay, collect."""

from __future__ import annotations

import re
import shlex
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from studies.options import JSON, LAB, echo_json

if TYPE_CHECKING:
    from sqlalchemy import Engine

    from studies.catalogue import Found
    from studies.rig import RigPlan
    from studies.session import Sat

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

    \b
    Example:
      palpate run door_ratings --participant P001 --simulate --seed 1 --lab LAB
    """
    from protocols.plan import compile_plan
    from studies.allocation import allocate
    from studies.catalogue import find, read_study
    from studies.session import start
    from studies.squares import demand_free

    found = read_study(find(study, lab))
    people = _people(participant, simulate)
    plans = [compile_plan(found.study, allocate(found.study, who, group, row), seed) for who in people]
    rig = _rig(simulate, found)
    demand_free(lab, plans, number, shared=row is not None)
    sat = []
    with closing(_progress(plans, "running", as_json)) as steps:
        for plan in steps:
            sat.append(start(lab, plan, rig, number))
            if not sat[-1].complete:
                break
    _report(sat, as_json, study)


@click.command()
@click.argument("ledger", type=click.Path(path_type=Path))
@click.option("--study", help="The study's name or path, if it is not among the lab's or the shipped ones.")
@click.option("--without-wal", is_flag=True, help="Go on although the file's -wal companion was lost.")
@JSON
def resume(ledger: Path, study: str | None, without_wal: bool, as_json: bool) -> None:
    """Go on with an interrupted session: what is recorded is replayed, then the session goes on at the exact act.

    \b
    Example:
      palpate resume LAB/sessions/door_ratings_P001_s1.sqlite
    """
    from studies.catalogue import Found, find
    from studies.record import LedgerError, read
    from studies.replay import recompiled
    from studies.session import resume as go_on

    if ledger.is_dir():
        raise LedgerError(f"{ledger}: a folder; name one ledger, as {ledger / 'STUDY_P001_s1.sqlite'}")
    record = read(ledger)
    if record.lacks_wal and not without_wal:
        raise LedgerError(
            f"{ledger}: its -wal file, which may hold the session's last events, is not there; copy both files, "
            "or add --without-wal to go on from what is left"
        )
    declared = recompiled(record).study
    folder = find(study or declared.study, ledger.resolve().parent.parent).parent
    rig = _rig(record.header["rig"]["kind"] == "simulated", Found(declared, folder))
    _report([go_on(ledger, rig)], as_json, study)


@click.command()
@click.argument("ledger", nargs=-1, type=click.Path(path_type=Path))
@LAB
@JSON
def replay(ledger: tuple[Path, ...], lab: Path, as_json: bool) -> None:
    """Replay recorded sessions and compare every event byte for byte; without LEDGER, all of the lab's.

    The stored study is compiled anew, must give the plan that was recorded, and its tasks must do what they did.
    Exit code 1 if a session is refused or differs; the message says which event and how.

    \b
    Example:
      palpate replay LAB/sessions/*.sqlite
    """
    from studies.collect import CollectError, ledgers_in

    for path in ledger:
        if not path.exists():
            raise CollectError(f"{path}: no such ledger or folder")
    paths = [inner for path in ledger for inner in _ledgers(path)] or ledgers_in(lab)
    if not paths:
        raise CollectError(f"no ledgers in {lab / 'sessions'}; run a session first, or name ledgers")
    with closing(_progress(paths, "replaying", as_json)) as steps:
        rows = [_replayed(path) for path in steps]
    failed = [row for row in rows if not row["ok"]]
    if as_json:
        echo_json(rows)
    else:
        _show_replayed(rows, failed)
    if failed:
        raise click.exceptions.Exit(1)


@click.command()
@click.option("--to", "url", help="SQLAlchemy URL of the database.  [default: LAB/lab.sqlite]")
@click.option("--rebuild", is_flag=True, help="Empty the database first.")
@LAB
@JSON
def collect(url: str | None, rebuild: bool, lab: Path, as_json: bool) -> None:
    """Gather the lab's sessions into one database; again is as good as once.

    Tables: studies, participants, sessions, trials, responses, events, streams; and the view `ratings`,
    one row per rating as it stands. The database can be dropped and rebuilt at any time.
    A refused ledger is named and the others are collected; the exit code is 1 then.

    \b
    Example:
      palpate collect --lab LAB --to postgresql+psycopg://user@host/lab
    """
    from sqlalchemy import URL

    from studies.collect import CollectError, drop, ledgers_in, open_database, others_in

    paths = ledgers_in(lab)
    if not paths:
        raise CollectError(f"no ledgers in {lab / 'sessions'}; run a session first")
    if url is not None and url.strip() in {"sqlite://", "sqlite:///", "sqlite:///:memory:"}:
        raise CollectError(f"{url}: a database in memory is gone at once; name a file, as sqlite:///lab.sqlite")
    engine = open_database(url or URL.create("sqlite", database=str(lab / "lab.sqlite")))
    try:
        if rebuild:
            drop(engine)
        with closing(_progress(paths, "collecting", as_json)) as steps:
            rows = [_collected(path, engine) for path in steps]
    finally:
        engine.dispose()
    counts = {what: sum(row["what"] == what for row in rows) for what in ("new", "updated", "unchanged", "refused")}
    refused = [row for row in rows if row["what"] == "refused"]
    skipped = [path.name for path in others_in(lab)]
    if as_json:
        echo_json(
            {"sessions": len(rows), **counts, "problems": [row["problem"] for row in refused], "skipped": skipped}
        )
    else:
        _show_collected(counts, refused, skipped, engine.url.render_as_string(hide_password=True))
    if refused:
        raise click.exceptions.Exit(1)


def _collected(path: Path, engine: Engine) -> dict[str, Any]:
    from studies.collect import CollectError
    from studies.collect import collect as gather
    from studies.record import LedgerError

    try:
        [found] = gather([path], engine)
    except (LedgerError, CollectError) as error:
        return {"what": "refused", "problem": str(error)}
    return {"what": found.what}


def _show_collected(counts: dict[str, int], refused: list[dict[str, Any]], skipped: list[str], where: str) -> None:
    told = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
    click.echo(f"{sum(counts.values()) - len(refused)} sessions collected ({told}) into {where}")
    for row in refused:
        click.echo(f"REFUSED  {row['problem']}")
    if skipped:
        click.echo(f"not taken for sessions by their names: {', '.join(skipped)}")


def _people(participant: str, simulate: bool) -> list[str]:
    several = _SEVERAL.fullmatch(participant)
    if several is None:
        return [participant]
    from studies.allocation import AllocationError

    letters, first, last = several.groups()
    if not simulate:
        raise AllocationError(f"participant {participant!r}: only simulated sessions run several at once")
    if not 0 < int(last) - int(first) + 1 <= 10_000:
        raise AllocationError(f"participant {participant!r}: from first to last is expected, as P001..P040")
    return [f"{letters}{number:0{len(first)}d}" for number in range(int(first), int(last) + 1)]


def _rig(simulate: bool, found: Found) -> RigPlan:
    from studies import rig

    return rig.simulated(found.study, found.folder) if simulate else rig.real(found.study)


def _progress(items: Sequence[T], doing: str, quiet: bool) -> Generator[T]:
    """The items one by one; on a terminal with a progress bar."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=quiet or not console.is_terminal) as bar:
        yield from bar.track(items, description=doing)


def _report(sat: list[Sat], as_json: bool, study: str | None) -> None:
    if as_json:
        rows = [{"ledger": str(s.path), "complete": s.complete, "events": s.events, "ended": s.reason} for s in sat]
        echo_json(rows)
    else:
        for line in _told(sat, study):
            click.echo(line)
    if not all(each.complete for each in sat):
        raise click.exceptions.Exit(1)


def _told(sat: list[Sat], study: str | None) -> Iterator[str]:
    done = [each for each in sat if each.complete]
    if len(done) > 1:
        yield f"{len(done)} sessions complete, {sum(each.events for each in done)} events, in {done[0].path.parent}"
    elif done:
        yield f"complete: {done[0].events} events in {done[0].path}"
    for each in sat:
        if not each.complete:
            by_path = ["--study", study] if study and ("/" in study or Path(study).suffix) else []
            command = shlex.join(["palpate", "resume", str(each.path), *by_path])
            yield f"{each.reason}; {each.events} events are kept. Go on with: {command}"


def _ledgers(path: Path) -> list[Path]:
    return sorted(path.glob("*.sqlite")) if path.is_dir() else [path]


def _replayed(path: Path) -> dict[str, Any]:
    from protocols.worlds import Divergence
    from studies.record import LedgerError
    from studies.replay import replay as repeat

    try:
        found = repeat(path)
    except LedgerError as error:
        return {"ledger": str(path), "ok": False, "verdict": "refused", "problem": str(error)}
    except Divergence as error:
        return {"ledger": str(path), "ok": False, "verdict": "differs", "problem": str(error)}
    return {
        "ledger": str(path),
        "ok": True,
        "verdict": "equal",
        "lacks_wal": found.lacks_wal,
        "events": found.events,
        "complete": found.complete,
        "session_s": found.session_s,
        "seconds": round(found.seconds, 4),
    }


def _show_replayed(rows: list[dict[str, Any]], failed: list[dict[str, Any]]) -> None:
    for row in failed:
        click.echo(f"{row['verdict'].upper():<8} {row['ledger']}\n         {row['problem']}")
    good = [row for row in rows if row["ok"]]
    for row in good:
        if row["lacks_wal"]:
            click.echo(f"(the -wal file is missing, events may be lost with it: {row['ledger']})")
        elif not row["complete"]:
            click.echo(f"(interrupted after {row['events']} events: {row['ledger']})")
    if good:
        took, lasted = sum(row["seconds"] for row in good), sum(row["session_s"] for row in good)
        click.echo(
            f"{len(good)} of {len(rows)} sessions repeat exactly: {sum(row['events'] for row in good)} events, "
            f"{lasted / 3600:.1f} h of sessions in {took:.1f} s ({lasted / max(took, 1e-9):,.0f} times as fast)"
        )
