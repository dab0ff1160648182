"""The console at a real pseudo-terminal and at real pipes: keys, the page, and the terminal as it was before."""

from __future__ import annotations

import itertools
import os
import select
import subprocess
import sys
import termios
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest

from palpate.devices.desk import Prompt
from palpate.protocols.events import Aside
from palpate.studies.console.desk import open_desk
from palpate.studies.console.display import Plain, View
from palpate.studies.console.listening import Keys, Lines, Listener, Silence, listen
from palpate.studies.console.page import BETWEEN_PAGES_S, Painter
from palpate.studies.console.status import SessionStatus
from tests.studies.live.halls import sheets_plan

ROOT = Path(__file__).resolve().parents[3]
LONGEST_S = 20.0
ALT_ON, ALT_OFF, CURSOR_ON = b"\x1b[?1049h", b"\x1b[?1049l", b"\x1b[?25h"
PROGRAM = """
import sys, threading
from palpate.studies.console.desk import open_desk
from tests.studies.live.halls import sheets_plan
desk = open_desk(sheets_plan(), lambda: 0, sys.stdin, sys.stdout)
try:
    pause = threading.Event()
    while (aside := desk.poll()) is None:
        pause.wait(0.01)
    if aside.value["text"] == "fall over":
        raise RuntimeError("the session failed")
finally:
    desk.close()
print("LEFT", aside.value)
"""


@contextmanager
def terminal():
    """(master, slave) of a pseudo-terminal."""
    master, slave = os.openpty()
    try:
        yield master, slave
    finally:
        os.close(master)
        os.close(slave)


@contextmanager
def streams(slave):
    with os.fdopen(os.dup(slave), "r") as reader, os.fdopen(os.dup(slave), "w") as writer:
        yield reader, writer


def until(condition):
    """Wait, a bounded time, until it holds."""
    pause, tries = threading.Event(), int(LONGEST_S / 0.01)
    for _ in range(tries):
        if result := condition():
            return result
        pause.wait(0.01)
    raise AssertionError("waited in vain")


def read_until(fd, expected):
    """Everything that comes until the wanted bytes have come."""
    received = b""
    while expected not in received:
        assert select.select([fd], [], [], LONGEST_S)[0], received[-400:]
        received += os.read(fd, 65536)
    return received


def test_keys_come_one_by_one_and_the_terminal_is_as_it_was():
    with terminal() as (master, slave):
        before = termios.tcgetattr(slave)
        with streams(slave) as (reader, _):
            source = listen(reader)
            assert not source.by_line
            os.write(master, "n한\x1b[A\x1bq".encode())
            keys = []
            until(lambda: keys.extend(h.text for h in source.take()) or "q" in keys)
            during = termios.tcgetattr(slave)
            source.close()
            source.close()
        assert keys == ["n", "한", "\x1b", "q"], "an arrow is no key"
        assert not during[3] & (termios.ICANON | termios.ECHO) and during[3] & termios.ISIG
        assert not during[0] & termios.IXON
        assert termios.tcgetattr(slave) == before


def test_the_page_is_drawn_on_the_second_screen_and_the_first_is_given_back():
    with terminal() as (master, slave), streams(slave) as (reader, writer):
        desk = open_desk(sheets_plan(), lambda: 61_000_000_000, reader, writer)
        try:
            assert desk.poll() is None
            desk.demand(Prompt("Put in place: T07"))
            drawn = read_until(master, b"Put in place: T07")
        finally:
            desk.close()
        rest = read_until(master, ALT_OFF)
    shown = drawn + rest
    assert ALT_ON in drawn and b"Texture ratings" in shown and b"1:01 since the start" in shown
    assert CURSOR_ON in rest


def test_a_note_is_seen_as_it_is_typed_and_reaches_the_desk():
    with terminal() as (master, slave), streams(slave) as (reader, writer):
        desk = open_desk(sheets_plan(), lambda: 0, reader, writer)
        try:
            os.write(master, b"nthe fan")
            until(lambda: desk.poll() is None and desk.view.entry.text == "the fan")
            read_until(master, b"the fan")
            os.write(master, b" came on\r")
            aside = until(desk.poll)
        finally:
            desk.close()
    assert aside == Aside({"do": "note", "text": "the fan came on"})


