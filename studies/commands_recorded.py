"""Verbs about recorded sessions: replay, collect."""

from __future__ import annotations

import time
from collections import Counter
from contextlib import closing
from pathlib import Path
from typing import Any

import click

from palpate.protocols.wording import count
from palpate.studies.options import JSON, LAB, echo_json, progress
from palpate.studies.workers import WORKERS, map_in_order, workers_for


@click.command()
@click.argument("ledger", nargs=-1, type=click.Path(path_type=Path))
@click.option("--recompute", is_flag=True, help="Also ask procedures for their choices again, and compare them.")
@LAB
@WORKERS
@JSON
def replay(ledger: tuple[Path, ...], recompute: bool, lab: Path, workers: int | None, as_json: bool) -> None:
    """Replay recorded sessions and compare every event byte for byte; without LEDGER, all of the lab's.

    The stored study is compiled again, must give the recorded plan, and its tasks must do what they did.
    Exit code 1 if a session is refused or differs; the message says which event and how. A replay takes levels that a
    procedure chose from the record; with --recompute they are chosen again, and a level that differs is a difference.

    \b
    Example:
      palpate replay LAB/sessions/*.sqlite
    """
    from palpate.studies.collecting.collect import CollectError
    from palpate.studies.sessions.session_files import ledgers_in

    for path in ledger:
        if not path.exists():
            raise CollectError(f"{path}: no such ledger or folder")
    named = [sorted(path.glob("*.sqlite")) if path.is_dir() else [path] for path in ledger]
    paths = [path for paths in named for path in paths] or ledgers_in(lab)
    if not paths:
        raise CollectError(f"no ledgers in {lab / 'sessions'}; run a session first, or name ledgers")
    started_s = time.perf_counter()
    replayed = map_in_order(_recomputed if recompute else _replayed, paths, workers_for(len(paths), workers))
    with closing(progress(replayed, "replaying", as_json, len(paths))) as steps:
        rows = list(steps)
    failed = [row for row in rows if not row["ok"]]
    if as_json:
        echo_json(rows)
    else:
        _show_replayed(rows, failed, time.perf_counter() - started_s)
    if failed:
        raise click.exceptions.Exit(1)


@click.command()
@click.option("--to", "url", help="SQLAlchemy URL of the database.  [default: LAB/lab.sqlite]")
@click.option("--rebuild", is_flag=True, help="Empty the database first.")
@click.option("--verify", is_flag=True, help="Read every ledger and check its chain, also where nothing changed.")
@LAB
@WORKERS
@JSON
def collect(url: str | None, rebuild: bool, verify: bool, lab: Path, workers: int | None, as_json: bool) -> None:
    """Gather the lab's sessions into one database; again is as good as once.

    A ledger is read only if it changed since it was collected: its size, time, write-ahead log or last hash.

    Tables: studies, participants, sessions, trials, responses, words, answers, switches, events, streams; and the
    view `ratings`, one row per rating as it stands. Sessions of participants who withdrew are marked.
    The database can be dropped and rebuilt at any time.
    A refused ledger is named and the others are collected; the exit code is 1 then.

    \b
    Example:
      palpate collect --lab LAB --to postgresql+psycopg://user@host/lab
    """
    from sqlalchemy import URL

    from palpate.studies.collecting.collect import DATABASE, CollectError, Collector, Refused, open_database
    from palpate.studies.messages import describe_url
    from palpate.studies.participants.registry import withdrawn
    from palpate.studies.sessions.session_files import ledgers_in, others_in

    paths = ledgers_in(lab)
    if not paths:
        raise CollectError(f"no ledgers in {lab / 'sessions'}; run a session first")
    if url is not None and url.strip() in {"sqlite://", "sqlite:///", "sqlite:///:memory:"}:
        raise CollectError(
            f"{url}: a database in memory is lost when the command ends; name a file, as sqlite:///lab.sqlite"
        )
    engine = open_database(url or URL.create("sqlite", database=str(lab / DATABASE)), rebuild, lab)
    collector = Collector(engine, withdrawn(lab), verify)
    try:
        bringing = collector.bring_all(paths, workers)
        with closing(bringing), closing(progress(bringing, "collecting", as_json, len(paths))) as steps:
            rows = list(steps)
    finally:
        engine.dispose()
    refused = [row.problem for row in rows if isinstance(row, Refused)]
    done = Counter(row.what for row in rows if not isinstance(row, Refused))
    counts = {**{what: done[what] for what in ("new", "updated", "unchanged")}, "refused": len(refused)}
    skipped = [path.name for path in others_in(lab)]
    if as_json:
        echo_json({"sessions": len(rows), **counts, "problems": refused, "skipped": skipped})
    else:
        parts = ", ".join(f"{number} {what}" for what, number in counts.items() if number)
        sessions = count(len(rows) - len(refused), "session")
        click.echo(f"{sessions} collected ({parts}) into {describe_url(engine.url)}")
        for problem in refused:
            click.echo(f"REFUSED  {problem}")
        if skipped:
            click.echo(f"not taken for sessions by their names: {', '.join(skipped)}")
    if refused:
        raise click.exceptions.Exit(1)


def _replayed(path: Path) -> dict[str, Any]:
    from palpate.protocols.runner import Divergence
    from palpate.studies.sessions.record import LedgerError
    from palpate.studies.sessions.replay import replay as repeat

    try:
        replayed = repeat(path)
    except LedgerError as error:
        return {"ledger": str(path), "ok": False, "verdict": "refused", "problem": str(error)}
    except Divergence as error:
        return {"ledger": str(path), "ok": False, "verdict": "differs", "problem": str(error)}
    return {
        "ledger": str(path),
        "ok": True,
        "verdict": "equal",
        "lacks_wal": replayed.lacks_wal,
        "events": replayed.events,
        "complete": replayed.complete,
        "session_s": replayed.session_s,
        "seconds": round(replayed.seconds, 4),
    }


def _recomputed(path: Path) -> dict[str, Any]:
    """Replay one ledger, then make the choices of its procedures again."""
    row = _replayed(path)
    if not row["ok"]:
        return row
    from palpate.studies.procedures.recompute import describe_differences, recompute
    from palpate.studies.sessions.record import read

    choices, differences = recompute(read(path))
    row |= {"choices": choices, "choices_that_differ": len(differences)}
    if differences:
        row |= {"ok": False, "verdict": "differs", "problem": "\n         ".join(describe_differences(differences))}
    return row


def _show_replayed(rows: list[dict[str, Any]], failed: list[dict[str, Any]], took: float) -> None:
    for row in failed:
        click.echo(f"{row['verdict'].upper():<8} {row['ledger']}\n         {row['problem']}")
    good = [row for row in rows if row["ok"]]
    for row in good:
        if row["lacks_wal"]:
            click.echo(f"(the -wal file is missing, events may be lost with it: {row['ledger']})")
        elif not row["complete"]:
            click.echo(f"(interrupted after {count(row['events'], 'event')}: {row['ledger']})")
    if choices := sum(row.get("choices", 0) for row in good):
        click.echo(f"{count(choices, 'choice')} of procedures made again, all as recorded")
    if good:
        lasted = sum(row["session_s"] for row in good)
        click.echo(
            f"{len(good)} of {count(len(rows), 'session')} repeat{'s' * (len(rows) == 1)} exactly: "
            f"{count(sum(row['events'] for row in good), 'event')}, "
            f"{lasted / 3600:.1f} h of sessions in {took:.1f} s ({lasted / max(took, 1e-9):,.0f} times as fast)"
        )
