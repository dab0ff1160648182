import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from studies.interrupts import Guard, Interrupted, guarded
from studies.record import read

ROOT = Path(__file__).resolve().parents[2]
BLOCKING = """
import sys, threading
from pathlib import Path
from dataclasses import replace
from protocols.requests import Ask
from tests.studies.labs import Lab, StopsAfter
from studies.session import start

class Waits:
    '''Nobody answers: the world blocks in the fourth act, as a window would.'''
    def __init__(self, rig):
        self.rig, self.acts = rig, 0
    def now(self):
        return self.rig.world.now()
    def perform(self, request):
        self.acts += 1
        if self.acts == 4:
            print("waiting", flush=True)
            threading.Event().wait(60)
        return self.rig.world.perform(request)

lab = Lab(Path(sys.argv[1]))
def rig_at(plan, t_ns):
    rig = lab.rig_at(plan, t_ns)
    return replace(rig, world=Waits(rig), safe=lambda: print("safe", flush=True))
print(start(lab.path, lab.plan(), rig_at).reason, flush=True)
"""


@pytest.mark.parametrize(("number", "name"), [(signal.SIGINT, "SIGINT"), (signal.SIGTERM, "SIGTERM")])
def test_one_signal_ends_a_blocked_session_safely(tmp_path, number, name):
    process = subprocess.Popen(
        [sys.executable, "-c", BLOCKING, str(tmp_path)], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "waiting\n"
    process.send_signal(number)
    rest, _ = process.communicate(timeout=30)
    assert rest.splitlines() == ["safe", f"interrupted by {name}"]
    assert process.returncode == 0
    record = read(tmp_path / "sessions" / "toy_P001_s1.sqlite")
    assert record.sittings[-1].value["because"] == f"interrupted by {name}"


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
    guard.on_signal(signal.SIGINT, None)
    with guard.shield():
        guard.on_signal(signal.SIGTERM, None)


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
