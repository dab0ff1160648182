"""Contracts: what every part of a kind must do, demand by demand; built-in parts and those of extensions alike."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")


class NotKept(ValueError):
    """A part does not do what a demand of its contract says; the message says what was found."""


@dataclass(frozen=True)
class Demand(Generic[T]):
    """A demand of a contract; where one that is `needed` is not kept, those after it are not tried.

    `check` takes what is tried, and returns a remark for people, or None. It raises NotKept if the demand is not kept;
    any other error of the part counts as well, and is named with its file and line.
    """

    text: str
    check: Callable[[T], str | None]
    needed: bool = False


@dataclass(frozen=True)
class Verdict:
    """Whether a demand is kept: `problem` says why not, "" if it is; `remark` is for people."""

    part: str
    demand: str
    problem: str = ""
    remark: str = ""

    @property
    def ok(self) -> bool:
        """Return whether the demand is kept."""
        return not self.problem

    def __str__(self) -> str:
        """Return the verdict as one line."""
        if self.problem:
            return f"FAILED  {self.demand}: {self.problem}"
        return f"ok      {self.demand}" + (f" ({self.remark})" if self.remark else "")


def verdicts(part: str, contract: Sequence[Demand[T]], tried: T) -> Iterator[Verdict]:
    """Yield the verdict on each demand of a contract, in order."""
    for place, demand in enumerate(contract, start=1):
        problem = remark = ""
        try:
            remark = demand.check(tried) or ""
        except NotKept as error:
            problem = str(error)
        except Exception as error:
            frame = traceback.extract_tb(error.__traceback__)[-1]
            problem = f"{type(error).__name__}: {error} ({frame.filename} line {frame.lineno})"
        stops = bool(problem) and demand.needed and place < len(contract)
        yield Verdict(
            part, demand.text, problem + (f"; {len(contract) - place} more are not tried" if stops else ""), remark
        )
        if stops:
            return


def demand(kept: object, found: str) -> None:
    """Raise NotKept with what was found unless the demand is kept."""
    if not kept:
        raise NotKept(found)
