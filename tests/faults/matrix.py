"""Drive commands with faults and compare what they leave; as a program, write docs/reference/faults.md anew."""

from __future__ import annotations

import shutil
import sqlite3
import sys
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import palpate
from protocols.files import UNFINISHED
from tests.faults.commands import LEFT_OUT, ROOT, WRITES, WRITES_NOTHING, arguments, commands, make_lab
from tests.faults.machine import FAULTS, INTERRUPT, MEMORY, SIZE, Ended, run_with

PAGE = ROOT / "docs" / "reference" / "faults.md"
COLUMNS = (*FAULTS, SIZE, INTERRUPT)
INSTANTS = 6
"""Interrupts of a command are raised at so many of its changes, spread over all of them, the last one included."""
BESIDE = ("-wal", "-shm", "-journal", ".lock")
"""What SQLite and locks keep beside a database."""
REFUSED, STOPPED, UNTOUCHED, DONE = "message, 2", "stopped, 130", "not met", "done"

Tree = dict[str, bytes | None]


HEAD = """\
# What a command does when the machine fails

Written by `python -m tests.faults.matrix`; a test runs it again and compares. Every command that writes is run in a lab
with data, and the kernel refuses its system calls (a seccomp filter): every write answers "no space left" or
"input/output error", every sync answers "input/output error", every opening to write and every renaming answers
"read-only file system"; or no file may grow beyond 512 bytes. An interrupt (Ctrl-C) comes before up to six of the
changes that the command makes to files, spread over all of them, the last renaming included.

- **message, 2**: one sentence on the standard error, exit code 2; every file is as it was, and none is left over.
- **stopped, 130**: the word `stopped`, exit code 130; every file is as it was, or all of them are new. The last of the
  instants may come when all is done already.
- **done**: the interrupt came after the last change. **not met**: the command needs nothing of the kind.

What is finished stays: `run` keeps every event that was on the disk before the fault, `collect` every session,
`regenerate` its record of how long each number took, `monitor` its cache of finished sessions."""


@dataclass(frozen=True)
class Outcome:
    """What a command came to under a fault, and what was wrong with that."""

    command: str
    fault: str
    said: str
    problems: tuple[str, ...]


def tree_of(folder: Path) -> Tree:
    """Return the contents of every file, and None for every folder; a database by its rows."""
    found: Tree = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.name.endswith(BESIDE) or ".locks" in path.parts:
            continue
        found[name] = None if path.is_dir() else _rows(path) if path.suffix == ".sqlite" else path.read_bytes()
    return found


def _rows(path: Path) -> bytes:
    """Return a database as SQL. Raises sqlite3.DatabaseError where it is damaged."""
    with closing(sqlite3.connect(path)) as connection:
        return "\n".join(connection.iterdump()).encode()


def outcomes(names: Sequence[str], faults: Sequence[str] = COLUMNS, instants: int = INSTANTS) -> Iterator[Outcome]:
    """Drive every command with every fault, each in a fresh copy of one working directory."""
    with TemporaryDirectory(dir=MEMORY if Path(MEMORY).is_dir() else None) as place:
        base = Path(place, "base")
        base.mkdir()
        make_lab(base)
        before = tree_of(base)
        for name in names:
            whole = _drive(name, None, base, Path(place, "whole"))
            if whole[0].code != 0:
                yield Outcome(name, "none", f"exit {whole[0].code}", (whole[0].err.strip()[-400:] or "failed",))
                continue
            for fault in faults:
                numbers = _spread(whole[0].changes, instants) if fault == INTERRUPT else [0]
                found = [_judge(name, fault, _drive(name, fault, base, Path(place, "case"), k), before, whole[1])
                         for k in numbers]  # fmt: skip
                said = dict.fromkeys(each.said for each in found)
                if STOPPED in said:  # the last instant may fall before or after the end, as signals come
                    said.pop(DONE, None)
                yield Outcome(name, fault, " or ".join(said), tuple(p for each in found for p in each.problems))


