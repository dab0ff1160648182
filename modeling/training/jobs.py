"""Folds, seeds and grid points in parallel: in this process, on this machine's cores, or on a Dask cluster.

The results equal those of the jobs run one after another, in their order, with any number of workers: a job has a
process to itself while it runs, a fixed number of threads, and its own random numbers. On cores the processes are
joblib's (loky), and end with the jobs. The packages of the extra `cluster` are imported in this module only.
"""

from __future__ import annotations

import ctypes
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from palpate.modeling.training.refusals import JobBroken, JobError
from palpate.modeling.training.run_card import versions
from palpate.modeling.training.threads import limited
from palpate.protocols.progress import Clock, Pace, Report, lasting, silent

Argument = TypeVar("Argument")
Result = TypeVar("Result")
ATTEMPTS = 3
LONGEST = 80
PATIENCE_S = 30
LACKING = "A cluster needs the extra `cluster`: pip install 'palpate[cluster]'."
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # malloc.h of glibc
TRIM, MMAP = 256 << 20, 32 << 20
"""Thresholds in bytes; `MMAP` is glibc's highest, which its own adaptation also reaches."""


@dataclass(frozen=True)
class Job:
    """A call `call(argument)`, with its position in the list of jobs, its name and its number of threads."""

    index: int
    name: str
    call: Callable[[Any], Any]
    argument: Any
    threads: int


@dataclass(frozen=True)
class Failed:
    """A failure as text, because an error may not survive pickling. `refused`: the input was invalid (ValueError)."""

    words: str
    trace: str
    refused: bool


def run_jobs(
    call: Callable[[Argument], Result],
    jobs: Sequence[Argument],
    *,
    workers: int | None = None,
    cluster: str | None = None,
    threads: int = 1,
    report: Report = silent,
    clock: Clock = time.perf_counter,
) -> list[Result]:
    """Return `[call(job) for job in jobs]`, computed by `workers` processes, each job with `threads` threads.

    With `workers` None there is one for each core that this process may use. `cluster` is the address of a Dask
    scheduler (tcp://HOST:8786), whose workers then run the jobs; `workers` is ignored. Jobs of a worker that died are
    run again, until workers have died three times. `call` and the jobs are pickled, so they hold no open files. A job's
    `name`, if it has one, is used in reports. Raises JobError for a refused job (any ValueError) and JobBroken for any
    other failure; the first failure ends the others.
    """
    if workers is not None and workers < 1:
        raise JobError(f"workers is {workers}: expected 1 or more.")
    results: dict[int, Result] = {}
    pace = Pace(len(jobs), clock)

    def handle_result(job: Job, result: Result) -> None:
        results[job.index] = result
        pace.step()
        left = f", {lasting(pace.left_s)} left" if pace.done < len(jobs) else ""
        report(f"{pace.done} of {len(jobs)} done: {job.name}{left}")

    tasks = [Job(index, _job_name(index, job), call, job, threads) for index, job in enumerate(jobs)]
    if not workers:
        from joblib import cpu_count

        workers = int(cpu_count())  # cores that this process may use, which in a container are fewer than the machine's
    if cluster is not None:
        run_on_cluster(cluster, tasks, handle_result, report)
    elif min(workers, len(tasks)) > 1:
        run_on_cores(min(workers, len(tasks)), tasks, handle_result, report)
    else:
        for task in tasks:
            handle_result(task, unwrap(task, run_safely(task)))
    return [results[index] for index in range(len(tasks))]


def run_on_cores(workers: int, jobs: list[Job], handle_result: Callable[[Job, Any], None], report: Report) -> None:
    """Run the jobs in `workers` processes; run unfinished jobs again when a process dies.

    Raises JobError or JobBroken for a job that failed, and JobBroken when processes died three times.
    """
    missing = {job.index: job for job in jobs}

    def handle_outcome(job: Job, outcome: Any) -> None:
        handle_result(job, unwrap(job, outcome))
        del missing[job.index]

    try:
        for attempt in range(1, ATTEMPTS + 1):
            if _run_in_processes(workers, list(missing.values()), handle_outcome):
                return
            if attempt < ATTEMPTS:
                report(f"a worker died: {len(missing)} jobs are done again (attempt {attempt + 1} of {ATTEMPTS})")
    finally:
        from joblib.externals.loky import get_reusable_executor

        get_reusable_executor(reuse=True).shutdown(wait=True, kill_workers=True)
    names = ", ".join(job.name for job in missing.values())
    raise JobBroken(f"workers died {ATTEMPTS} times, probably out of memory. Not done: {names}.")


def _run_in_processes(workers: int, jobs: list[Job], handle_outcome: Callable[[Job, Any], None]) -> bool:
    """Run the jobs and pass on each outcome as it arrives; return False when a worker died, else True."""
    from joblib import Parallel, delayed, parallel_config

    threads = max(job.threads for job in jobs)
    with parallel_config(backend="loky", inner_max_num_threads=threads):
        pool = Parallel(n_jobs=workers, return_as="generator_unordered", max_nbytes=None, batch_size=1)
        outcomes = pool(delayed(_run_indexed)(job) for job in jobs)
        by_index = {job.index: job for job in jobs}
        try:
            for index, outcome in outcomes:
                handle_outcome(by_index[index], outcome)
        except BrokenProcessPool:
            return False
        finally:
            # joblib warns when running jobs are ended, which is intended here
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", module="joblib", category=UserWarning)
                outcomes.close()
    return True


