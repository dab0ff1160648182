"""Protect the loop from delays by the garbage collector, other threads, other processes and the disk."""

from __future__ import annotations

import ctypes
import gc
import os
import platform
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress

FIFO = 20
SWITCH_S = 0.0002
"""How long another thread of this process may hold the interpreter: a hundredth of the buffer."""
MCL_CURRENT_AND_FUTURE = 3
PR_SET_TIMERSLACK = 29
SLICE_NS = 100_000
"""The shortest slice of the fair scheduler: a thread that requests it runs soon after it wakes."""
SLICE_CALLS = {"x86_64": (314, 315), "aarch64": (274, 275)}
"""The kernel's numbers of sched_setattr and sched_getattr, for which C libraries have no names."""


@contextmanager
def undisturbed() -> Iterator[None]:
    """Disable the garbage collector and shorten other threads' time slices; restore both afterwards."""
    collected, switched = gc.isenabled(), sys.getswitchinterval()
    gc.collect()
    gc.freeze()
    gc.disable()
    sys.setswitchinterval(SWITCH_S)
    try:
        yield
    finally:
        sys.setswitchinterval(switched)
        gc.unfreeze()
        if collected:
            gc.enable()


def in_front(real_time: bool) -> Mapping[str, str]:
    """Give the calling thread the highest priority allowed; return in words what was allowed.

    Only for a process that does nothing else.
    """
    allowed = {"priority": "real-time (SCHED_FIFO)" if real_time and _fifo() else "normal"}
    if real_time and allowed["priority"] == "normal":
        allowed["priority"] = (
            "normal: real-time priority is not allowed here (CAP_SYS_NICE or an rtprio limit is needed)"
        )
    if sys.platform == "linux":
        if not allowed["priority"].startswith("real-time"):
            allowed["slices"] = f"{SLICE_NS // 1000} us" if _short_slices() else "the system's usual ones"
        allowed["memory"] = "locked" if real_time and _locked() else "not locked"
        # A sleep ends when it should, and not up to 50 us later so as to save power.
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0)
    return allowed


def by_itself() -> None:
    """Make this process a session of its own, before any thread is started.

    If Linux shares the processor between sessions (autogroup), the loop has a share of its own, whatever else was
    started from the same terminal. Ctrl-C or the end of a terminal do not stop the loop either: the parent gets them,
    and ends it silently.
    """
    with suppress(OSError, AttributeError):
        os.setsid()


class _Attributes(ctypes.Structure):
    """The kernel's struct sched_attr."""

    _fields_ = (
        ("size", ctypes.c_uint32), ("policy", ctypes.c_uint32), ("flags", ctypes.c_uint64), ("nice", ctypes.c_int32),
        ("priority", ctypes.c_uint32), ("runtime", ctypes.c_uint64), ("deadline", ctypes.c_uint64),
        ("period", ctypes.c_uint64),
    )  # fmt: skip


def _short_slices() -> bool:
    """Request short time slices; return whether the scheduler granted them: Linux 6.12 or later, normal priority."""
    size, numbers = ctypes.sizeof(_Attributes), SLICE_CALLS.get(platform.machine())
    if numbers is None or os.sched_getscheduler(0) != os.SCHED_OTHER:
        return False
    ask, look = (ctypes.c_long(number) for number in numbers)
    attributes = _Attributes(size=size, nice=os.getpriority(os.PRIO_PROCESS, 0), runtime=SLICE_NS)
    got, none = _Attributes(), ctypes.c_uint(0)
    with suppress(OSError, AttributeError):
        call = ctypes.CDLL(None).syscall
        refused = call(ask, 0, ctypes.byref(attributes), none) or call(
            look, 0, ctypes.byref(got), ctypes.c_uint(size), none
        )
        return not refused and int(got.runtime) == SLICE_NS
    return False


def _fifo() -> bool:
    if sys.platform != "linux":
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO))
    except OSError:
        return False
    return True


def _locked() -> bool:
    """Lock the pages in memory; return whether that is allowed."""
    with suppress(OSError, AttributeError):
        return bool(ctypes.CDLL(None, use_errno=True).mlockall(MCL_CURRENT_AND_FUTURE) == 0)
    return False
