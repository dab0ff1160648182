"""Power loss at any instant: nothing that was acknowledged is lost; what is left opens, verifies and is resumed."""

import os
import random
import shutil
import signal
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from sqlalchemy import event, select

import palpate.studies.sessions.ledger
import palpate.studies.sessions.session
from palpate import command_line
from palpate.protocols.files import staged_files, staged_folder, write_text
from palpate.studies.participants import schema
from palpate.studies.participants.allocations import allocations_of
from palpate.studies.participants.identities import identities, store
from palpate.studies.participants.registry import find_registry, gone, reading
from palpate.studies.sessions.ledger import Ledger
from palpate.studies.sessions.record import read
from palpate.studies.sessions.session import resume, start
from palpate.studies.sessions.session_files import ledger_path
from tests.faults.disk import Disk, Mark, Names, Truncate, record
from tests.faults.machine import MEMORY
from tests.studies.sessions import nursery
from tests.studies.sessions.test_kill import timeless

pytestmark = pytest.mark.needs("seccomp")
PLAN = nursery.the_plan({"1": {"car": ["BC3"]}, "2": {"car": ["K3"]}})
RIG = nursery.the_rig()
SESSION_CUTS, PEOPLE_CUTS, FILE_CUTS = {False: 20, True: 80}, {False: 10, True: 40}, {False: 100, True: 200}
"""By whether it is the full run; those of a session in each of two tests."""
OVER = "over"


@pytest.fixture
def memory(tmp_path):
    """A folder in memory, where a real sync costs nothing."""
    with TemporaryDirectory(dir=MEMORY if Path(MEMORY).is_dir() else tmp_path) as folder:
        yield Path(folder)


