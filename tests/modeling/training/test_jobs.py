"""Jobs in parallel: the same results whichever way, also where a worker is killed, and nothing is left running."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from palpate.modeling.training import jobs
from palpate.modeling.training.jobs import run_jobs
from palpate.modeling.training.refusals import JobBroken, JobError
from tests.modeling.training import working

pytestmark = pytest.mark.needs("torch")

ROOT = Path(__file__).parents[3]


FOLDS = [working.Fold(f"fold {seed}", seed, trains=seed == 0) for seed in range(3)]
"""One of them trains a network: importing torch takes longer than all else, and each worker would do it."""


@pytest.fixture(scope="module")
def alone():
    return run_jobs(working.fit, FOLDS, workers=1)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """A scheduler and two workers, each a process; gone afterwards."""
    folder = tmp_path_factory.mktemp("cluster")
    script = [sys.executable, "-c", working.CLUSTER, str(folder)]
    process = subprocess.Popen(script, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    yield process.stdout.readline().strip()
    process.communicate("stop\n", timeout=60)


def test_processes_give_what_one_gives_also_when_one_of_them_is_killed(alone, tmp_path):
    lines = []
    folds = [replace(FOLDS[0], once=tmp_path / "killed"), *FOLDS[1:]]
    results = run_jobs(working.fit, folds, workers=2, report=lines.append, clock=lambda: 0.0)
    assert (tmp_path / "killed").exists() and any("a worker died" in line for line in lines)
    assert [result.tobytes() for result in results] == [result.tobytes() for result in alone]
    done = sorted(line.split(": ")[1].split(",")[0] for line in lines if " done: " in line)
    assert done == [f"job {i + 1} (fold {i})" for i in range(3)]
    assert lines[-1].startswith("3 of 3 done")


def test_every_core_that_this_process_may_use_has_a_worker(monkeypatch):
    requested = []
    monkeypatch.setattr("joblib.cpu_count", lambda: 3)
    monkeypatch.setattr(jobs, "run_on_cores", lambda workers, *_rest: requested.append(workers))
    with pytest.raises(KeyError):  # nothing was done
        run_jobs(working.root, [1.0] * 5)
    assert requested == [3]


def test_a_job_that_kills_every_worker_is_given_up_by_name():
    lines = []
    with pytest.raises(JobBroken, match=r"workers died 3 times.*job 1 \(9\)"):
        run_jobs(working.die, [9, 9], workers=2, report=lines.append)
    assert lines == [f"a worker died: 2 jobs are done again (attempt {attempt} of 3)" for attempt in (2, 3)]


def test_a_cluster_gives_the_same_also_when_one_of_its_workers_is_killed(alone, cluster, tmp_path):
    lines = []
    folds = [replace(FOLDS[0], once=tmp_path / "killed"), *FOLDS[1:]]
    results = run_jobs(working.fit, folds, cluster=cluster, report=lines.append)
    assert (tmp_path / "killed").exists() and lines[0] == f"2 workers at {cluster}"
    assert [result.tobytes() for result in results] == [result.tobytes() for result in alone]
    with pytest.raises(JobError, match=r"^job 2 \(-1\): -1 is below zero"):
        run_jobs(working.root, [4.0, -1], cluster=cluster)
    jobs.demand_cluster(cluster)  # fit, so no message is printed


@pytest.mark.parametrize("workers", [1, 2])
def test_a_refusal_names_the_job_and_a_fault_brings_its_trace(workers):
    with pytest.raises(JobError, match=r"^job 2 \(-1\): -1 is below zero"):
        run_jobs(working.root, [4.0, -1, 9.0], workers=workers)
    with pytest.raises(JobBroken, match=r"(?s)job 1 \('four'\): TypeError.*in root"):
        run_jobs(working.root, ["four", 4.0], workers=workers)


def test_every_worker_has_its_threads_and_this_process_keeps_its_own():
    import torch

    was = torch.get_num_threads(), dict(os.environ)
    assert run_jobs(working.threads, [0, 1], workers=2) == [(1, "1")] * 2
    assert run_jobs(working.threads, [0], workers=1, threads=2) == [(2, "2")]
    assert (torch.get_num_threads(), dict(os.environ)) == was


def test_a_lambda_and_no_jobs_will_do():
    assert run_jobs(lambda job: job + np.float64(1), [1.0, 2.0], workers=2) == [2.0, 3.0]
    assert run_jobs(working.root, []) == []


def test_no_workers_and_no_such_cluster_are_refused(monkeypatch):
    monkeypatch.setattr(jobs, "PATIENCE_S", 0.5)
    with pytest.raises(JobError, match="workers is 0"):
        run_jobs(working.root, [1.0], workers=0)
    with pytest.raises(JobError, match="no Dask scheduler at tcp://127.0.0.1:9"):
        run_jobs(working.root, [1.0], cluster="tcp://127.0.0.1:9")
    with pytest.raises(JobError, match="no Dask scheduler at nowhere:at:all"):
        run_jobs(working.root, [1.0], cluster="nowhere:at:all")
    with pytest.raises(JobError, match="no Dask scheduler at tcp://127.0.0.1:9"):
        jobs.demand_cluster("tcp://127.0.0.1:9")


def test_without_the_extra_the_message_names_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(JobError, match=r"pip install 'palpate\[cluster\]'"):
        run_jobs(working.root, [1.0], cluster="tcp://127.0.0.1:8786")


def test_ctrl_c_stops_the_workers():
    child = subprocess.Popen([sys.executable, "-c", working.ENDLESS], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    try:
        workers = [int(child.stdout.readline()) for _ in range(2)]
        child.send_signal(signal.SIGINT)
        assert child.communicate(timeout=60)[0] == "stopped\n"
    finally:
        child.kill()
        child.wait()
    for worker in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(worker, 0)