def _run_indexed(job: Job) -> tuple[int, Any]:
    return job.index, run_safely(job)


def run_safely(job: Job) -> Any:
    """Run the job in this process; return its result, or `Failed` for an error."""
    try:
        with limited(job.threads):
            return job.call(job.argument)
    except Exception as error:
        words = f"{type(error).__name__}: {error}"
        refused = isinstance(error, ValueError)
        return Failed(str(error) if refused else words, "".join(traceback.format_exception(error)), refused)


def unwrap(job: Job, outcome: Any) -> Any:
    """Return the result of the job's outcome. Raises JobError or JobBroken, with the job's name, for a failure."""
    if not isinstance(outcome, Failed):
        return outcome
    if outcome.refused:
        raise JobError(f"{job.name}: {outcome.words}")
    raise JobBroken(f"{job.name}: {outcome.words}\n{outcome.trace}")


def _job_name(index: int, job: Any) -> str:
    """Return the number of the job with its `name`, or with the beginning of its repr."""
    name = getattr(job, "name", None)
    text = name if isinstance(name, str) else repr(job)
    return f"job {index + 1} ({text if len(text) <= LONGEST else text[: LONGEST - 3] + '...'})"


def run_on_cluster(address: str, jobs: list[Job], handle_result: Callable[[Job, Any], None], report: Report) -> None:
    """Run the jobs on the cluster's workers. The scheduler moves the jobs of a worker that died to another one.

    Raises JobError where the cluster cannot be reached, or a worker has other package versions than this process or
    more than one thread, since trainings in one process would share their random numbers.
    """
    with _connect(address) as client:
        _refuse_unfit(client, address)
        report(f"{len(client.nthreads())} workers at {address}")
        futures = {client.submit(_run_on_cluster_worker, job, pure=False): job for job in jobs}
        from distributed import as_completed

        try:
            for future in as_completed(list(futures), loop=client.loop):
                job = futures[future]
                handle_result(job, unwrap(job, _fetch_outcome(future, job)))
        finally:
            for future in futures:
                future.cancel()


def demand_cluster(address: str) -> None:
    """Raise JobError where `run_on_cluster` would refuse the cluster."""
    with _connect(address) as client:
        _refuse_unfit(client, address)


@contextmanager
def local_cluster(workers: int, scratch: Path) -> Iterator[str]:
    """Start a scheduler and `workers` one-thread processes on this machine; yield its address, then stop all."""
    try:
        import dask
        from distributed import LocalCluster
    except ModuleNotFoundError:
        raise JobError(LACKING) from None
    forkserver = {"distributed.worker.multiprocessing-method": "forkserver"}  # packages are imported once for all
    with (
        dask.config.set(forkserver),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            local_directory=str(scratch),
        ) as cluster,
    ):
        yield str(cluster.scheduler_address)


def _run_on_cluster_worker(job: Job) -> Any:
    keep_freed()
    return run_safely(job)


def _fetch_outcome(future: Any, job: Job) -> Any:
    if future.status == "finished":
        return future.result()
    error = future.exception() if future.status == "error" else None
    raise JobBroken(f"{job.name}: the cluster gave it up ({error or future.status}).")


def _connect(address: str) -> Any:
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise JobError(LACKING) from None
    try:
        return Client(address, set_as_default=False, timeout=PATIENCE_S)
    except (OSError, TimeoutError, ValueError) as error:
        raise JobError(f"There is no Dask scheduler at {address}: {error}") from None


def _refuse_unfit(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=PATIENCE_S)
    except TimeoutError:
        raise JobError(f"The cluster at {address} has no workers: start one with `dask worker {address}`.") from None
    for worker, threads in client.nthreads().items():
        if threads != 1:
            raise JobError(f"Worker {worker} has {threads} threads: start it with --nthreads 1 (and --nworkers N).")
    _refuse_versions(client.run(versions))


def _refuse_versions(theirs: Mapping[str, Mapping[str, str | None]]) -> None:
    """Raise JobError for a worker with other versions of the packages, which can give other numbers."""
    ours = versions()
    for worker, installed in theirs.items():
        other = [name for name in ours if installed.get(name) != ours[name]]
        if other:
            text = ", ".join(f"{name} {installed.get(name)} (here {ours[name]})" for name in other)
            raise JobError(f"Worker {worker} has {text}: install the same versions there.")


def keep_freed() -> None:
    """Let this process reuse the memory that it frees; do nothing without glibc.

    Dask starts its workers with MALLOC_TRIM_THRESHOLD_=65536. With it the system allocates and frees every tensor of
    128 KiB or more; the page faults made trainings of the thesis' network 1.7 times as long.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(M_TRIM_THRESHOLD, TRIM)
        mallopt(M_MMAP_THRESHOLD, MMAP)