@pytest.mark.parametrize(("note", "code"), [("all well", 0), ("fall over", 1)])
def test_the_terminal_is_restored_on_every_way_out(note, code):
    with terminal() as (master, slave):
        before = termios.tcgetattr(slave)
        program = subprocess.Popen(
            [sys.executable, "-c", PROGRAM], cwd=ROOT, stdin=slave, stdout=slave, stderr=subprocess.PIPE
        )
        seen = read_until(master, ALT_ON)
        os.write(master, f"n{note}\r".encode())
        seen += read_until(master, ALT_OFF)
        _, errors = program.communicate(timeout=LONGEST_S)
        assert program.returncode == code
        assert termios.tcgetattr(slave) == before
        assert (b"the session failed" in errors) == bool(code)


def test_lines_of_a_pipe_are_orders_and_events_are_written_as_lines():
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=ROOT, input="hlep\nnote all well", capture_output=True, text=True,
        timeout=LONGEST_S * 3, check=True,
    )  # fmt: skip
    assert done.stdout.splitlines()[0] == "0 of 4 trials done"
    assert "'hlep' is not an order" in done.stdout and "did you mean 'help'" in done.stdout.replace("help?", "'help'?")
    assert done.stdout.splitlines()[-1] == "LEFT {'do': 'note', 'text': 'all well'}"
    assert "\x1b" not in done.stdout


def test_the_end_of_a_pipe_ends_nothing():
    reading, writing = os.pipe()
    with os.fdopen(reading) as reader:
        source = listen(reader)
        os.close(writing)
        until(lambda: not source._thread.is_alive())
        assert source.take() == []
        source.close()


def test_without_an_input_there_are_no_keys():
    assert isinstance(listen(None), Silence) and listen(None).take() == []


def test_a_reader_that_has_gone_does_not_stop_the_session():
    reading, writing = os.pipe()
    writer = os.fdopen(writing, "w")
    plain = Plain(writer)
    os.close(reading)
    for number in range(100):
        plain.say(f"line {number}")
    plain.close()
    with pytest.raises(BrokenPipeError):
        writer.close()


def test_pages_are_drawn_no_more_than_four_times_a_second_and_only_on_change():
    with terminal() as (master, slave), streams(slave) as (_, writer):
        drain = threading.Thread(target=lambda: read_until(master, ALT_OFF), daemon=True)
        drain.start()
        moments = []
        painter = Painter(writer, lambda: 0)
        draw = painter._draw
        painter._draw = lambda view: (moments.append(painter.clock()), draw(view))
        try:
            status = SessionStatus(sheets_plan())
            for number in range(3000):
                painter.show(View(status, hint=str(number)))
                if number % 20 == 0:
                    until(lambda: not painter._changed.is_set())
            until(lambda: painter._written == (View(status).entry, "2999"))
        finally:
            painter.close()
            drain.join(LONGEST_S)
    gaps = [b - a for a, b in itertools.pairwise(moments)]
    assert moments and all(gap >= BETWEEN_PAGES_S for gap in gaps)


def test_bytes_become_keys_and_lines_wherever_they_are_cut():
    text = "né한\x1b[Bq\n".encode()
    for cut in range(len(text)):
        if text[cut - 1 : cut] == b"\x1b":
            continue  # an escape that comes alone is the key
        keys = Keys()
        assert [*keys.feed(text[:cut]), *keys.feed(text[cut:])] == ["n", "é", "한", "q", "\n"]
    lines = Lines()
    assert [*lines.feed("note é".encode()[:6]), *lines.feed("note é".encode()[6:] + b"\nquit"), *lines.end()] == [
        "note é", "quit",
    ]  # fmt: skip


def test_a_listener_is_closed_while_it_waits():
    reading, writing = os.pipe()
    restored = []
    listener = Listener(reading, by_line=True, restore=lambda: restored.append(True))
    listener.close()
    assert restored == [True] and not listener._thread.is_alive()
    os.close(reading)
    os.close(writing)
