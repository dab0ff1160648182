"""Jobs on a Dask cluster: the same jobs, sent to its workers; the extra `cluster` is imported here only."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from palpate.modeling.training.job import Job, attempted, opened
from palpate.modeling.training.refusals import JobBroken, JobError
from palpate.modeling.training.run_card import versions
from palpate.protocols.progress import Report

PATIENCE_S = 30
LACKING = "A cluster needs the extra `cluster`: pip install 'palpate[cluster]'."


def on_cluster(address: str, jobs: list[Job], took: Callable[[Job, Any], None], report: Report) -> None:
    """Do the jobs by the cluster's workers. The scheduler gives the jobs of a worker that died to another one.

    Raises JobError where there is no such cluster, its workers have other versions than this process, or more than one
    thread each: trainings in one process would draw from each other's chance.
    """
    with _client(address) as client:
        _refuse_unfit(client, address)
        report(f"{len(client.nthreads())} workers at {address}")
        futures = {client.submit(_attempted_there, job, pure=False): job for job in jobs}
        _collect(client, futures, took)


def demand_cluster(address: str) -> None:
    """For long work whose jobs go there later. Raises JobError where `on_cluster` would refuse the cluster."""
    with _client(address) as client:
        _refuse_unfit(client, address)


@contextmanager
def local_cluster(workers: int, scratch: Path) -> Iterator[str]:
    """A scheduler and so many workers of one thread on this machine, each a process; gone afterwards. Its address."""
    try:
        import dask
        from distributed import LocalCluster
    except ModuleNotFoundError:
        raise JobError(LACKING) from None
    once = {"distributed.worker.multiprocessing-method": "forkserver"}  # one import for all workers
    with (
        dask.config.set(once),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            local_directory=str(scratch),
        ) as cluster,
    ):
        yield str(cluster.scheduler_address)


def _attempted_there(job: Job) -> Any:
    keep_freed()
    return attempted(job)


def _collect(client: Any, futures: dict[Any, Job], took: Callable[[Job, Any], None]) -> None:
    from distributed import as_completed

    try:
        for future in as_completed(list(futures), loop=client.loop):
            job = futures[future]
            took(job, opened(job, _outcome(future, job)))
    finally:
        for future in futures:
            future.cancel()


def _outcome(future: Any, job: Job) -> Any:
    if future.status == "finished":
        return future.result()
    error = future.exception() if future.status == "error" else None
    raise JobBroken(f"{job.name}: the cluster gave it up ({error or future.status}).")


def _client(address: str) -> Any:
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
    """Other versions give other numbers."""
    ours = versions()
    for worker, found in theirs.items():
        other = [name for name in ours if found.get(name) != ours[name]]
        if other:
            told = ", ".join(f"{name} {found.get(name)} (here {ours[name]})" for name in other)
            raise JobError(f"Worker {worker} has {told}: install the same versions there.")


M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # malloc.h of glibc
TRIM, MMAP = 256 << 20, 32 << 20
"""Bytes; the second is the most that glibc takes, and where it goes by itself in time."""


def keep_freed() -> None:
    """Let this process keep what it frees, as it does unless its environment says otherwise; glibc only, else nothing.

    Dask starts its workers with MALLOC_TRIM_THRESHOLD_=65536. With it every tensor of 128 KiB or more comes from the
    system and goes back to it; the page faults made trainings of the thesis' network 1.7 times as long.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(M_TRIM_THRESHOLD, TRIM)
        mallopt(M_MMAP_THRESHOLD, MMAP)
