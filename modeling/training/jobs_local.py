"""Jobs on this machine's cores: joblib's processes (loky), which are gone when the jobs are done or stopped."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from palpate.modeling.training.job import Job, attempted, opened
from palpate.modeling.training.refusals import JobBroken
from palpate.protocols.progress import Report

ATTEMPTS = 3


def on_cores(workers: int, jobs: list[Job], took: Callable[[Job, Any], None], report: Report) -> None:
    """Do the jobs by so many processes; where one of them dies, its jobs and those not begun are done again."""
    missing = {job.index: job for job in jobs}

    def came(job: Job, outcome: Any) -> None:
        took(job, opened(job, outcome))
        del missing[job.index]

    try:
        for attempt in range(1, ATTEMPTS + 1):
            if _all_came(workers, list(missing.values()), came):
                return
            if attempt < ATTEMPTS:
                report(f"a worker died: {len(missing)} jobs are done again (attempt {attempt + 1} of {ATTEMPTS})")
    finally:
        _stop_workers()
    names = ", ".join(job.name for job in missing.values())
    raise JobBroken(f"workers died {ATTEMPTS} times, likely for want of memory. Not done: {names}.")


def _all_came(workers: int, jobs: list[Job], came: Callable[[Job, Any], None]) -> bool:
    """Whether all jobs came back, each handed on as it comes; False where a worker died on the way."""
    from joblib import Parallel, delayed, parallel_config

    threads = max(job.threads for job in jobs)
    with parallel_config(backend="loky", inner_max_num_threads=threads):
        pool = Parallel(n_jobs=workers, return_as="generator_unordered", max_nbytes=None, batch_size=1)
        outcomes = pool(delayed(_with_job)(job) for job in jobs)
        by_index = {job.index: job for job in jobs}
        try:
            for index, outcome in outcomes:
                came(by_index[index], outcome)
        except BrokenProcessPool:
            return False
        finally:
            _end(outcomes)
    return True


def _end(outcomes: Generator[Any, None, None]) -> None:
    """Jobs that are still going are ended, which is meant: joblib would warn of it."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module="joblib", category=UserWarning)
        outcomes.close()


def _with_job(job: Job) -> tuple[int, Any]:
    return job.index, attempted(job)


def _stop_workers() -> None:
    """joblib would keep its processes for the next call; nothing of ours outlives what was asked."""
    from joblib.externals.loky import get_reusable_executor

    get_reusable_executor(reuse=True).shutdown(wait=True, kill_workers=True)
