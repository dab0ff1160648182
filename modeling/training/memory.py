"""Memory that was freed stays with a worker: a training asks for the same again at every step."""

from __future__ import annotations

import ctypes
import sys

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # malloc.h of glibc
TRIM, MMAP = 256 << 20, 32 << 20
"""Bytes; the second is the most that glibc takes, and where it goes by itself in time."""


def keep_freed() -> None:
    """Let this process keep what it frees, as it does unless its environment says otherwise; glibc only, else nothing.

    Dask starts its workers with MALLOC_TRIM_THRESHOLD_=65536. With it every tensor of 128 KiB or more comes from the
    system and goes back to it; the page faults made trainings of the thesis' network 1.7 times as long.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(M_TRIM_THRESHOLD, TRIM)
        mallopt(M_MMAP_THRESHOLD, MMAP)
