"""One thread of linear algebra during a fit."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from importlib import import_module
from importlib.util import find_spec
from typing import Any


def one_thread() -> AbstractContextManager[Any]:
    """While this lasts, BLAS uses one thread, where threadpoolctl is installed; elsewhere nothing changes.

    A fit makes thousands of small factorisations. Several threads gain nothing on them, and on a busy machine they
    wait for each other: docs/reference/mixed-models.md has the times.
    """
    if find_spec("threadpoolctl") is None:
        return nullcontext()
    limits: AbstractContextManager[Any] = import_module("threadpoolctl").threadpool_limits(limits=1, user_api="blas")
    return limits