def cuts(recording, count, seed, place):
    """(folder, marks) of what is left after cuts at random steps, half of them around those that change names."""
    chance, steps = random.Random(seed), recording.steps
    narrow = [k for k, step in enumerate(steps) if isinstance(step, Names | Truncate)]
    near = [chance.choice(narrow) + chance.randint(-2, 6) for _ in range(count // 2)]
    anywhere = [chance.randint(0, len(steps)) for _ in range(count - len(near))]
    disk, done, marks = Disk(recording), 0, []
    for cut in sorted(min(max(k, 0), len(steps)) for k in near + anywhere):
        for step in steps[done:cut]:
            disk.do(step)
            marks += [step.text] if isinstance(step, Mark) else []
        done, left = cut, place / "left"
        disk.after_cut(chance).write_to(left)
        yield left, marks
        shutil.rmtree(left)


def acknowledging(mark):
    """In a child: mark each event once it is appended, for then the runner goes on."""
    append, create = Ledger.append, palpate.studies.sessions.session.create

    def marked(act, name):
        def acted(*args):
            act(*args)
            mark(name(*args))

        return acted

    Ledger.append = marked(append, lambda _ledger, happened: str(happened.seq))
    palpate.studies.sessions.session.create = marked(create, lambda *_: "0")


def fate(lab, acknowledged, over, whole):
    """Check what a cut left of a session, and go on with it; say where the cut found it."""
    path = ledger_path(lab, "door_ratings", "P001")
    if not path.exists():
        assert acknowledged < 0
        assert start(lab, PLAN, RIG).complete
        assert timeless(read(path)) == whole
        return "before it began"
    left = read(path)
    assert timeless(left) == whole[: len(left.events)]
    assert len(left.events) > acknowledged and not left.lacks_wal
    if over or left.complete:
        assert left.complete
        return "after it ended"
    assert resume(path, RIG).complete
    assert timeless(read(path)) == whole
    return "in the middle" if len(left.events) > 1 else "at its beginning"


def test_no_acknowledged_event_is_lost_and_the_session_goes_on(memory, full_run):
    whole = timeless(read(start(memory / "whole", PLAN, RIG).path))

    def session(mark):
        acknowledging(mark)
        start(memory / "lab", PLAN, RIG)
        mark(OVER)

    (memory / "lab").mkdir()
    recording = record(memory / "lab", session)
    fates = Counter(
        fate(left, max((int(m) for m in marks if m != OVER), default=-1), OVER in marks, whole)
        for left, marks in cuts(recording, SESSION_CUTS[full_run], 1, memory)
    )
    assert min(fates["before it began"], fates["in the middle"], fates["after it ended"]) >= 1, fates


def test_a_killed_session_that_is_resumed_survives_a_cut_with_its_log_and_its_checkpoints(memory, full_run):
    whole = timeless(read(start(memory / "whole", PLAN, RIG).path))
    lab, at = memory / "lab", len(whole) // 3
    lab.mkdir()
    path = ledger_path(lab, "door_ratings", "P001")
    if (child := os.fork()) == 0:
        append = Ledger.append
        Ledger.append = lambda ledger, it: os.kill(os.getpid(), signal.SIGKILL) if it.seq == at else append(ledger, it)
        start(lab, PLAN, RIG)
    os.waitpid(child, 0)
    assert len(read(path).events) == at

    def session(mark):
        acknowledging(mark)
        make = palpate.studies.sessions.ledger.engine_to_write

        def with_small_log(path):
            engine = make(path)
            event.listen(engine, "connect", lambda connection, _: connection.execute("PRAGMA wal_autocheckpoint=20"))
            return engine

        palpate.studies.sessions.ledger.engine_to_write = with_small_log
        resume(path, RIG)
        mark(OVER)

    recording = record(lab, session)
    for left, marks in cuts(recording, SESSION_CUTS[full_run], 2, memory):
        acknowledged = max((int(m) for m in marks if m != OVER), default=at - 1)
        fate(left, acknowledged, OVER in marks, whole)


COMMANDS = (
    ("init", "lab"),
    ("participants", "add", "--pseudonym", "P001", "--name", "Kim Erased", "--lab", "lab"),
    ("participants", "add", "--pseudonym", "P002", "--name", "Lee", "--lab", "lab"),
    ("participants", "allocate", "door_ratings", "P002", "--group", "2", "--row", "3", "--lab", "lab"),
    ("participants", "identify", "P002", "--contact", "lee@example.org", "--lab", "lab"),
    ("participants", "withdraw", "P001", "--why", "asked", "--lab", "lab"),
    ("participants", "add", "--pseudonym", "P003", "--name", "Park", "--lab", "lab"),
)


def test_what_is_known_of_people_survives_a_cut_and_who_withdrew_stays_erased(memory, full_run, capfd):
    place = memory / "place"
    place.mkdir()

    def commands(mark):
        os.chdir(place)
        for number, words in enumerate(COMMANDS):
            if command_line._status(list(words)) != 0:
                raise AssertionError(words)
            mark(str(number))

    recording = record(place, commands)
    capfd.readouterr()
    for left, marks in cuts(recording, PEOPLE_CUTS[full_run], 3, memory):
        demand_people(left / "lab", len(marks))


def demand_people(lab, done):
    """Check the lab after so many of the commands."""
    if done >= 1:
        assert {path.name for path in lab.iterdir()} >= {"participants.json", "consent.md", "sessions", "studies"}
    registry = find_registry(lab)
    known, withdrawn, rows = set(), set(), []
    if registry is not None:
        with reading(registry) as connection:
            known = set(connection.execute(select(schema.participants.c.participant)).scalars())
            withdrawn, rows = gone(connection), allocations_of(connection, "door_ratings")
    people = identities(lab)
    assert known >= set(["P001", "P002", "P003"][: [0, 0, 1, 2, 2, 2, 2, 3][done]])
    assert done < 2 or people.keys() >= {"P001"} or done >= 5
    assert done < 3 or people["P002"].name == "Lee"
    assert done < 4 or [(row.participant, row.group, row.row) for row in rows] == [("P002", "2", 3)]
    assert done < 5 or people["P002"].contact == "lee@example.org"
    if done >= 6:
        assert withdrawn == {"P001"} and "P001" not in people
        assert all(b"Kim Erased" not in path.read_bytes() for path in store(lab).parent.iterdir())
    assert done < 7 or people["P003"].name == "Park"


def test_a_written_file_is_the_old_or_the_new_one_and_the_new_one_once_it_is_written(memory, full_run):
    place = memory / "place"
    write_text(place / "a.txt", "old" * 1000)
    for name in ("b.txt", "c.txt", "index.txt"):
        write_text(place / "set" / name, "old")

    def writing(mark):
        write_text(place / "a.txt", "new" * 1000)
        mark("a")
        write_text(place / "deep" / "er" / "d.txt", "new")
        mark("d")
        with staged_files(place / "set", last=["index.txt"], obsolete=["c.txt"]) as draft:
            for name in ("b.txt", "in/e.txt", "index.txt"):
                write_text(draft / name, "new")
        mark("set")
        with staged_folder(place / "whole") as draft:
            for name in ("f.txt", "in/g.txt"):
                write_text(draft / name, "new")
        mark("whole")

    recording = record(place, writing)
    for left, marks in cuts(recording, FILE_CUTS[full_run], 4, memory):
        held = {
            path.relative_to(left).as_posix(): path.read_text()
            for path in left.rglob("*.txt") if ".unfinished" not in str(path)
        }  # fmt: skip
        assert held.pop("a.txt") in ({"new" * 1000} if "a" in marks else {"old" * 1000, "new" * 1000})
        assert held.pop("deep/er/d.txt", "none") in ({"new"} if "d" in marks else {"new", "none"})
        whole = {name: held.pop(name) for name in ("whole/f.txt", "whole/in/g.txt") if name in held}
        assert len(whole) == 2 or (not whole and "whole" not in marks)
        new = {"set/b.txt": "new", "set/in/e.txt": "new", "set/index.txt": "new"}
        if "set" in marks or held["set/index.txt"] == "new":
            assert held == new
        assert {*held.values(), *whole.values()} <= {"old", "new"}
