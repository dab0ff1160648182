"""The epochs of a training that was kept."""

from __future__ import annotations

import math

from modeling.attributes.judging_jobs import Done
from modeling.training.history import Epoch

PREFIX = "curve_"


def history_of(done: Done) -> list[Epoch]:
    """The epochs; empty for a method that has none."""
    columns = {name.removeprefix(PREFIX): each for name, each in done.arrays.items() if name.startswith(PREFIX)}
    epochs = []
    for i in range(len(columns.get("epoch", ()))):
        at = {name: float(values[i]) for name, values in columns.items()}
        held = None if math.isnan(at["held_loss"]) else at["held_loss"]
        epochs.append(Epoch(int(at["epoch"]), at["seconds"], at["learning_rate"], at["train_loss"], held))
    return epochs
