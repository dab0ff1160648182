"""Figures to reach for sessions and start-up: what an experimenter waits for."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any

from palpate.protocols.bench import Case
from palpate.protocols.canonical import canonical
from palpate.protocols.event_shapes import EventShapes
from palpate.protocols.events import NS, Event, Samples
from palpate.protocols.plan import Plan, compile_plan
from palpate.protocols.runner import run
from palpate.studies.catalogue import SHIPPED, read_study
from palpate.studies.participants.lab_forms import lab_forms
from palpate.studies.participants.row_assignment import allocate
from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.session import start
from palpate.studies.simulation.rig import simulated

DOORS = SHIPPED / "door_ratings"
HEAVY = ("numpy", "pandas", "scipy", "sqlalchemy", "torch", "psychopy", "matplotlib")
LOADED = "import sys; sys.argv[1:] = {arguments}; from palpate import command_line\n" + (
    "try: command_line.main()\nexcept SystemExit: pass\n"
    "import sys; print(sum(name in sys.modules for name in {heavy}), file=sys.stderr)"
)


def sessions(quick: bool) -> Iterator[Case]:
    """Yield the cases of one session of 45 trials x 7 ratings: run durably, run in memory only, and replayed."""
    repeats = 3 if quick else 9
    plan = _plan()
    rig = simulated(plan.study, DOORS)
    with tempfile.TemporaryDirectory() as folder:
        lab = Path(folder)
        path = start(lab, plan, rig).path
        record = read(path)
        size, virtual_s = len(record.events), record.events[-1].t_ns / NS
        input_name = f"45 trials x 7 ratings, {virtual_s:,.0f} virtual s"
        fresh = count(2)

        def case(
            name: str, method: str, error_kind: str, act: Callable[[], object], error: Callable[..., float]
        ) -> Case:
            return Case("sessions", name, method, input_name, size, error_kind, act, error, repeats)

        lost = "events lost if killed at the end"
        yield case(
            "a simulated session", "palpate, durable", lost,
            lambda: start(lab, plan, rig, next(fresh)).path, lambda path: float(size - len(read(path).events)),
        )  # fmt: skip
        yield case(
            "a simulated session", "in memory only", lost, lambda: _in_memory(plan), lambda events: float(len(events))
        )
        yield case(
            "replay of the session", "palpate, byte for byte", "events not repeated",
            lambda: replay(path), lambda replayed: float(size - replayed.events),
        )  # fmt: skip
        yield case(
            "reading a ledger",
            "palpate, chain verified",
            "events missing",
            lambda: read(path),
            lambda r: float(size - len(r.events)),
        )
        heavy = _with_samples(lab / "heavy.sqlite", record.events[0].value, 6 if quick else 60)
        yield Case(
            "sessions", "receipt of a session", "palpate, read back whole", f"{6 if quick else 60} MB of samples", size,
            "events missing", lambda: read(heavy), lambda r: float(7 if quick else 61) - len(r.events), 3,
        )  # fmt: skip
        yield case(
            "reading a ledger", "of this, the shapes of its events", "events not checked",
            lambda: _shapes_checked(record.events), lambda checked: float(size - checked),
        )  # fmt: skip


def startup(quick: bool) -> Iterator[Case]:
    """Yield the cases of the command line from the shell: a whole process each, beside an empty Python."""
    repeats = 5 if quick else 15
    yield _process("python -c pass", [sys.executable, "-c", "pass"], None, repeats)
    for arguments in (["--help"], ["run", "--help"], ["analyse", "--help"], ["studies"], ["check", "door_ratings"]):
        command = [sys.executable, "-m", "palpate", *arguments]
        yield _process(" ".join(["palpate", *arguments]), command, arguments, repeats)


def _process(name: str, command: list[str], arguments: list[str] | None, repeats: int) -> Case:
    return Case(
        "startup", "a process", name, "from the shell", 1, "heavy packages imported",
        lambda: subprocess.run(command, check=True, capture_output=True), lambda _done: _heavy(arguments), repeats,
    )  # fmt: skip


def _heavy(arguments: list[str] | None) -> float:
    """Return how many of the heavy packages the verb imports."""
    if arguments is None:
        return 0.0
    code = LOADED.format(arguments=arguments, heavy=HEAVY)
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return float(done.stderr.strip().splitlines()[-1])


def _plan() -> Plan:
    study = read_study(DOORS / "study.yaml").study
    return compile_plan(study, allocate(study, "P001"), 1, lab_forms(study, DOORS, live=False))


def _with_samples(path: Path, header: dict[str, Any], megabytes: int) -> Path:
    """Write a ledger of `megabytes` events, each with a sample block of 1 MB; return its path."""
    note = {"at": "2026-01-01T00:00:00+00:00"}
    create(path, header, note)
    ledger = open_for_append(path, note)
    for seq in range(1, megabytes + 1):
        block = Samples("force", ("N",), ("N",), 8000.0, seq, bytes([seq]) * 1_000_000)
        ledger.append(Event(seq, seq, "experimenter", canonical({"do": "note"}), samples=(block,)))
    ledger.close(note)
    return path


def _shapes_checked(events: Sequence[Event]) -> int:
    shapes = EventShapes()
    for event in events:
        shapes.take(event)
    return len(events)


@dataclass
class _Memory:
    """A log in memory only."""

    events: list[Event] = field(default_factory=list)

    def append(self, event: Event) -> None:
        self.events.append(event)


def _in_memory(plan: Plan) -> list[Event]:
    log = _Memory()
    run(plan, simulated(plan.study, DOORS).open(plan, 0).world, log, {})
    return log.events
