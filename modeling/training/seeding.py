"""Chance and threads: the same seed gives the same numbers, whatever ran before in this process."""

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
"""What a seed is used for; each use has numbers of its own."""


def order(seed: int, epoch: int, rows: int) -> Tensor:
    """Return the order of the rows in an epoch: decided by the seed and the epoch alone."""
    return torch.from_numpy(Generator(PCG64(SeedSequence([seed, _ORDER, epoch]))).permutation(rows).astype(np.int64))


def batch_chance(seed: int, epoch: int) -> torch.Generator:
    """Return what a source draws its augmentation from in an epoch; epoch 0 is for rows that are only looked at."""
    return torch.Generator().manual_seed(_number(seed, _HELD if epoch == 0 else _BATCHES, epoch))


def seeded(make: Callable[[], Seeded], seed: int) -> Seeded:
    """`make()` with starting weights that the seed alone decides; the process's own generator is left as it was."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(_number(seed, _WEIGHTS))
        return make()


@contextmanager
def training_state(seed: int, threads: int) -> Iterator[None]:
    """Inside: this many threads, repeatable arithmetic, dropout from the seed. Afterwards all is as it was."""
    was = torch.get_num_threads(), torch.get_deterministic_debug_mode()
    memory: Any = torch.utils.deterministic
    fills = memory.fill_uninitialized_memory
    with torch.random.fork_rng(devices=[]):
        try:
            torch.set_num_threads(threads)
            torch.set_deterministic_debug_mode("error")  # the other switch loads torch's compiler, 1.6 s a process
            memory.fill_uninitialized_memory = False
            torch.manual_seed(_number(seed, _DROPOUT))
            yield
        finally:
            memory.fill_uninitialized_memory = fills
            torch.set_deterministic_debug_mode(was[1])
            torch.set_num_threads(was[0])


def _number(*key: int) -> int:
    """Return a seed for torch (63 bits) that belongs to this key."""
    return int(SeedSequence(list(key)).generate_state(1, np.uint64)[0] >> np.uint64(1))
