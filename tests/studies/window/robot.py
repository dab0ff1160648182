"""A participant made of X events and an experimenter made of lines, at a real session in a process of its own.

The robot keeps a mirror of the participant's screen: the same state machine, fed with the same inputs. It sees by the
mirror where to press, waits until the display shows what the mirror paints, and knows what must be recorded.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageChops

from benchmarks.window.hand import Hand
from palpate.devices.window.build import page_for, screen_for
from palpate.devices.window.calibration import read_calibration
from palpate.devices.window.inputs import Key, Moved, Pressed, Released, Typed
from palpate.devices.window.presenter_page import prepare
from palpate.devices.window.screens.base import DOUBLE_CLICK_S
from palpate.protocols.events import Ask, Choose, Confirm, Instruct, Present, Rest, Sense, Show
from palpate.protocols.runner import EndOfRecord, Recorded, run
from palpate.studies.sessions.record import LedgerError, read
from palpate.studies.sessions.replay import recompiled
from palpate.studies.stimuli.made_doors import made_doors

PATIENCE_S = 60.0
UNSTAMPED_S = 1.0
"""A ledger whose files look unchanged is read again after so long all the same: two changes may have one time."""
READ_S = 2 * DOUBLE_CLICK_S
LEADING = ("agree", "next", "continue")
MOVED = {"slider 0": (0.25, 0.9), "slider 2": (0.4, 0.95)}
"""The lines that are moved while a door is felt, from and to a share of their length."""
STEPS, OPENED_DEG = 30, 15.0
"""A line is moved in so many steps; each line once the door is open by so much more than for the one before."""


class PendingRequest(Exception):
    """The record ends while this request is being performed."""


class Tape(Recorded):
    """A record that says which request waits at its end."""

    def perform(self, request):
        if self.position == len(self.events):
            raise PendingRequest(request)
        return super().perform(request)


def pending(record):
    """The request that a running session is performing, or None where it is between acts or over."""
    tape = Tape(record.events)
    try:
        run(recompiled(record), tape, tape, record.header)
    except PendingRequest as pending_request:
        return pending_request.args[0]
    except EndOfRecord:
        pass
    return None


def stamp_of(ledger):
    """What changes with the ledger's files, or None where there is none: to read and replay it takes longer."""
    files = [path for path in (ledger, Path(f"{ledger}-wal")) if path.exists()]
    return [(stat.st_size, stat.st_mtime_ns) for stat in map(Path.stat, files)] or None


@contextmanager
def until(what):
    """Give up by name after a while."""
    deadline = time.monotonic() + PATIENCE_S

    def late():
        if time.monotonic() > deadline:
            raise AssertionError(f"waited in vain until {what}")
        time.sleep(0.03)

    yield late


@dataclass
class RunningSession:
    """`palpate run` or `palpate resume` in a process of its own, on a virtual display."""

    display: str
    lab: Path
    ledger: Path
    arguments: list[str]
    process: subprocess.Popen = field(init=False)

    def __post_init__(self):
        self.console_file = self.lab / "console.txt"
        environment = {**os.environ, "DISPLAY": self.display, "PYTHONUNBUFFERED": "1"}
        with self.console_file.open("ab") as out:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "palpate", *self.arguments], stdin=subprocess.PIPE, stdout=out, stderr=out,
                env=environment, cwd=Path(__file__).resolve().parents[3],
            )  # fmt: skip

    def order(self, line):
        self.process.stdin.write(f"{line}\n".encode())
        self.process.stdin.flush()

    def record(self, seen=-1):
        """The ledger, once it holds more than `seen` events and the session waits for somebody, or is over."""
        with until(f"the ledger goes on after event {seen}; output: {self.output()}") as late:
            stamp, read_at = None, 0.0
            while True:
                last, stamp = stamp, stamp_of(self.ledger)
                if stamp is not None and (stamp != last or time.monotonic() > read_at + UNSTAMPED_S):
                    read_at = time.monotonic()
                    try:
                        record = read(self.ledger)
                    except LedgerError:
                        record = None
                    if record is not None and len(record.events) > seen and (record.ended or pending(record)):
                        return record
                assert self.process.poll() is None, self.output()
                late()

    def output(self):
        return self.console_file.read_text(errors="replace")[-2000:] if self.console_file.exists() else ""

    def end(self, status):
        self.process.stdin.close()
        assert self.process.wait(PATIENCE_S) == status, self.output()

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()


