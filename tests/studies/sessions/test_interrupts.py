import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.studies.sessions.interrupts import Guard, Interrupted, guarded, interrupt_behind
from palpate.studies.sessions.record import read

ROOT = Path(__file__).resolve().parents[3]
SESSION = """
import sys, threading
from pathlib import Path
from dataclasses import replace
from palpate.studies.sessions.rig import Rig
from palpate.studies.sessions.session import start
from tests.studies.labs import Lab

where = sys.argv[2]

def wait():
    print("waiting", flush=True)
    threading.Event().wait(2 if where == "opening" else 60)

class Waits:
    '''Nobody answers: the world blocks in the fourth act, as a window would.'''
    def __init__(self, rig):
        self.rig, self.acts = rig, 0
    def now(self):
        return self.rig.world.now()
    def perform(self, request):
        self.acts += 1
        if self.acts == 4 and where == "act":
            wait()
        if self.acts == 4 and where == "stubborn driver":
            try:
                wait()
            except Exception:
                pass
        return self.rig.world.perform(request)

lab = Lab(Path(sys.argv[1]))
def opened(plan, t_ns):
    rig = lab.rig.open(plan, t_ns)
    if where == "opening":
        wait()
    print("opened", flush=True)
    return Rig(Waits(rig), lambda: print("safe", flush=True))
print(start(lab.path, lab.plan(), replace(lab.rig, open=opened)).reason, flush=True)
"""


def run_until_waiting(folder, where):
    """Start a session in a process of its own; return it, and its lines, once it waits."""
    command = [sys.executable, "-c", SESSION, str(folder), where]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    lines = []
    while (line := process.stdout.readline().strip()) != "waiting":
        assert line, "the session ended before it waited"
        lines.append(line)
    return process, lines


@pytest.mark.parametrize(
    ("where", "name"),
    [("act", "SIGINT"), ("act", "SIGTERM"), ("act", "SIGHUP"), ("opening", "SIGINT"), ("stubborn driver", "SIGINT")],
)
def test_one_signal_ends_a_session_safely_wherever_it_finds_it(tmp_path, where, name):
    process, lines = run_until_waiting(tmp_path, where)
    process.send_signal(signal.Signals[name])
    rest, _ = process.communicate(timeout=30)
    assert [*lines, *rest.splitlines()] == ["opened", "safe", f"interrupted by {name}"]
    assert process.returncode == 0
    record = read(tmp_path / "sessions" / "toy_P001_s1.sqlite")
    assert record.run_notes[-1].value["because"] == f"interrupted by {name}"


def test_a_storm_of_signals_ends_a_session_safely(tmp_path):
    process, first_lines = run_until_waiting(tmp_path, "act")
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP) * 30:
        if process.poll() is None:
            process.send_signal(number)
    rest, _ = process.communicate(timeout=30)
    lines = [*first_lines, *rest.splitlines()]
    assert lines[:2] == ["opened", "safe"] and lines[2].startswith("interrupted by SIG")
    assert read(tmp_path / "sessions" / "toy_P001_s1.sqlite").run_notes[-1].kind == "closed"


def test_an_error_that_an_interrupt_brought_about_is_taken_for_it():
    with pytest.raises(RuntimeError) as failed:
        try:
            raise Interrupted("SIGINT")
        finally:
            raise RuntimeError("release unlocked lock")
    assert str(interrupt_behind(failed.value)) == "SIGINT"
    assert interrupt_behind(RuntimeError("its own")) is None


def listening() -> Guard:
    guard = Guard()
    guard.listen()
    return guard


def test_a_signal_does_not_split_a_write():
    guard, written = listening(), []
    with pytest.raises(Interrupted, match="SIGTERM"), guard.shield():
        guard.on_signal(signal.SIGTERM, None)
        written.append("all of it")
    assert written == ["all of it"]


def test_a_signal_outside_a_write_ends_the_session_at_once():
    with pytest.raises(Interrupted, match="SIGINT"):
        listening().on_signal(signal.SIGINT, None)


def test_a_signal_before_the_session_stands_is_held_until_it_does():
    guard = Guard()
    guard.on_signal(signal.SIGINT, None)
    with pytest.raises(Interrupted):
        guard.listen()


def test_further_signals_do_not_disturb_the_end():
    guard = listening()
    with pytest.raises(Interrupted):
        guard.on_signal(signal.SIGINT, None)
    guard.over = True
    guard.on_signal(signal.SIGINT, None)
    with guard.shield():
        guard.on_signal(signal.SIGTERM, None)


def test_a_signal_that_was_swallowed_can_be_repeated():
    guard = listening()
    for _ in range(2):
        with pytest.raises(Interrupted):
            guard.on_signal(signal.SIGINT, None)


def test_an_error_in_a_write_is_not_hidden_by_a_signal():
    guard = listening()
    with pytest.raises(ZeroDivisionError), guard.shield():
        guard.on_signal(signal.SIGINT, None)
        raise ZeroDivisionError
    assert guard.depth == 0


def test_handlers_are_put_back():
    before = signal.getsignal(signal.SIGINT)
    with guarded() as guard:
        guard.listen()
        with pytest.raises(Interrupted):
            os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before
