"""The epochs of a training: their losses, as a CSV table and as arrays of a stored result."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, astuple, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.protocols.files import write_text
from palpate.protocols.tables import table_text
from palpate.protocols.undefined import nan_to_none

PREFIX = "curve_"


@dataclass(frozen=True)
class Epoch:
    """One epoch: mean losses over the rows, its learning rate, and the seconds since the training began.

    `held_loss` is None where nothing was held out. Seconds add up over a training that was killed and continued.
    """

    epoch: int
    seconds: float
    learning_rate: float
    train_loss: float
    held_loss: float | None

    @property
    def watched(self) -> float:
        """The loss for schedule, early stopping and the choice of weights."""
        return self.train_loss if self.held_loss is None else self.held_loss

    def plain(self) -> dict[str, Any]:
        """Return the epoch as JSON holds it."""
        return asdict(self)


COLUMNS = tuple(field.name for field in fields(Epoch))


def history_of(model: object) -> tuple[Epoch, ...]:
    """Return the epochs of a fitted model; empty where it was not trained in epochs."""
    result: tuple[Epoch, ...] = getattr(getattr(model, "trained", None), "history", ())
    return result


def write_history(history: Iterable[Epoch], path: Path) -> Path:
    """Write one row per epoch, with the fields of `Epoch` as columns, exactly; return the path."""
    rows = (["" if value is None else repr(value) for value in astuple(epoch)] for epoch in history)
    return write_text(path, table_text(COLUMNS, rows))


def remove_history(folder: Path, name: str) -> None:
    """Remove the history table and pictures of an older model of this name, unless the table has another header."""
    table = folder / f"{name}.history.csv"
    try:
        ours = table.read_text(encoding="utf-8").partition("\n")[0] == ",".join(COLUMNS)
    except (OSError, UnicodeDecodeError):
        return
    if ours:
        for kind in ("svg", "png", "csv"):
            table.with_suffix(f".{kind}").unlink(missing_ok=True)


def curve_of(model: object) -> dict[str, NDArray[np.float64]]:
    """Return the epochs of a model as columns, (epochs,) each, NaN for None; empty if it was not trained in epochs."""
    history = history_of(model)
    if not history:
        return {}
    columns = {name: [getattr(epoch, name) for epoch in history] for name in COLUMNS}
    return {
        f"{PREFIX}{name}": np.array([np.nan if value is None else value for value in column], dtype=np.float64)
        for name, column in columns.items()
    }


def history_in(arrays: Mapping[str, NDArray[Any]]) -> tuple[Epoch, ...]:
    """Return the epochs from arrays of `curve_of`; empty where there are none."""
    columns = {name.removeprefix(PREFIX): values for name, values in arrays.items() if name.startswith(PREFIX)}
    epochs = []
    for i in range(len(columns.get("epoch", ()))):
        row = {name: float(values[i]) for name, values in columns.items()}
        held = nan_to_none(row["held_loss"])
        epochs.append(Epoch(int(row["epoch"]), row["seconds"], row["learning_rate"], row["train_loss"], held))
    return tuple(epochs)
