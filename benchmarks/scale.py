"""Figures to reach for a growing lab: the cost of each verb on 20, 200 and 2,000 sessions of 50 trials."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sqlalchemy import delete

from palpate.protocols.bench import Case
from palpate.protocols.tables import table_text
from palpate.studies.catalogue import SHIPPED, stimulus_rows
from palpate.studies.collecting.collect import Collector, of_a_session, open_database
from palpate.studies.collecting.schema import metadata
from palpate.studies.sessions.session_files import ledgers_in
from palpate.studies.workers import available_cores

SIZES = (20, 200, 2000)
MOST_REGENERATED = 500
MEASURED = """
import sys
from benchmarks.memory import peak_bytes
from palpate.command_line import main
try:
    main(sys.argv[1:])
except SystemExit:
    print(peak_bytes())
    raise
"""
"""A program that runs a palpate command and prints its peak memory in bytes at its end, without that of its workers."""
STUDY = "scale_doors"
CARS = ("BC3", "FORD", "G90", "K3", "K8")
VARIANTS = tuple(f"g{number}" for number in range(10))
DEFINITION = """study: scale_doors
task: slider_rating
opening: [consent, demographics]
stimuli: stimuli.csv
instructions: Open the door fully, in one natural motion, and rate how it felt.
attributes:
  - {low: Easy-to-pull, high: Hard-to-pull, category: physical}
  - {low: Damped, high: Recoiling, category: physical}
  - {low: Luxurious, high: Cheap, category: emotional}
scale: {from: -10, to: 10, step: 1}
order: {design: williams}
navigation: back_and_forward
needs: [door, window]
analysis: {within: [car, variant], pooled: variant, families: augmentation}
simulation:
  latents:
    Easy-to-pull: {mean_force_N: 1.6, first_peak_N: 2.0}
    Damped: {drop_N: 1.6, first_peak_N: 0.8}
    Luxurious: {roughness_N: 1.0, intercept: 0.5}
  lapse_rate: 0.01
  revise_rate: 0.01
  present_s: 3.0
"""
PLAN = """study: scale_doors
missing: listwise
tests:
  - {name: means, test: means, by: [variant], interval: cousineau_morey}
  - {name: cells, test: anova, within: [car, variant]}
  - {name: augmentations, test: pairs, factor: augmentation, correction: holm}
  - {name: trends, test: trends, families: augmentation, pooled: variant}
  - {name: agreement, test: icc, targets: stimulus, raters: participant}
  - {name: raters, test: raters}
figures:
  - {name: means, figure: means, by: [variant], families: augmentation}
  - {name: participants, figure: rating_heatmap, outcomes: [Easy-to-pull]}
  - {name: order, figure: order_effect}
"""


def cache_folder() -> Path:
    """Return the folder where the bench keeps its labs between runs: XDG_CACHE_HOME/palpate, or ~/.cache/palpate."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "palpate" / "bench_scale"


