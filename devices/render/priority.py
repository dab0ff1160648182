"""Keeping everything else out of the loop: the garbage collector, other threads, other processes, the disk."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress

FIFO = 20
SWITCH_S = 0.0002
"""How long another thread of this process may hold the interpreter: a hundredth of the buffer."""
MCL_CURRENT_AND_FUTURE = 3
PR_SET_TIMERSLACK = 29


@contextmanager
def undisturbed() -> Iterator[None]:
    """No garbage is collected meanwhile, and other threads give way soon; both are as before afterwards."""
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
    """Bring the calling thread to the front, of a process that does nothing else; what was allowed, in words."""
    told = {"priority": "real-time (SCHED_FIFO)" if real_time and _fifo() else "normal"}
    if real_time and told["priority"] == "normal":
        told["priority"] = "normal: real-time priority is not allowed here (CAP_SYS_NICE or an rtprio limit is needed)"
    if sys.platform == "linux":
        told["memory"] = "locked" if real_time and _locked() else "not locked"
        _sharp_timers()
    return told


def _fifo() -> bool:
    if sys.platform != "linux":
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO))
    except OSError:
        return False
    return True


def _locked() -> bool:
    """Pages that are in memory stay there."""
    with suppress(OSError, AttributeError):
        return bool(ctypes.CDLL(None, use_errno=True).mlockall(MCL_CURRENT_AND_FUTURE) == 0)
    return False


def _sharp_timers() -> None:
    """A sleep ends when it should, and not up to 50 us later so as to save power."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0)
