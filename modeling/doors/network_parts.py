"""What the networks have in common: rows to train on, standardisation as a layer, and answers in batches."""

from __future__ import annotations

from dataclasses import replace
from typing import Self

import numpy as np
import torch
from torch import Tensor, nn

from palpate.modeling.columns import CONSTANT
from palpate.modeling.doors.data import ModelDataError
from palpate.modeling.doors.methods import Learning
from palpate.modeling.doors.preparing import Rows, rows_of
from palpate.modeling.training.steps import answers_of
from palpate.signals.arrays import Array

AT_ONCE = 64
"""Rows that a network answers at a time: enough for speed, little enough for memory."""
QUICK_EPOCHS = 4


class Rescale(nn.Module):
    """y = gain * x + offset, by element; fixed, never trained."""

    gain: Tensor
    offset: Tensor

    def __init__(self, gain: Array | float, offset: Array | float) -> None:
        super().__init__()
        self.register_buffer("gain", torch.as_tensor(np.asarray(gain, dtype=np.float32)))
        self.register_buffer("offset", torch.as_tensor(np.asarray(offset, dtype=np.float32)))

    def forward(self, x: Tensor) -> Tensor:
        """(batch, size) to the same shape."""
        return self.gain * x + self.offset

    @classmethod
    def up(cls, rows: Array) -> Self:
        """From centred values to such rows (n, size): their mean row, and one SD for all that is left.

        One SD for all places keeps a profile's shape: a place that hardly differs between doors is not blown up. Where
        all rows are equal it is 1.
        """
        return cls(*reversed(_centre_and_spread(rows)))

    @classmethod
    def down(cls, rows: Array) -> Self:
        """From such rows (n, size) to centred values: the way back of `up`."""
        centre, spread = _centre_and_spread(rows)
        return cls(1.0 / spread, -centre / spread)


def _centre_and_spread(rows: Array) -> tuple[Array, float]:
    centre: Array = rows.mean(axis=0)
    spread = float(np.sqrt(np.mean((rows - centre) ** 2)))
    return centre, spread if spread > CONSTANT * float(np.abs(rows).max()) else 1.0


def training_rows(learning: Learning) -> tuple[Rows, Rows | None]:
    """The rows to train on, and those to watch or None where none are held out.

    Trained on are the stimuli with their training variants; with the setting `quick` the stimuli as they were rated.
    The setting `learn_from` goes before either. Raises ModelDataError as `rows_of` does, and for less than two rows.
    """
    rows = rows_of(learning, "measured" if learning.settings.get("quick") else "train", least=2)
    return rows, rows_of(_watched(learning), "measured") if len(learning.held) else None


def _watched(learning: Learning) -> Learning:
    settings = {name: value for name, value in learning.settings.items() if name != "learn_from"}
    return replace(learning, measured=learning.held, settings=settings)


def answers(network: nn.Module, given: Array) -> Array:
    """What a network answers to rows (n, in), as float64 (n, out), dropout off and on one thread: sums in one order.

    Raises ModelDataError where an answer is not finite, as for values that 32 bits cannot hold.
    """
    found = answers_of(network, given, AT_ONCE)
    if not np.isfinite(found).all():
        raise ModelDataError("the network's answer is not finite: what it was given is far beyond what it has learned.")
    return found
