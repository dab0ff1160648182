"""One job as a worker gets it, and what comes back: a result, or words about a failure that survive the way."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from palpate.modeling.training.refusals import JobBroken, JobError
from palpate.modeling.training.threads import limited

LONGEST = 80


@dataclass(frozen=True)
class Job:
    """`call(given)`, as job number `index`."""

    index: int
    name: str
    call: Callable[[Any], Any]
    given: Any
    threads: int


@dataclass(frozen=True)
class Failed:
    """A failure in words: an error itself may not survive pickling. `refused` tells a mistake of input from a fault."""

    words: str
    trace: str
    refused: bool


def attempted(job: Job) -> Any:
    """The job's result or `Failed`; runs in the worker."""
    try:
        with limited(job.threads):
            return job.call(job.given)
    except Exception as error:
        words = f"{type(error).__name__}: {error}"
        refused = isinstance(error, ValueError)
        return Failed(str(error) if refused else words, "".join(traceback.format_exception(error)), refused)


def opened(job: Job, outcome: Any) -> Any:
    """The result. Raises JobError or JobBroken, with the job's name, for a failure."""
    if not isinstance(outcome, Failed):
        return outcome
    if outcome.refused:
        raise JobError(f"{job.name}: {outcome.words}")
    raise JobBroken(f"{job.name}: {outcome.words}\n{outcome.trace}")


def done(job: Job) -> Any:
    """The job done in this process."""
    return opened(job, attempted(job))


def named(index: int, given: Any) -> str:
    """What the job is called: its own `name`, or its beginning as text."""
    name = getattr(given, "name", None)
    text = name if isinstance(name, str) else repr(given)
    return f"job {index + 1} ({text if len(text) <= LONGEST else text[: LONGEST - 3] + '...'})"
