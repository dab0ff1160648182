"""A trained model in a lab's folder: its card and numbers, its history and its learning curve beside them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.modeling.training.history import Epoch, remove_history, write_history
from palpate.modeling.training.run_card import plain_values


@dataclass(frozen=True)
class Written:
    """A model that was written: its card, its method, the metrics of its card, its files (the card's first)."""

    card: Path
    method: str
    metrics: Mapping[str, float]
    files: tuple[Path, ...]

    def plain(self) -> dict[str, Any]:
        """As JSON holds it."""
        told: dict[str, Any] = plain_values(self)
        return told


def write_trained(
    folder: Path, write: Callable[[Path], Path], history: Sequence[Epoch], last: bool = False
) -> tuple[Path, ...]:
    """Write a model, and the epochs of its training as a table and as a picture; return its files, the card first.

    `write` writes card and numbers into the folder and returns the card's path. The learning curve of an older model of
    this name is removed. `last`: the last epoch is the one that was kept, not the best. Raises what `write` raises.
    """
    folder.mkdir(parents=True, exist_ok=True)
    card = write(folder)
    files = (card, card.with_suffix(".safetensors"))
    remove_history(folder, card.stem)
    if not history:
        return files
    from palpate.modeling.training.learning_curve import save_learning_curve

    table = write_history(history, folder / f"{card.stem}.history.csv")
    return (*files, table, *save_learning_curve({"": history}, folder, f"{card.stem}.history", last))