@dataclass
class Robot:
    """Does what the session asks for, until the test stops it; `answers` are its answers by form."""

    hand: Hand
    session: RunningSession
    folder: Path
    language: str = "en"
    keys_only: bool = False
    shots: dict[str, Image.Image] = field(default_factory=dict)
    given: list = field(default_factory=list)
    page: object = None
    felt_in: int = 0
    """How many requests there were by the one whose door was felt last: its samples go on arriving."""
    curves: set = field(default_factory=set)
    """The different pictures that were seen where the force is drawn, while lines were moved."""

    def go_on(self, stop, seen=-1):
        """Perform request after request until `stop(request, record)` says so, or the session is over.

        Of a resumed session so many events were `seen` before.
        """
        while True:
            record = self.session.record(seen)
            if record.ended:
                return record
            request, seen = pending(record), len(record.events)
            if stop(request, record):
                return record
            self.perform(request, record)

    def perform(self, request, record):
        match request:
            case Confirm():
                self.session.order("127" if request.text is None else "confirm")
            case Present() if "samples" in recompiled(record).study.needs:
                self.session.order("confirm")
            case Present() if request.live_form is not None:
                if self.felt_in != (requests := [event.kind for event in record.events].count("request")):
                    self.felt_in = requests
                    self.feel(request, self.page_of(record))
            case Present() | Sense() | Show() | Choose():
                pass
            case Ask() | Instruct() | Rest():
                self.answer(request, self.page_of(record))

    def answer(self, request, page):
        """Go through the screen as a participant would, in step with its mirror."""
        mirror = screen_for(request, page, 0)
        picture = Image.new("RGB", (page.metrics.width_px, page.metrics.height_px))
        name = request.form.name if isinstance(request, Ask) else request.body()["do"]
        self._see(mirror, picture, name)
        done, acts = set(), 0
        settled = isinstance(request, Ask) and request.former is not None
        while mirror.reply is None:
            acts += 1
            assert acts < 400, f"{name}: cannot be finished; left: {[p.name for p in mirror.placed()]}"
            target = next_target(mirror, done, settled)
            self._use(mirror, target, acts * READ_S)
            if target.name in LEADING and mirror.reply is None:
                done.clear()
                self._see(mirror, picture, name)
        self.given.append((name, mirror.reply.value))

    def feel(self, request, page):
        """Move lines that stay on while the door is felt, and stop the door."""
        mirror = self.move_lines(request, page)
        self.opened(len(MOVED) * OPENED_DEG)
        self._use(mirror, next(placed for placed in mirror.placed() if placed.name == "stop"), READ_S)
        self.given.append(("felt", mirror.reply.value))

    def move_lines(self, request, page):
        """Move lines that stay on, each once the door is opened further than for the one before; the mirror."""
        mirror = screen_for(request, page, 0)
        picture = Image.new("RGB", (page.metrics.width_px, page.metrics.height_px))
        self._see(mirror, picture, "felt")
        boxes = {placed.name: placed.box for placed in mirror.placed()}
        for number, (name, shares) in enumerate(MOVED.items()):
            self.opened(number * OPENED_DEG)
            self._drag(mirror, boxes[name], shares, boxes["force"])
        self._see(mirror, picture, "moved")
        return mirror

    def opened(self, angle_deg):
        """Wait until the door has been opened so far while it is felt."""
        with until(f"the door is open by {angle_deg} degrees; output: {self.session.output()}") as late:
            while opened_deg(read(self.session.ledger)) < angle_deg:
                assert self.session.process.poll() is None, self.session.output()
                late()

    def _drag(self, mirror, line, shares, drawn):
        """Press on a line at the first share of it, and go to the other step by step."""
        start, end = (line.left + share * (line.width - 1) for share in shares)
        places = [round(start + (end - start) * step / STEPS) for step in range(STEPS + 1)]
        y = line.middle[1]
        self.hand.move(places[0], y)
        self.hand.press()
        mirror.handle(Pressed(places[0], y, 0.0))
        with until("the line is moved") as late:
            for x in places[1:]:
                late()
                self.hand.move(x, y)
                mirror.handle(Moved(x, y, 0.0))
                self.curves.add(self.hand.picture(drawn.left, drawn.top, drawn.width, drawn.height).tobytes())
        self.hand.release()
        mirror.handle(Released(places[-1], y, 0.0))

    def _use(self, mirror, target, at_s):
        x, y = place_of(target)
        if target.name == "agree":
            self._read()
        self.hand.click(x, y)
        mirror.handle(Pressed(x, y, at_s))
        mirror.handle(Released(x, y, at_s))
        for text in written(target.name):
            self.hand.type(text)
            for character in text:
                mirror.handle(Typed(character, at_s))
            if target.name == "words":
                self.hand.key("enter")
                mirror.handle(Key("enter", False, at_s))

    def _read(self):
        """Look at what is to be agreed to for as long as it takes a hasty person: no double click counts."""
        from_s = time.monotonic()
        with until("the text is read") as late:
            while time.monotonic() < from_s + READ_S:
                late()

    def _see(self, mirror, picture, name):
        """Wait until the display shows what the mirror paints: every pixel, but for the rounding of colours."""
        mirror.paint(picture)
        with until(f"{name} is on the screen; output: {self.session.output()}") as late:
            while True:
                shot = self.hand.picture()
                if shot.size == picture.size and largest_difference(shot, picture) <= 2:
                    self.shots.setdefault(name, shot)
                    return
                assert self.session.process.poll() is None, self.session.output()
                late()

    def page_of(self, record):
        if self.page is None:
            plan = recompiled(record)
            self.page = prepare(plan.study, read_calibration(self.session.lab), self.language, self.folder, plan=plan)
            if plan.study.live is not None and plan.study.live.show_force:
                self.page = replace(self.page, force_of=made_doors(self.session.lab).doors.force_N)
        return self.page


