"""Drive commands with faults and compare what they leave; as a program, write the page of disk faults."""

from __future__ import annotations

import re
import shutil
import sqlite3
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

from palpate import command_line
from palpate.protocols.files import UNFINISHED
from tests.faults.commands import (
    DRIVEN,
    LEFT_OUT,
    MODELS,
    ROOT,
    TEXTURES,
    WRITES_NOTHING,
    arguments,
    make_lab,
    make_models,
    make_textures,
)
from tests.faults.machine import FAULTS, FILLER, FULL, INTERRUPT, MEMORY, SIZE, Ended, in_full_tmpfs, run_with

PAGE = ROOT / "docs" / "reference" / "disk-faults-and-interrupts.md"
COLUMNS = (*FAULTS, SIZE, FULL, INTERRUPT)
SAME_PATH = ("write error",)
"""What only has another number than a full disk: driven when the page is written."""
ALWAYS = ("disk full", INTERRUPT)
"""What every command is tested with."""
INSTANTS = 6
"""Interrupts of a command are raised at so many of its changes, spread over all of them, the last one included."""
FREE = (0, 16_384)
"""Bytes that a full file system in memory has left, in turn."""
BESIDE = ("-wal", "-shm", "-journal", ".lock")
"""What SQLite and locks keep beside a database."""
REFUSAL = re.compile(r"^(Error|Usage): ", re.MULTILINE)
STOP = re.compile("stopped|by SIGINT", re.IGNORECASE)
GROWS = {
    **dict.fromkeys(("run", "record", "resume", "collect", "textures simulate"), (".sqlite",)),
    "regenerate": ("lab/regenerated", "seconds.json"), "monitor": ("lab/.cache", "monitor.jsonl"),
    "train doors": ("door-perception.json", "door-perception.safetensors"), "textures find": ("sheet.png",),
    "textures index": (".jpg",), "participants withdraw": ("identities.sqlite",),
}  # fmt: skip
"""What keeps every finished step, by command: sessions, the collected database, the record of times."""
SHORTEST = 0.9
"""A whole file is at least so long, measured by the same file after a run without a fault: times stand in many."""
REFUSED, STOPPED, UNTOUCHED, DONE = "message, 2", "stopped, 130", "not met", "done"

Tree = dict[str, bytes | None]


HEAD = """\
# What a command does when the machine fails

Written by `python -m tests.faults.matrix`; a test runs part of it again, with a third of the interrupts, and compares:
commands that write to a database with all faults but the write error, others with three of the seven columns, and those
that compute long with a full disk and one interrupt. Every command that writes is run in a lab with data,
and the kernel refuses its system calls (a seccomp filter): every write answers "no space left" or "input/output
error", every sync answers "input/output error", every opening to write and every renaming answers "read-only file
system"; or no file may grow beyond 512 bytes. A full tmpfs is a real one: the lab lies on a file system in memory with
nothing, and then with 16 KiB, left. An interrupt (Ctrl-C) comes before up to six of the changes that the command makes
to files, spread over all of them, the last renaming included.

- **message, 2**: one sentence on the standard error, exit code 2; every file is as it was, and none is left over.
- **stopped, 130**: the word `stopped` or `interrupted`, exit code 130; every file is as it was, or all of them are new.
  The last of the instants may come when all is done already.
- **done**: the interrupt came after the last change. **not met**: the command needs nothing of the kind.

What is finished stays: `run` keeps every event that was on the disk before the fault, `collect` every session,
`regenerate` its record of how long each number took, `monitor` its cache of finished sessions. `record` and `resume`
are as `run`; `train doors` keeps the first of its two models, `textures find` its sheet, `textures index` the small
pictures, `textures simulate` the lab that it began. `participants withdraw` erases the identity first, and the same
command does the rest. What trains or evaluates is driven after its trainings, which are kept: it goes on from there."""


@dataclass(frozen=True)
class Outcome:
    """The verdict on a command under a fault, and its problems."""

    command: str
    fault: str
    verdict: str
    problems: tuple[str, ...]


