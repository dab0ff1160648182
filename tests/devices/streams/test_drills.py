"""Fault drills with a real session, runner and ledger: whatever fails, the ledger stays whole and says what it was."""

import itertools
import resource
import subprocess
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from palpate.devices.device import Block, DeviceFault
from palpate.devices.streams.capture import Capture
from palpate.devices.streams.reader import NO_ROOM
from palpate.protocols.events import NS, Chunk, Reply
from palpate.protocols.plan import compile_plan
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.live.world import LiveWorld, Station
from palpate.studies.sessions.record import LedgerError, read
from palpate.studies.sessions.replay import replay
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session import resume, start
from tests.devices.streams.labs import Desk, Fed, Time, Window, block, fed_until, values

STREAM = "tool_acceleration"


def study(seconds):
    return Study.model_validate({
        "study": "drill", "task": "capture", "stimuli": [{"id": "T07", "columns": {}}], "needs": ["tool"],
        "capture": {"device": "tool", "seconds": seconds}, "order": {"design": "as_listed"},
    })  # fmt: skip


class HandedOver:
    def perform(self, request, window, desk, now_ns):
        return Reply({"presented": True})


@dataclass(frozen=True)
class Stop:
    """The program stands still: so long by its clock, so long suspended; so many samples are numbered meanwhile."""

    host_s: float = 0.0
    suspended_s: float = 0.0
    samples: int = 0


class Drill:
    """A lab whose one sensor gives 100 samples a turn of 0.1 s; `upset` turns give something else, by their number.

    `disk_s` is how long the disk takes over samples (a number, or one for each chunk): the sensor goes on meanwhile.
    """

    def __init__(self, folder, seconds=2.0, upset=None, disk_s=(), room_s=30.0, rows=100):
        self.folder, self.time, self.sensor = folder, Time(), Fed()
        self.plan = compile_plan(study(seconds), ParticipantRow("P001"))
        names = {("vibration", "acceleration"): STREAM}
        self.slept_ns, self.taken_ns = 0, {}
        self.capture = Capture({"vibration": self.sensor}, names, room_s=room_s, suspended_ns=lambda: self.slept_ns)
        self.desk, self.window = Desk(self.time), Window(self.turn)
        self.upset, self.disk_s, self.rows = dict(upset or {}), list(disk_s), rows
        self.turns, self.given, self.starts, self.last = 0, 0, 0, None
        self.path = folder / "sessions" / "drill_P001_s1.sqlite"

    def turn(self):
        self.time.pass_s(0.1)
        if self.sensor.log.count("start") != self.starts:
            self.starts, self.given = self.sensor.log.count("start"), 0
        if self.sensor.log[-1:] != ["start"]:
            return
        self.turns += 1
        what = self.upset.pop(self.turns, None)
        if isinstance(what, Stop):
            self.time.pass_s(what.host_s)
            self.slept_ns += round(what.suspended_s * NS)
            self.given, what = self.given + what.samples, None
        if isinstance(what, Exception):
            self.sensor.feed(what)
            fed_until(lambda: self.capture._last.fault() is not None)
        elif what != "silent":
            fed = what(self.given) if callable(what) else block(self.given, self.rows)
            self.sensor.feed(replace(fed, at_ns=self.time()))
            self.taken_ns[self.starts, self.given] = self.time() - (self.rows - 1) * NS // 1000
            self.given += self.rows

    def watch(self, event):
        if event.kind == "samples" and self.disk_s:
            for _ in range(round(10 * self.disk_s.pop(0))):
                self.turn()

    def rig(self):
        def opened(_plan, t_ns):
            self.time.t_ns = max(self.time.t_ns, t_ns)
            world = LiveWorld(self.window, self.desk, Station(HandedOver(), {"tool": self.capture}), self.time)
            return Rig(world, self.capture.close, self.watch)

        return RigPlan({"kind": "drill"}, lambda _plan: None, opened)

    def run(self):
        return start(self.folder, self.plan, self.rig())


def whole(path):
    """The ledger, verified link by link and replayed event by event."""
    record = read(path)
    assert record.lacks_wal is False
    replay(path)
    return record


def chunks_of(record, attempt=1):
    return [
        Chunk(event.value, event.samples)
        for event in record.events
        if event.kind == "samples" and event.attempt == attempt
    ]


def kinds(record):
    return [event.kind for event in record.events]


