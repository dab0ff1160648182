"""Folds, seeds and grid points in parallel: in this process, on this machine's cores, or on a Dask cluster.

The results are those of the jobs one after another, in their order, whichever way and however many workers: a job
has its own process while it runs, a fixed number of threads, and no chance that is not its own. On cores these are
joblib's processes (loky), which are gone when the jobs are done or stopped.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Generator, Sequence
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from palpate.modeling.training.job import Job, attempted, done, named, opened
from palpate.modeling.training.refusals import JobBroken, JobError
from palpate.protocols.progress import Clock, Pace, Report, lasting, silent

Given = TypeVar("Given")
Result = TypeVar("Result")
ATTEMPTS = 3


def run_jobs(
    call: Callable[[Given], Result],
    jobs: Sequence[Given],
    *,
    workers: int | None = None,
    cluster: str | None = None,
    threads: int = 1,
    report: Report = silent,
    clock: Clock = time.perf_counter,
) -> list[Result]:
    """`[call(job) for job in jobs]`, by `workers` processes, each job with `threads` threads.

    `workers` None: as many as cores that this process may use. `cluster` is the address of a Dask scheduler
    (tcp://HOST:8786); its workers do the jobs then, and `workers` says nothing. Jobs whose worker died are done again,
    until workers have died three times. `call` and the jobs are pickled: no open files. A job with a `name` is told of
    by it. Raises JobError for a job that was refused (any ValueError), JobBroken for one that failed otherwise; the
    first one that is met ends the others.
    """
    if workers is not None and workers < 1:
        raise JobError(f"workers is {workers}: expected 1 or more.")
    results: dict[int, Result] = {}
    pace = Pace(len(jobs), clock)

    def took(job: Job, result: Result) -> None:
        results[job.index] = result
        pace.step()
        left = f", {lasting(pace.left_s)} left" if pace.done < len(jobs) else ""
        report(f"{pace.done} of {len(jobs)} done: {job.name}{left}")

    tasks = [Job(index, named(index, job), call, job, threads) for index, job in enumerate(jobs)]
    _way(min(workers or _cores(), len(tasks)), cluster)(tasks, took, report)
    return [results[index] for index in range(len(tasks))]


def _cores() -> int:
    """Those that this process may use: a container or a batch system gives less than the machine has."""
    from joblib import cpu_count

    return int(cpu_count())


def _way(workers: int, cluster: str | None) -> Callable[[list[Job], Callable[[Job, Result], None], Report], None]:
    if cluster is not None:
        from palpate.modeling.training.jobs_cluster import on_cluster

        return lambda tasks, took, report: on_cluster(cluster, tasks, took, report)
    if workers > 1:
        return lambda tasks, took, report: on_cores(workers, tasks, took, report)
    return _here


def _here(tasks: list[Job], took: Callable[[Job, Result], None], _report: Report) -> None:
    for task in tasks:
        took(task, done(task))


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