def make_lab(sessions: int, folder: Path | None = None) -> Path:
    """Return a lab of this many simulated sessions, made once by `palpate run --simulate` and cached.

    A lab with fewer sessions, as an interrupted run leaves it, is completed.
    """
    lab = (folder or cache_folder()) / f"lab_{sessions}"
    _write_study(lab / "studies" / STUDY)
    missing = [number for number in range(1, sessions + 1) if not (lab / "sessions" / _name(number)).exists()]
    simulate = ("-m", "palpate", "run", STUDY, "--simulate", "--seed", "1", "--lab", str(lab), "--participant")
    cores = available_cores()
    with ThreadPoolExecutor(cores) as pool:
        people = (f"P{first:04d}..P{last:04d}" for first, last in _runs(missing, -(-len(missing) // cores)))
        list(pool.map(partial(run_verb, *simulate), people))
    if len(ledgers_in(lab)) != sessions:
        raise ValueError(f"{lab}: {len(ledgers_in(lab))} sessions, {sessions} are expected; remove the folder")
    return lab


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of each verb on labs of 20, 200 and 2,000 sessions, in its own process: time and memory."""
    sizes = SIZES[:2] if quick else SIZES
    largest = make_lab(sizes[-1])
    for sessions in sizes:
        with tempfile.TemporaryDirectory() as folder:
            yield from _cases_of(sessions, _copy(largest, Path(folder) / "lab", sessions))


def _cases_of(sessions: int, lab: Path) -> Iterator[Case]:
    place, input_name = str(lab), f"{sessions} sessions of 50 trials"

    def case(name: str, method: str, kind: str, act: Callable[[], Cost], error: Callable[[], float]) -> Case:
        return Case(
            "scale", name, method, input_name, sessions, kind, act, lambda _cost: error(),
            seconds=lambda cost: cost.seconds, peak_MB=lambda cost: cost.peak_MB,
        )  # fmt: skip

    differ = "rows that differ from a rebuild"
    collect = ("collect", "--lab", place)
    yield case("collect", "the first time", differ, lambda: timed(*collect), lambda: rows_that_differ(lab))
    yield case("collect", "nothing new", differ, lambda: timed(*collect), lambda: rows_that_differ(lab))
    yield case("collect", "one new session", differ, lambda: _with_one_new(lab), lambda: rows_that_differ(lab))
    yield case(
        "collect", "every chain (--verify)", differ, lambda: timed(*collect, "--verify"), lambda: rows_that_differ(lab)
    )
    not_repeated = "sessions that are not repeated"
    for workers in (1, 2):
        method = f"{workers} process{'es' if workers > 1 else ''}"
        replay = ("replay", "--lab", place, "--workers", str(workers), "--json")
        yield Case(
            "scale", "replay", method, input_name, sessions, not_repeated, partial(timed, *replay, check=False),
            lambda cost: float(sessions - sum(row["ok"] for row in json.loads(cost.printed))),
            seconds=lambda cost: cost.seconds, peak_MB=lambda cost: cost.peak_MB,
        )  # fmt: skip
    yield _first_page(lab, input_name, sessions)
    page = ("monitor", "--lab", place, "--once", str(lab / "monitor.html"))
    not_on_page = "sessions that are not on the page"
    for method in ("never watched", "watched before"):
        yield case("monitor, a whole page", method, not_on_page, lambda: timed(*page), lambda: _missing_on_page(lab))
    yield _update(lab, input_name, sessions)
    sessions_missing = "sessions missing"
    to = str(lab / "exported")
    export = ("export", STUDY, "--lab", place, "--to", to, "--csv", "--replace")
    yield case("export", "as CSV", sessions_missing, lambda: timed(*export), lambda: float(sessions - _lines(Path(to))))
    some = ("regenerate", STUDY, "--lab", place)
    if sessions > MOST_REGENERATED:
        lab = _copy(lab, lab.parent / "some", MOST_REGENERATED)
        some, input_name = ("regenerate", STUDY, "--lab", str(lab)), f"{MOST_REGENERATED} sessions of 50 trials"
    files = "files that differ at a second run"
    check = (*some, "--check")
    yield case("regenerate", "tables, figures, report", files, lambda: timed(*some), lambda: float(_fails(*check)))


def _first_page(lab: Path, input_name: str, sessions: int) -> Case:
    """Return the browser's wait for a lab without cached results: its sessions, or how many remain to be read."""
    from palpate.analysis.monitoring.app import BUDGET_S
    from palpate.analysis.monitoring.finished import FILE
    from palpate.analysis.monitoring.page import Pages
    from palpate.analysis.monitoring.watching import Snapshot, Watch

    snapshots: list[Snapshot] = []

    def first() -> Cost:
        start = time.perf_counter()
        snapshots.append(Watch(lab).look(BUDGET_S))
        Pages().live(snapshots[-1], "nonce")
        return Cost(time.perf_counter() - start, 0.0)

    def silent(_cost: Cost) -> float:
        shutil.rmtree(lab / FILE.parent, ignore_errors=True)  # the cache of this look: the next one starts without
        return float(sessions - len(snapshots[-1].sessions) - snapshots[-1].unread)

    return Case(
        "scale", "monitor, first page", "never watched", input_name, sessions, "sessions neither shown nor announced",
        first, silent, seconds=lambda cost: cost.seconds,
    )  # fmt: skip


def _update(lab: Path, input_name: str, sessions: int) -> Case:
    """Return the browser's wait on an open page when a session ends."""
    from palpate.analysis.monitoring.page import Pages
    from palpate.analysis.monitoring.watching import Watch

    watch, pages = Watch(lab), Pages()
    pages.fragment(watch.look())

    def update() -> Cost:
        (lab / "sessions" / _name(sessions)).touch()
        start = time.perf_counter()
        pages.fragment(watch.look())
        return Cost(time.perf_counter() - start, 0.0)

    return Case(
        "scale", "monitor, an update", "one ledger changed", input_name, sessions, "sessions that are not on the page",
        update, lambda _cost: float(sessions - len(watch.look().sessions)), seconds=lambda cost: cost.seconds,
    )  # fmt: skip


@dataclass(frozen=True)
class Cost:
    """The cost of a process: seconds from its start to its end, and its peak memory (10^6 bytes).

    `printed` is what the command wrote to its standard output.
    """

    seconds: float
    peak_MB: float
    printed: str = ""


def timed(*arguments: str, check: bool = True) -> Cost:
    """Run a palpate command in a process of its own. Raises CalledProcessError where it fails and `check` is set."""
    start = time.perf_counter()
    *printed, peak_bytes = run_verb("-c", MEASURED, *arguments, check=check).splitlines()
    return Cost(time.perf_counter() - start, int(peak_bytes) / 1e6, "\n".join(printed))


def run_verb(*arguments: str, check: bool = True) -> str:
    """Run Python with these arguments and return what it printed."""
    return subprocess.run([sys.executable, *arguments], check=check, capture_output=True, text=True).stdout


def rows_that_differ(lab: Path) -> float:
    """Return how many rows of the lab's database differ from a database that is rebuilt from its ledgers."""
    anew = lab / "anew.sqlite"
    if not anew.exists():
        engine = open_database(f"sqlite:///{anew}")
        list(Collector(engine).bring_all(ledgers_in(lab)))
        engine.dispose()
    with closing(sqlite3.connect(lab / "lab.sqlite")) as connection:
        connection.execute("ATTACH ? AS anew", (str(anew),))
        return float(sum(_differ(connection, name) for name in metadata.tables))


def _differ(connection: sqlite3.Connection, table: str) -> int:
    one, other = f'SELECT * FROM main."{table}"', f'SELECT * FROM anew."{table}"'
    counts = (
        connection.execute(f"SELECT count(*) FROM ({a} EXCEPT {b})").fetchone()[0]
        for a, b in ((one, other), (other, one))
    )
    return int(sum(counts))


def _with_one_new(lab: Path) -> Cost:
    """Remove the last session from the database, so that its ledger is new, and return the cost of collecting it."""
    session = f"{STUDY}/{ledgers_in(lab)[-1].name.split('_')[-2]}/1"
    engine = open_database(f"sqlite:///{lab / 'lab.sqlite'}")
    with engine.begin() as connection:
        for table in of_a_session():
            connection.execute(delete(table).where(table.c.session == session))
    engine.dispose()
    return timed("collect", "--lab", str(lab))


def _missing_on_page(lab: Path) -> float:
    page = (lab / "monitor.html").read_text(encoding="utf-8")
    return float(len(ledgers_in(lab)) - page.count('<tr id="session-'))


def _lines(folder: Path) -> int:
    return len((folder / "sessions.csv").read_text(encoding="utf-8").splitlines()) - 1


def _fails(*arguments: str) -> bool:
    try:
        timed(*arguments)
    except subprocess.CalledProcessError:
        return True
    return False


def _copy(lab: Path, copy: Path, sessions: int | None = None) -> Path:
    """Copy a lab with only its first ledgers if `sessions` is given, as hard links where the disk supports them."""
    shutil.copytree(lab / "studies", copy / "studies")
    (copy / "sessions").mkdir(parents=True)
    for ledger in ledgers_in(lab)[:sessions]:
        try:
            os.link(ledger, copy / "sessions" / ledger.name)
        except OSError:
            shutil.copy2(ledger, copy / "sessions" / ledger.name)
    return copy


def _runs(numbers: Sequence[int], longest: int) -> Iterator[tuple[int, int]]:
    """Yield first and last of each run of consecutive numbers, cut where it would be longer than `longest`."""
    first = 0
    for place, number in enumerate(numbers):
        if place + 1 == len(numbers) or numbers[place + 1] != number + 1 or place + 1 - first == longest:
            yield numbers[first], number
            first = place + 1


def _name(number: int) -> str:
    return f"{STUDY}_P{number:04d}_s1.sqlite"


def _write_study(folder: Path) -> None:
    """Write a study of fifty of the shipped doors: five cars in ten variants."""
    source = SHIPPED / "door_ratings"
    (folder / "profiles").mkdir(parents=True, exist_ok=True)
    rows = [row for row in stimulus_rows(source / "stimuli.csv") if row["car"] in CARS and row["variant"] in VARIANTS]
    for row in rows:
        shutil.copyfile(source / row["file"], folder / row["file"])
    text = table_text(rows[0].cells, (row.cells.values() for row in rows))
    (folder / "stimuli.csv").write_text(text, encoding="utf-8", newline="")
    (folder / "study.yaml").write_text(DEFINITION, encoding="utf-8")
    (folder / "analysis.yaml").write_text(PLAN, encoding="utf-8")
