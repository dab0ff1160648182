"""What callers of a method may ask of its training, and what its network answers afterwards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from palpate.modeling.training.seeding import training_state
from palpate.modeling.training.settings import Settings


def wished_settings(
    given: Mapping[str, Any], default: Settings, seed: int, asked: Sequence[str], quick_epochs: int
) -> Settings:
    """A method's settings with the caller's wishes over them, those named in `asked`.

    `quick` trains for so many epochs where no number is given. Raises TrainingError for a value without sense.
    """
    wished: dict[str, Any] = {"epochs": min(default.epochs, quick_epochs)} if given.get("quick") else {}
    wished |= {name: given[name] for name in asked if name in given}
    return replace(default, seed=seed, **wished)


def answers_of(network: nn.Module, given: NDArray[Any], at_once: int) -> NDArray[np.float64]:
    """What a network answers to rows, as float64, dropout off and on one thread: sums in one order.

    `at_once` rows go through it together. Values that 32 bits cannot hold lead to answers that are not finite.
    """
    with np.errstate(over="ignore"):
        rows = torch.from_numpy(np.ascontiguousarray(given, dtype=np.float32))
    with training_state(0, 1), torch.no_grad():
        network.eval()
        found = torch.cat([network(part) for part in torch.split(rows, at_once)])
    answers: NDArray[np.float64] = found.numpy().astype(np.float64)
    return answers
