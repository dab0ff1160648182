"""An outlet of the Lab Streaming Layer in a process of its own, in a session that no other test or lab can meet."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import uuid
from pathlib import Path

import pytest

CONFIG = """
[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
[lab]
SessionID = {session}
[log]
level = -3
"""
OUTLET = Path(__file__).with_name("outlet.py")


class Outlet:
    """Streams that a second process offers; it does one thing at a time and says when it is done."""

    def __init__(self, *streams):
        self.process = subprocess.Popen(
            [sys.executable, str(OUTLET)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        )
        self.ask(offer=streams)

    def ask(self, **what):
        self.process.stdin.write(json.dumps(what) + "\n")
        answer = json.loads(self.process.stdout.readline())
        assert answer.get("done"), answer
        return answer

    def push(self, rows, times_s, stream=0):
        self.ask(push=rows, times_s=times_s, stream=stream)

    def kill(self):
        self.process.kill()
        self.close()

    def close(self):
        self.process.stdin.close()
        self.process.wait(timeout=20)
        self.process.stdout.close()


@pytest.fixture(scope="session")
def pylsl(tmp_path_factory):
    """The library, set to stay on this machine in a session of its own; it reads the setting once, when loaded."""
    config = tmp_path_factory.mktemp("lsl") / "lsl_api.cfg"
    config.write_text(CONFIG.format(session=f"palpate-{uuid.uuid4().hex}"))
    os.environ["LSLAPICFG"] = str(config)
    import pylsl as library

    yield library
    del os.environ["LSLAPICFG"]


@pytest.fixture
def offered(pylsl):
    """Start outlets with these streams; all are gone after the test."""
    there = []

    def offer(*streams):
        there.append(Outlet(*streams))
        return there[-1]

    yield offer
    for one in there:
        if one.process.returncode is None:
            one.close()