def test_a_recording_is_in_the_ledger_sample_by_sample(tmp_path):
    lab = Drill(tmp_path)
    assert lab.run().complete
    record = whole(lab.path)
    assert kinds(record)[4:-2] == ["request", "samples", "samples", "samples", "samples", "reply"]
    samples = values(chunks_of(record), STREAM)
    assert sorted(samples) == list(range(2000)) and all(row == (n, n, n) for n, row in samples.items())
    entries = [chunk.value["streams"][STREAM] for chunk in chunks_of(record)]
    assert [(block["first"], block["count"], block["lost"]) for block in entries] == [
        (n, 500, 0) for n in range(0, 2000, 500)
    ]


def test_a_disk_that_is_slow_costs_nothing_while_there_is_room(tmp_path):
    lab = Drill(tmp_path, seconds=10.0, disk_s=[2.0, 3.0, 1.0])
    assert lab.run().complete
    record = whole(lab.path)
    reply = next(event.value for event in record.events if event.kind == "reply" and "streams" in event.value)
    assert reply["streams"][STREAM]["lost"] == 0
    assert sorted(values(chunks_of(record), STREAM)) == list(range(reply["streams"][STREAM]["samples"]))


def test_a_disk_slower_than_the_sensor_loses_samples_and_every_one_is_reported(tmp_path):
    lab = Drill(tmp_path, seconds=30.0, disk_s=[0.0, 12.0, 12.0], room_s=1.0)
    assert lab.run().complete
    record = whole(lab.path)
    samples = values(chunks_of(record), STREAM)
    gaps = [gap for chunk in chunks_of(record) for gap in chunk.value["streams"][STREAM].get("gaps", [])]
    gone = [n for at, lost, _ in gaps for n in range(at, at + lost)]
    assert sorted([*samples, *gone]) == list(range(lab.given)) and len(gone) > 4000
    assert all(row == (n, n, n) for n, row in samples.items())
    assert {why for *_, why in gaps} == {NO_ROOM}
    reply = next(event.value for event in record.events if event.kind == "reply" and "streams" in event.value)
    assert reply["streams"][STREAM]["lost"] == len(gone) and reply["streams"][STREAM]["gaps"] == len(gaps)


def nan(first):
    return Block(first, np.full(300, np.nan, "<f4").tobytes(), 0)


@pytest.mark.parametrize(
    ("upset", "what", "message"),
    [
        ({8: DeviceFault("vibration", "overrun", "the buffer ran over")}, "overrun", "the buffer ran over"),
        ({8: OSError(19, "No such device")}, "link_lost", "no such device"),
        (dict.fromkeys(range(8, 19), "silent"), "silent", "acceleration: nothing for 1.1 s (limit 1 s)"),
        (dict.fromkeys(range(8, 23), nan), "not_a_number", f"{STREAM}: no numbers for 1.3 s (limit 1 s)"),
        ({8: lambda first: block(first - 50, 100)}, "firmware",
         f"{STREAM}: sample 650 came, 0 lost before it, where 700 was the next"),
    ],
    ids=["raises", "unplugged", "silent", "no numbers", "counts backwards"],
)  # fmt: skip
def test_a_sensor_that_fails_ends_safe_and_its_trial_is_repeated(tmp_path, upset, what, message):
    lab = Drill(tmp_path, seconds=3.0, upset=upset)
    assert lab.run().complete
    record = whole(lab.path)
    (fault,) = [event for event in record.events if event.kind == "fault"]
    assert (fault.value["what"], fault.value["device"], fault.attempt) == (what, "vibration", 1)
    assert fault.value["message"] == f"vibration: {message}"
    assert lab.sensor.log[:4] == ["expect None", "start", "stop", "safe"]
    ended = [event.value["as"] for event in record.events if event.kind == "trial_ended"]
    assert ended == ["faulted", "captured"]
    assert set(range(700)) <= set(values(chunks_of(record), STREAM))  # what came before stays on record
    assert sorted(values(chunks_of(record, 2), STREAM)) == list(range(3000))
    assert lab.desk.prompts == [f"{fault.value['message'].rstrip('.')}. Put it right, then confirm."]


HOUR = 3600.0
SUSPENDED = "the computer was suspended for 3600.0 s"