def tree_of(folder: Path) -> Tree:
    """Return the contents of every file, and None for every folder; a database by its rows."""
    tree: Tree = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.name.endswith(BESIDE) or ".locks" in path.parts:
            continue
        tree[name] = None if path.is_dir() else _rows(path) if path.suffix == ".sqlite" else path.read_bytes()
    return tree


def _rows(path: Path) -> bytes:
    """Return a database as SQL, read from a copy: opening it folds the -wal file in. Raises sqlite3.DatabaseError."""
    with TemporaryDirectory() as place:
        for file in path.parent.glob(f"{path.name}*"):
            shutil.copy(file, place)
        with closing(sqlite3.connect(Path(place, path.name))) as connection:
            return "\n".join(connection.iterdump()).encode()


def outcomes(faults: Mapping[str, Sequence[str]], instants: Callable[[str], int]) -> Iterator[Outcome]:
    """Drive every command with its faults, each in a fresh copy of one working directory.

    An interrupt is raised at so many instants of a command at most.
    """
    models = [name for name in faults if name in MODELS]
    textures = [name for name in faults if name in {*TEXTURES, *MODELS}]
    others = [name for name in faults if name not in textures]
    for driven, makes in ((others, [make_lab]), (textures, [make_textures, partial(make_models, names=models)])):
        if driven:
            with TemporaryDirectory(dir=MEMORY if Path(MEMORY).is_dir() else None) as place:
                yield from _outcomes_in(Path(place), makes, {name: faults[name] for name in driven}, instants)


def _outcomes_in(
    place: Path, makes: Sequence[Callable[[Path], None]], faults: Mapping[str, Sequence[str]],
    instants: Callable[[str], int],
) -> Iterator[Outcome]:  # fmt: skip
    base = place / "base"
    base.mkdir()
    built = run_with(None, place, partial(_make, makes, base))  # in a child, so that this process starts no threads
    if built.code != 0:
        raise AssertionError(built.err)
    _import(built.modules)
    before = tree_of(base)
    for name, faults_of_it in faults.items():
        whole = _drive(name, None, base, place / "whole")
        if whole[0].code != 0:
            yield Outcome(name, "none", f"exit {whole[0].code}", (whole[0].err.strip()[-400:] or "failed",))
            continue
        _import(whole[0].modules)
        for fault in faults_of_it:
            turns = _spread(whole[0].changes, instants(name)) if fault == INTERRUPT else FREE if fault == FULL else [0]
            of_turns = [
                _outcome_of(name, fault, _drive(name, fault, base, place / "case", turn), before, whole[1])
                for turn in turns
            ]
            verdicts = dict.fromkeys(outcome.verdict for outcome in of_turns)
            if STOPPED in verdicts:  # the last instant may fall before or after the end, as signals come
                verdicts.pop(DONE, None)
            if REFUSED in verdicts and fault == FULL:  # what is small may fit
                verdicts.pop(UNTOUCHED, None)
            yield Outcome(
                name, fault, " or ".join(verdicts), tuple(p for outcome in of_turns for p in outcome.problems)
            )


def _make(makes: Sequence[Callable[[Path], None]], base: Path) -> int:
    for make in makes:
        make(base)
    return 0


