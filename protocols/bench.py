"""A figure to reach, declared: what to run and how wrong its result is. `palpate bench` measures it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Case:
    """One method on one input; cases that share `case` and `input` are compared with each other.

    `run` is timed and takes nothing; what it needs is made before. `error` is called on run's result and gives
    a number >= 0 in the unit that `error_kind` names, or None where the method refused by name.
    Where `seconds` is given it is called on run's result and says itself how long the answer took, as of a training
    that was timed while it ran: then `run` is called once only, and no memory is traced; `peak_MB` may say it then.
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
