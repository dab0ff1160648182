"""The loop in a process of its own, so that a window or a session cannot delay it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.devices.device import DeviceFault, closed_on_failure
from palpate.devices.render.hands import Pushed
from palpate.devices.render.job import Ask, End, Job, Reports, Switch, Volume
from palpate.devices.render.loop import NEVER
from palpate.devices.render.opened import Playing, playing, sounding
from palpate.devices.render.priority import by_itself, in_front, undisturbed
from palpate.devices.render.trace import BYTES, Trace
from palpate.devices.tablet.reports import Report
from palpate.protocols.interrupts import uninterrupted
from palpate.signals.textures.sounds import RenderError, Sounds

READY_S, ANSWER_S, GONE_S = 60.0, 10.0, 5.0
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
STAT, SCHEDULED = Path("/proc/stat"), Path("/proc/thread-self/schedstat")
STEAL = 8
"""The field of the line `cpu`, counting its name, with the ticks that a hypervisor gave to others (proc(5))."""


class Rendering:
    """A job that runs in another process. Use it in a `with` block, from one thread.

    On entering, errors of opening are raised as RenderError.
    """

    def __init__(self, job: Job) -> None:
        """Take the job without starting anything."""
        self.job = job
        self._process: BaseProcess | None = None
        self._memory: SharedMemory | None = None
        self._talk: Connection | None = None
        self.trace = Trace.own()
        self._last: Mapping[str, Any] = {}

    def __enter__(self) -> Rendering:
        spawn = multiprocessing.get_context("spawn")
        self._memory = SharedMemory(create=True, size=BYTES)
        self.trace.memory = over(self._memory)
        self.trace.memory[:] = 0.0
        self._talk, theirs = spawn.Pipe()
        self._process = spawn.Process(target=_serve, args=(self.job, self._memory.name, theirs), daemon=True)
        with closed_on_failure(self.__exit__):
            with _one_thread(), uninterrupted():
                self._process.start()
            theirs.close()
            self._answer(READY_S)
        return self

    def __exit__(self, *_raised: object) -> None:
        if self._process is not None:
            if self._process.is_alive():
                with suppress(RenderError, OSError):
                    self._send_request(End())
            if self._process.pid is not None:
                self._process.join(GONE_S)
            if self._process.is_alive():
                self._process.kill()
                self._process.join()
            if self._talk is not None:
                self._talk.close()
                self._talk = None
        self.trace.memory = self.trace.memory.copy()
        if self._memory is not None:
            self._memory.close()
            self._memory.unlink()
        self._process = self._memory = None

    @property
    def running(self) -> bool:
        """Return whether it is still playing."""
        return self._process is not None and self._process.is_alive()

    def switch(self, sounds: Sounds | None) -> None:
        """Change to another texture, or to silence. Raises RenderError if its model cannot be played."""
        self._send_request(Switch(sounds))

    def volume(self, gain: float) -> None:
        """Set the volume, from 0 to 1, where 1 is as recorded."""
        self._send(Volume(gain))

    def push(self, reports: Sequence[Report]) -> None:
        """Send the stylus' newest reports, timed in seconds since the job's `epoch_s`."""
        self._send(Reports(tuple(reports)))

    def record(self) -> Mapping[str, Any]:
        """Return the record so far as JSON data, or the last one after the end. Raises RenderError if it failed."""
        if self.running:
            with suppress(RenderError):
                self._send(Ask())
            return self._answer(ANSWER_S)
        if self._talk is not None and self._talk.poll():
            self._answer(0.0)
        return self._last

    def wait(self, timeout_s: float) -> Mapping[str, Any]:
        """Return the record once a job of limited length has ended.

        Raises RenderError if it failed or takes longer.
        """
        return self._answer(timeout_s)

    def _send_request(self, what: object) -> None:
        self._send(what)
        self._answer(ANSWER_S)

    def _send(self, what: object) -> None:
        if self._talk is None:
            raise RenderError("the renderer is not running")
        try:
            self._talk.send(what)
        except OSError:
            raise RenderError("the renderer has ended") from None

    def _answer(self, timeout_s: float) -> Mapping[str, Any]:
        talk = self._talk
        try:
            if talk is None or not talk.poll(timeout_s):
                raise RenderError(f"the renderer did not answer within {timeout_s:g} s")
            answer = talk.recv()
        except (EOFError, OSError):
            # Of a process that has ended well, return what it sent last.
            if self._process is not None:
                self._process.join(GONE_S)
                if self._process.exitcode == 0 and self._last:
                    return self._last
            code = None if self._process is None else self._process.exitcode
            how = f"by signal {-code}" if code and code < 0 else "unasked"
            raise RenderError(f"the renderer's process ended {how}") from None
        if isinstance(answer, str):
            raise RenderError(answer)
        self._last = answer or self._last
        return self._last


@contextmanager
def _one_thread() -> Iterator[None]:
    """Make processes that are started within the block compute with one thread."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _serve(job: Job, memory: str, talk: Connection) -> None:
    """Run the other process: open, report that, play until an `End` arrives; a thread beside the loop answers
    requests.
    """
    by_itself()
    try:
        shared, trace = SharedMemory(name=memory), Trace.own()
    except FileNotFoundError:
        return  # whoever began this has gone meanwhile
    trace.memory = over(shared)
    try:
        with playing(job, trace) as work:
            talk.send({})
            _play(job, work, talk)
    except (ValueError, OSError, DeviceFault) as error:
        with suppress(OSError):
            talk.send(str(error))
    except Exception as error:
        with suppress(OSError):
            talk.send(f"the renderer failed, which it never should: {type(error).__name__}: {error}.")
        raise
    finally:
        trace.memory = Trace.own().memory
        shared.close()


