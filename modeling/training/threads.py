"""One job, one process, so many threads: workers do not fight over the cores."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
"""What a library reads that is loaded only while the job runs."""


@contextmanager
def limited(threads: int) -> Iterator[None]:
    """Inside, linear algebra and torch use this many threads; afterwards as many as before."""
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    was = {name: os.environ.get(name) for name in VARIABLES}
    os.environ.update(dict.fromkeys(VARIABLES, str(threads)))
    try:
        with threadpool_limits(limits=threads), _torch_limited(threads):
            yield
    finally:
        for name, value in was.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


@contextmanager
def _torch_limited(threads: int) -> Iterator[None]:
    """torch counts its threads itself; where it is not loaded, this does not load it."""
    torch = sys.modules.get("torch")
    if torch is None:
        yield
        return
    was = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        yield
    finally:
        torch.set_num_threads(was)
