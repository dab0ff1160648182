"""Folds, seeds and grid points in parallel: in this process, on this machine's cores, or on a Dask cluster.

The results are those of the jobs one after another, in their order, whichever way and however many workers: a job
has its own process while it runs, a fixed number of threads, and no chance that is not its own.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TypeVar

from palpate.modeling.training.job import Job, done, named
from palpate.modeling.training.refusals import JobError
from palpate.protocols.progress import Clock, Pace, Report, lasting, silent

Given = TypeVar("Given")
Result = TypeVar("Result")


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
        from palpate.modeling.training.jobs_local import on_cores

        return lambda tasks, took, report: on_cores(workers, tasks, took, report)
    return _here


def _here(tasks: list[Job], took: Callable[[Job, Result], None], _report: Report) -> None:
    for task in tasks:
        took(task, done(task))
