"""Work on many items in several processes, with the results in the order of the items."""

from __future__ import annotations

import os
import signal
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread
from typing import TypeVar

import click

from palpate.protocols.extensions import Finder, finder, use
from palpate.protocols.interrupts import uninterrupted

Item = TypeVar("Item")
Result = TypeVar("Result")

WORKERS = click.option(
    "--workers", type=click.IntRange(1, 256), help="Processes at work at once.  [default: one for each core]"
)
AHEAD = 8
"""Results per process that may wait in memory for an earlier one."""


class WorkerDied(ValueError):
    """A process that worked on an item died."""


def workers_for(items: int, requested: int | None = None, least: int = 40) -> int:
    """Return how many processes to use: `requested`, else one per core as far as each has `least` items."""
    if requested is not None:
        return min(requested, max(1, items))
    return max(1, min(available_cores(), items // least))


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def map_in_order(work: Callable[[Item], Result], items: Sequence[Item], workers: int) -> Generator[Result]:
    """Yield `work(item)` for every item in order; with several workers each call runs in another process.

    `work`, the items and the results must pickle. The first exception ends the work, as without processes. When closed
    or interrupted, it ends its processes once each has finished its item.
    """
    if workers <= 1:
        yield from map(work, items)
        return
    # Spawned, not forked: a progress bar is a thread, and a fork of a process with threads may hang.
    pool = ProcessPoolExecutor(workers, get_context("spawn"), initializer=serve_the_parent, initargs=(finder(),))
    waiting: deque[Future[Result]] = deque()
    coming = iter(items)
    try:
        with uninterrupted():
            waiting.extend(pool.submit(work, item) for item in islice(coming, workers * AHEAD))
        while waiting:
            result = waiting.popleft().result()
            waiting.extend(pool.submit(work, item) for item in islice(coming, 1))
            yield result
    except BrokenProcessPool:
        raise WorkerDied("a worker process died, probably out of memory; continue with --workers 1") from None
    finally:
        pool.shutdown(cancel_futures=True)


def serve_the_parent(extensions: Finder) -> None:
    """Set up a worker process: ignore Ctrl-C, which the parent handles, and end with the parent.

    `extensions` is what looks for extensions in the parent.
    """
    use(extensions)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