def _spread(count: int, most: int) -> list[int]:
    """At most so many of the numbers from 1 to `count`, evenly, with the first and the last."""
    if count <= most:
        return list(range(1, count + 1))
    return sorted({1 + round(k * (count - 1) / (most - 1)) for k in range(most)})


def _drive(name: str, fault: str | None, base: Path, place: Path, instant: int = 0) -> tuple[Ended, Tree]:
    shutil.copytree(base, place)
    try:
        ended = run_with(fault, place, partial(palpate._status, arguments(name)), instant)
        return ended, tree_of(place)
    finally:
        shutil.rmtree(place)


def _judge(name: str, fault: str, came: tuple[Ended, Tree], before: Tree, whole: Tree) -> Outcome:
    """Compare a case with what is expected: a message, exit 2 or 130, old files whole, nothing left over."""
    ended, tree = came
    problems = []
    if "Traceback" in ended.err:
        problems.append("a traceback: " + ended.err.strip().splitlines()[-1])
    if left := [path for path in tree if UNFINISHED in path or path.endswith(".part")]:
        problems.append(f"left over: {left[0]}")
    is_before, is_done = tree == before, tree.keys() == whole.keys()
    said = f"exit {ended.code}"
    if ended.code == 0 and is_done:
        said = DONE if fault == INTERRUPT else UNTOUCHED
    elif fault == INTERRUPT and ended.code == 130 and ("stopped" in ended.err or "by SIGINT" in ended.out):
        said = STOPPED
    elif fault != INTERRUPT and ended.code == 2 and ended.err.startswith(("Error: ", "Usage: ")):
        said = REFUSED
    else:
        problems.append(f"{said}: {ended.err.strip()[-200:]}")
    changed = [path for path in before if tree.get(path, b"gone") != before[path]] + [
        p for p in tree if p not in before
    ]
    if not is_before and not is_done and not _grows(name, changed):
        problems.append(f"changed: {', '.join(changed[:3])}")
    elif said == REFUSED and not is_before and not _grows(name, changed):
        problems.append(f"refused, and changed: {', '.join(changed[:3])}")
    return Outcome(name, fault, said, tuple(f"{name}, {fault}: {problem}" for problem in problems))


def _grows(name: str, changed: Sequence[str]) -> bool:
    """Whether only what keeps every finished step has grown: sessions, the collected database, the record of times."""
    grow = {"run": (".sqlite",), "collect": (".sqlite",), "regenerate": ("lab/regenerated", "seconds.json"),
            "monitor": ("lab/.cache", "monitor.jsonl")}  # fmt: skip
    return bool(changed) and all(path.endswith(grow.get(name, ())) for path in changed)


def page(found: Sequence[Outcome]) -> str:
    """Return the matrix as a page of the documentation."""
    rows = {name: {each.fault: each.said for each in found if each.command == name} for name in WRITES}
    lines = [
        *HEAD.splitlines(), "",
        f"| command | {' | '.join(COLUMNS)} |", "|---|" + "---|" * len(COLUMNS),
        *(f"| `{name}` | {' | '.join(said.get(fault, '') for fault in COLUMNS)} |" for name, said in rows.items()),
        "", "Not driven:", "", *(f"- `{name}`: {why}" for name, why in LEFT_OUT.items()), "",
        f"These write nothing: {', '.join(f'`{name}`' for name in WRITES_NOTHING)}.", "",
    ]  # fmt: skip
    return "\n".join(lines)


if __name__ == "__main__":
    commands()
    all_found = []
    for outcome in outcomes(sys.argv[1:] or list(WRITES)):
        all_found.append(outcome)
        sys.stderr.write(f"{outcome.command}: {outcome.fault}: {outcome.said} {' / '.join(outcome.problems)}\n")
    if not sys.argv[1:]:
        PAGE.write_text(page(all_found), encoding="utf-8")