def _play(job: Job, work: Playing, talk: Connection) -> None:
    ending = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_args: ending.set())
    with undisturbed():
        work.facts.update(in_front(job.real_time))
        # After that: a listener of lower priority would, while it holds the interpreter, be held up with the loop.
        threading.Thread(target=_listen, args=(work, talk, ending), daemon=True).start()
        before = outside()
        work.loop.run(NEVER if job.seconds is None else round(job.seconds * 1000), ending.is_set)
        work.facts["outside"] = outside().since(before)
    work.sink.coil.rest()
    with suppress(OSError):
        talk.send(work.record())


def _listen(work: Playing, talk: Connection, ending: threading.Event) -> None:
    """Handle requests, and end when the requesting process ends."""
    while not ending.is_set():
        try:
            request = talk.recv()
        except (EOFError, OSError):
            break
        _obey(request, work, talk, ending)
    ending.set()


def _obey(request: object, work: Playing, talk: Connection, ending: threading.Event) -> None:
    if isinstance(request, Reports):
        if isinstance(work.hand, Pushed):
            for report in request.reports:
                work.hand.push(report)
    elif isinstance(request, Volume):
        work.renderer.volume(request.gain)
    elif isinstance(request, Switch):
        try:
            work.renderer.switch(sounding(request.sounds))
            talk.send({})
        except ValueError as error:
            talk.send(str(error))
    elif isinstance(request, Ask):
        talk.send(work.record())
    else:
        ending.set()


def over(shared: SharedMemory) -> NDArray[np.float64]:
    """Return the trace's array in shared memory; release it before that is closed."""
    if shared.buf is None:
        raise RenderError("the trace's memory is gone")
    return np.frombuffer(shared.buf, dtype=np.float64, count=BYTES // 8)


@dataclass(frozen=True)
class Outside:
    """Time in seconds that other processes took, since the machine was started; None if the system does not report it.

    `stolen_s` covers all processors, in ticks of usually 10 ms; `waited_s` the calling thread: it could have run but
    was not scheduled.
    """

    stolen_s: float | None
    waited_s: float | None

    def since(self, before: Outside) -> dict[str, float | None]:
        """Return the increase since `before`, as it is recorded."""
        return {
            "stolen_s": _less(self.stolen_s, before.stolen_s), "waited_s": _less(self.waited_s, before.waited_s),
        }  # fmt: skip


def outside(stat: Path = STAT, scheduled: Path = SCHEDULED) -> Outside:
    """Return the figures so far, for the calling thread."""
    stolen = waited = None
    with suppress(OSError, ValueError, IndexError, AttributeError):
        stolen = int(stat.read_text(encoding="ascii").split(maxsplit=STEAL + 1)[STEAL]) / os.sysconf("SC_CLK_TCK")
    with suppress(OSError, ValueError, IndexError):
        waited = int(scheduled.read_text(encoding="ascii").split()[1]) * 1e-9
    return Outside(stolen, waited)


def _less(after: float | None, before: float | None) -> float | None:
    return None if after is None or before is None else round(after - before, 4)
