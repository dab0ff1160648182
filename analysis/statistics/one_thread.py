"""One thread of linear algebra while many small problems are solved."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any


def one_thread() -> AbstractContextManager[Any]:
    """Limit BLAS to one thread while the context lasts.

    A fit makes thousands of small factorisations. Several threads gain nothing on them, and on a busy machine they
    wait for each other: docs/reference/mixed-models.md has the times.
    """
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    limits: AbstractContextManager[Any] = threadpool_limits(limits=1, user_api="blas")
    return limits