@pytest.mark.parametrize(
    ("stop", "device", "what", "message"),
    [
        (Stop(suspended_s=HOUR), "session", "interrupted", SUSPENDED),
        (Stop(suspended_s=HOUR, samples=3_600_000), "session", "interrupted", SUSPENDED),
        (Stop(host_s=HOUR), "vibration", "silent", f"{STREAM}: nothing for 3600.0 s, and its samples were numbered on"),
        (Stop(samples=3_600_000), "vibration", "firmware",
         f"{STREAM}: sample 3600700 came, 0 lost before it, where 700 was the next"),
    ],
    ids=["suspended", "suspended, sensor goes on", "program stood still", "numbering runs ahead"],
)  # fmt: skip
def test_an_hour_that_no_sample_shows_is_a_fault_and_no_sample_is_misplaced(tmp_path, stop, device, what, message):
    lab = Drill(tmp_path, seconds=3.0, upset={8: stop})
    assert lab.run().complete
    record = whole(lab.path)
    (fault,) = [event for event in record.events if event.kind == "fault"]
    assert (fault.value["device"], fault.value["what"], fault.attempt) == (device, what, 1)
    assert message in fault.value["message"]
    assert [event.value["as"] for event in record.events if event.kind == "trial_ended"] == ["faulted", "captured"]
    assert sorted(values(chunks_of(record, 2), STREAM)) == list(range(3000))
    pieces = [(event.attempt, piece) for event in record.events for piece in event.samples]
    assert all(piece.t0_ns == lab.taken_ns[attempt, piece.first] for attempt, piece in pieces)


@pytest.mark.parametrize("hours", [1, -1])
def test_a_wall_clock_that_is_set_meanwhile_changes_nothing(tmp_path, monkeypatch, hours):
    plain = Drill(tmp_path / "plain")
    assert plain.run().complete
    steps = (datetime(2026, 3, 1, 12, tzinfo=UTC) + timedelta(hours=hours * n) for n in itertools.count())
    monkeypatch.setattr("palpate.studies.sessions.session.wall_time", lambda: next(steps).isoformat())
    stepped = Drill(tmp_path / "stepped", seconds=2.0)
    assert stepped.run().complete
    record = whole(stepped.path)
    assert record.head == read(plain.path).head
    at = [datetime.fromisoformat(run.value["at"]) for run in record.run_notes]
    assert [after - before for before, after in itertools.pairwise(at)] == [timedelta(hours=hours)] * 2


@contextmanager
def tmpfs(folder, size_kB):
    """A real small disk, where this process may mount one; it is gone afterwards."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size_kB}k", "tmpfs", folder], check=True, capture_output=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", folder], check=True, capture_output=True)


@contextmanager
def no_file_larger(_folder, size_kB):
    """What stands in for a full disk where none can be mounted: no file may grow beyond so much."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_kB * 1024, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@contextmanager
def small_disk(folder, size_kB, kind):
    """The disk of that kind; a mounted one only where that is allowed, else its stand-in."""
    with ExitStack() as disk:
        try:
            disk.enter_context(tmpfs(folder, size_kB) if kind == "tmpfs" else no_file_larger(folder, size_kB))
        except (OSError, subprocess.CalledProcessError):
            disk.enter_context(no_file_larger(folder, size_kB))
        yield


@pytest.mark.parametrize("kind", ["tmpfs", "limited files"])
def test_a_disk_that_fills_up_ends_the_session_with_a_message_and_keeps_what_was_written(tmp_path, kind):
    """1 MB of disk, 12 kB of samples a turn: the ledger holds whole chunks up to the full disk, and no half one."""
    folder = tmp_path / "lab"
    folder.mkdir()
    with small_disk(folder, 1024, kind):
        spare = folder / "spare"
        spare.write_bytes(bytes(200_000))
        lab = Drill(folder, seconds=60.0, rows=1000)
        with pytest.raises(LedgerError, match=r"event \d+ could not be recorded: .*(full|disk I/O error)"):
            lab.run()
        assert lab.sensor.log[-1] == "stop" and not lab.capture._last.hanging()
        spare.unlink()
        recorded = read(lab.path)
        assert kinds(recorded)[4] == "request" and set(kinds(recorded)[5:]) == {"samples"} and len(recorded.events) > 6
        numbers = sorted(values(chunks_of(recorded), STREAM))
        assert numbers == list(range(len(numbers)))


def test_after_a_full_disk_the_session_goes_on_where_there_is_room(tmp_path):
    """A recording that was cut off does not count: its trial is repeated, and its samples stay on record."""
    folder = tmp_path / "lab"
    folder.mkdir()
    lab = Drill(folder, seconds=4.0, rows=2000)
    with no_file_larger(folder, 700), pytest.raises(LedgerError):
        lab.run()
    again = Drill(folder, seconds=4.0)
    again.time.t_ns = lab.time.t_ns
    assert resume(lab.path, again.rig()).complete
    record = whole(lab.path)
    ended = [event.value["as"] for event in record.events if event.kind == "trial_ended"]
    assert ended == ["faulted", "captured"]
    assert sorted(values(chunks_of(record, 2), STREAM)) == list(range(4000))
