"""Random numbers and threads: one seed gives the same numbers, whatever ran before in this process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
import torch
from numpy.random import PCG64, Generator, SeedSequence
from torch import Tensor

Seeded = TypeVar("Seeded")
_ORDER, _BATCHES, _DROPOUT, _WEIGHTS, _HELD = range(5)
"""The uses of a seed; each has its own stream of random numbers."""


def order(seed: int, epoch: int, rows: int) -> Tensor:
    """Return the order of the rows in an epoch, (rows,), which depends on the seed and the epoch alone."""
    return torch.from_numpy(Generator(PCG64(SeedSequence([seed, _ORDER, epoch]))).permutation(rows).astype(np.int64))


def batch_chance(seed: int, epoch: int) -> torch.Generator:
    """Return the generator of a source's augmentation in an epoch; epoch 0 is for held-out rows."""
    return torch.Generator().manual_seed(_number(seed, _HELD if epoch == 0 else _BATCHES, epoch))


def seeded(make: Callable[[], Seeded], seed: int) -> Seeded:
    """Return `make()`, with starting weights from the seed; torch's own random state is left as it was."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(_number(seed, _WEIGHTS))
        return make()


@contextmanager
def training_state(seed: int, threads: int) -> Iterator[None]:
    """Set the number of threads, deterministic arithmetic, and dropout from the seed; restore all afterwards."""
    threads_before, mode_before = torch.get_num_threads(), torch.get_deterministic_debug_mode()
    memory: Any = torch.utils.deterministic
    fill_before = memory.fill_uninitialized_memory
    with torch.random.fork_rng(devices=[]):
        try:
            torch.set_num_threads(threads)
            # use_deterministic_algorithms would load torch's compiler, 1.6 s per process
            torch.set_deterministic_debug_mode("error")
            memory.fill_uninitialized_memory = False
            torch.manual_seed(_number(seed, _DROPOUT))
            yield
        finally:
            memory.fill_uninitialized_memory = fill_before
            torch.set_deterministic_debug_mode(mode_before)
            torch.set_num_threads(threads_before)


def _number(*key: int) -> int:
    """Return a seed for torch (63 bits) from a key."""
    return int(SeedSequence(list(key)).generate_state(1, np.uint64)[0] >> np.uint64(1))
