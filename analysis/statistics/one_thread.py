"""Limiting linear algebra to one thread while many small problems are solved."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any


def one_thread() -> AbstractContextManager[Any]:
    """Limit BLAS to one thread within the context.

    A fit makes thousands of small factorisations. Several threads do not speed them up, and on a busy machine they wait
    for each other (times: docs/reference/mixed-models.md).
    """
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    limits: AbstractContextManager[Any] = threadpool_limits(limits=1, user_api="blas")
    return limits