def opened_deg(record):
    """How far the door of the last presentation has been opened by now."""
    request_seq = max(n for n, event in enumerate(record.events) if event.kind == "request")
    blocks = [
        block for event in record.events[request_seq:] for block in event.samples if block.stream == "door_telemetry"
    ]
    return max((np.frombuffer(block.data, "<f4")[:: len(block.channels)].max() for block in blocks), default=0.0)


def next_target(mirror, done, settled=False):
    """What a participant would press next: whatever is not answered yet, then what leads on; if settled only that.

    Asked whether they can take part, they can.
    """
    unfit = {f"question {n} option {int(one.answer == 'yes')}" for n, one in enumerate(getattr(mirror, "criteria", ()))}
    targets = [placed for placed in mirror.placed() if placed.kind == "target" and placed.name not in unfit]
    for target in targets if not settled else ():
        group = " ".join(target.name.split()[:2])
        if target.name in (*LEADING, "back", "decline", "try", "rest") or group in done or "." in group:
            continue
        done.add(group)
        if not group.startswith("word ") or int(group.split()[1]) % 9 == 2:
            return target
    by_name = {target.name: target for target in targets}
    if "try" in by_name and not settled:
        return by_name["try"]
    return next(by_name[name] for name in LEADING if name in by_name)


def place_of(target):
    """Where in a target to press: along a line or a row of points by its number, else in the middle."""
    box = target.box
    x, y = box.middle
    kind, _, number = target.name.partition(" ")
    if kind in ("slider", "item") and number.isdigit():
        x = round(box.left + box.width * (0.25 + 0.08 * (int(number) % 7)))
    return x, y


def written(name):
    """What is typed into a field, line by line."""
    if name.endswith(" field"):
        return ["31"]
    return {"words": ["smooth", "round"], "further": ["dry"]}.get(name, [])


def largest_difference(one, other):
    return max(high for _, high in ImageChops.difference(one, other).getextrema())


__all__ = ["Key", "Robot", "RunningSession", "page_for", "pending", "until"]
