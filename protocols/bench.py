"""Benchmark cases as declarations: what to run, and the error of its result. `palpate bench` measures them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Case:
    """A method on an input; cases with the same `case` and `input` are compared with each other.

    `run` is timed and takes no arguments; its inputs are prepared before. `error` is called with the result of `run`
    and returns a number >= 0 in the unit that `error_kind` names, or None where the method refused by name. `seconds`,
    where given, is called with the result of `run` and returns how long the answer took, as for a training that was
    timed while it ran: then `run` is called only once and no memory is traced; `peak_MB` may return the memory.
    """

    area: str
    case: str
    method: str
    input: str
    n: int
    error_kind: str
    run: Callable[[], Any]
    error: Callable[[Any], float | None]
    repeats: int = 5
    seconds: Callable[[Any], float] | None = None
    peak_MB: Callable[[Any], float] | None = None