def _import(names: Sequence[str]) -> None:
    """Import what a command had imported, once for all the children that run it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in names:
            with suppress(Exception):
                import_module(name)


def _spread(count: int, most: int) -> list[int]:
    """At most so many of the numbers from 1 to `count`, evenly, with the first and the last; of one, the middle."""
    if count <= most:
        return list(range(1, count + 1))
    if most == 1:
        return [(count + 1) // 2]
    return sorted({1 + round(k * (count - 1) / (most - 1)) for k in range(most)})


def _drive(name: str, fault: str | None, base: Path, place: Path, turn: int = 0) -> tuple[Ended, Tree]:
    """Run a command in a copy; `turn` is the instant of an interrupt, or the bytes left on a full file system."""
    act = partial(_run_in, name, fault, place, turn)
    try:
        if fault == FULL:
            return in_full_tmpfs(place, base, turn, act)
        shutil.copytree(base, place)
        return act()
    finally:
        shutil.rmtree(place)


def _run_in(name: str, fault: str | None, place: Path, turn: int) -> tuple[Ended, Tree]:
    ended = run_with(fault, place, partial(command_line._status, arguments(name)), turn)
    (place / FILLER).unlink(missing_ok=True)
    return ended, tree_of(place)


def _outcome_of(name: str, fault: str, after: tuple[Ended, Tree], before: Tree, whole: Tree) -> Outcome:
    """Compare a case with what is expected: a message, exit 2 or 130, old files whole, nothing left over."""
    ended, tree = after
    problems = []
    if "Traceback" in ended.err:
        problems.append("a traceback: " + ended.err.strip().splitlines()[-1])
    if left := [path for path in tree if UNFINISHED in path or path.endswith(".part")]:
        problems.append(f"left over: {left[0]}")
    changed, grows = _changed(before, tree), GROWS.get(name, ())
    is_done = set(changed) == set(_changed(before, whole))
    verdict = f"exit {ended.code}"
    if ended.code == 0 and is_done:
        verdict = DONE if fault == INTERRUPT else UNTOUCHED
    elif fault == INTERRUPT and ended.code == 130 and STOP.search(ended.out + ended.err):
        verdict = STOPPED
    elif fault != INTERRUPT and ended.code == 2 and REFUSAL.search(ended.err):
        verdict = REFUSED
    else:
        problems.append(f"{verdict}: {ended.err.strip()[-200:]}")
    others = [path for path in changed if not path.endswith(grows)]
    if others and (verdict == REFUSED or not is_done) and not _is_started(name, changed):
        problems.append(f"{verdict}, and changed: {', '.join(others[:3])}")
    short = [path for path in others if len(tree.get(path) or b"") < SHORTEST * len(whole.get(path) or b"")]
    problems += [f"cut short: {path}" for path in short]
    return Outcome(name, fault, verdict, tuple(f"{name}, {fault}: {problem}" for problem in problems))


def _changed(before: Tree, after: Tree) -> list[str]:
    """The files that were changed, removed or made."""
    return [path for path in {**before, **after} if after.get(path, b"gone") != before.get(path, b"not there")]


def _is_started(name: str, changed: Sequence[str]) -> bool:
    """Return whether it is a new lab, of which every whole file stays."""
    return name == "textures simulate" and all(path.startswith("new") for path in changed)


def row(name: str, results: Sequence[Outcome]) -> str:
    """Return the row of a command in the matrix."""
    by_fault = {outcome.fault: outcome.verdict for outcome in results if outcome.command == name}
    return f"| `{name}` | {' | '.join(by_fault.get(fault, '') for fault in COLUMNS)} |"


def cells(line: str) -> dict[str, str]:
    """Return what a row of the matrix says, by fault."""
    return dict(zip(COLUMNS, (cell.strip() for cell in line.strip("|").split("|")[1:]), strict=True))


def page(rows: Sequence[str]) -> str:
    """Return the matrix as a page of the documentation."""
    lines = [
        *HEAD.splitlines(), "", f"| command | {' | '.join(COLUMNS)} |", "|---|" + "---|" * len(COLUMNS), *rows,
        "", "Not driven:", "", *(f"- `{name}`: {why}" for name, why in LEFT_OUT.items()), "",
        f"These write nothing: {', '.join(f'`{name}`' for name in WRITES_NOTHING)}.", "",
    ]  # fmt: skip
    return "\n".join(lines)


if __name__ == "__main__":
    all_outcomes = []
    for outcome in outcomes(dict.fromkeys(sys.argv[1:] or DRIVEN, COLUMNS), lambda _name: INSTANTS):
        all_outcomes.append(outcome)
        sys.stderr.write(f"{outcome.command}: {outcome.fault}: {outcome.verdict} {' / '.join(outcome.problems)}\n")
    if not sys.argv[1:]:
        PAGE.write_text(page([row(name, all_outcomes) for name in DRIVEN]), encoding="utf-8")
