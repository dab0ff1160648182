"""What the workers of the tests do, in a module of its own: a worker imports it."""

from __future__ import annotations

import math
import os
import signal
from dataclasses import dataclass
from pathlib import Path

CLUSTER = """
import sys
from pathlib import Path
from palpate.modeling.training.jobs import local_cluster
if __name__ == "__main__":
    with local_cluster(2, Path(sys.argv[1])) as address:
        print(address, flush=True)
        sys.stdin.readline()
"""
ENDLESS = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests in the background ignores it
from palpate.modeling.training.jobs import run_jobs
from tests.modeling.training import working
try:
    run_jobs(working.wait, [0, 1], workers=2)
except KeyboardInterrupt:
    print("stopped", flush=True)
"""


@dataclass(frozen=True)
class Fold:
    """One fold, by a training or without torch; where `once` is not there yet, the worker makes it and is killed."""

    name: str
    seed: int
    trains: bool = False
    once: Path | None = None


def fit(fold):
    """What a fold gives, as one array, with the threads meanwhile."""
    if fold.once is not None and not fold.once.exists():
        fold.once.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return trained_by(fold) if fold.trains else solved_by(fold)


def solved_by(fold):
    """Linear algebra: its bits change with the number of threads."""
    import numpy as np
    from threadpoolctl import threadpool_info

    rng = np.random.Generator(np.random.PCG64(fold.seed))
    solved = np.linalg.lstsq(rng.normal(size=(300, 200)), rng.normal(size=300), rcond=None)[0]
    return np.concatenate([solved, [max(pool["num_threads"] for pool in threadpool_info())]])


def trained_by(fold):
    """The weights of a small training whose seed is the fold's."""
    import numpy as np
    import torch

    from tests.modeling.training.small import network, trained

    model, _ = trained(network(fold.seed), epochs=3, seed=fold.seed)
    weights = [tensor.numpy().ravel() for tensor in model.state_dict().values()]
    return np.concatenate([*weights, [torch.get_num_threads()]])


def root(number):
    if number < 0:
        raise ValueError(f"{number} is below zero")
    return math.sqrt(number)


def die(_job):
    os.kill(os.getpid(), signal.SIGKILL)


def wait(_job):
    os.write(1, f"{os.getpid()}\n".encode())  # in one piece: the other worker writes to the same pipe
    signal.pause()


def threads(_job):
    """The most threads of any pool of this process, and what a library that is loaded later would read."""
    import numpy  # noqa: F401
    from threadpoolctl import threadpool_info

    return max(pool["num_threads"] for pool in threadpool_info()), os.environ["OMP_NUM_THREADS"]
