"""The learning curve of a training as arrays, as a finished job keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.training.history import COLUMNS, Epoch, history_of
from palpate.protocols.undefined import nan_to_none

PREFIX = "curve_"


def curve_of(model: object) -> dict[str, NDArray[np.float64]]:
    """The epochs of a model by column, NaN where nothing was held out; nothing where it was not trained in epochs."""
    history = history_of(model)
    if not history:
        return {}
    columns = {name: [getattr(epoch, name) for epoch in history] for name in COLUMNS}
    return {
        f"{PREFIX}{name}": np.array([np.nan if value is None else value for value in column], dtype=np.float64)
        for name, column in columns.items()
    }


def history_in(arrays: Mapping[str, NDArray[Any]]) -> tuple[Epoch, ...]:
    """The epochs that `curve_of` put among these arrays; none for a method that has none."""
    columns = {name.removeprefix(PREFIX): each for name, each in arrays.items() if name.startswith(PREFIX)}
    epochs = []
    for i in range(len(columns.get("epoch", ()))):
        at = {name: float(values[i]) for name, values in columns.items()}
        held = nan_to_none(at["held_loss"])
        epochs.append(Epoch(int(at["epoch"]), at["seconds"], at["learning_rate"], at["train_loss"], held))
    return tuple(epochs)
