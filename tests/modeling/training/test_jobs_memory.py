"""A worker whose environment gives memory back at once keeps it for the next step."""

import os
import subprocess
import sys

import pytest

FAULTS = """
import resource, sys, threading
import numpy as np
from palpate.modeling.training.jobs import keep_freed

def used():
    for _ in range(200):
        np.empty(1 << 20, dtype=np.uint8).fill(1)

def faults():
    used()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    used()
    print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)

def both():
    faults()
    keep_freed()
    faults()

worker = threading.Thread(target=both)  # as a cluster's worker does its jobs
worker.start()
worker.join()
"""


@pytest.mark.needs("glibc")
def test_a_worker_keeps_what_it_freed_where_its_environment_gives_it_back():
    result = subprocess.run(
        [sys.executable, "-c", FAULTS], env={**os.environ, "MALLOC_TRIM_THRESHOLD_": "65536"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    given_back, after = map(int, result.stdout.split())
    assert given_back > 200 * 200 and after < given_back / 100
