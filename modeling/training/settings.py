"""How a network is trained: everything that its result depends on, and where it is kept meanwhile."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from palpate.modeling.training.refusals import TrainingError

_NOT_OF_THE_RESULT = ("epochs", "checkpoint", "every_epochs", "stop_patience")
"""Where a training ends and how often it is kept decide nothing about an epoch that both have."""


@dataclass(frozen=True)
class Settings:
    """Of one training; a patience is in epochs. Raises TrainingError for a value that has no meaning.

    The learning rate starts at `learning_rate` and is multiplied by `plateau_factor` when the watched loss has not
    improved for more than `plateau_patience` epochs (None: never), down to `least_rate`. After `stop_patience` epochs
    without a better one the training ends (None: never). `keep_last`: the last epoch counts as the best, and nothing
    ends the training early. `threads` belongs to the result: sums are in another order with another number.
    `checkpoint` is a folder; a training is kept there every `every_epochs` epochs.
    """

    epochs: int = 200
    batch: int = 8
    learning_rate: float = 1e-3
    least_rate: float = 1e-6
    plateau_patience: int | None = 10
    plateau_factor: float = 0.5
    stop_patience: int | None = None
    keep_last: bool = False
    seed: int = 0
    threads: int = 1
    checkpoint: Path | None = None
    every_epochs: int = 1

    def __post_init__(self) -> None:
        for name, least in (("epochs", 1), ("batch", 1), ("seed", 0), ("threads", 1), ("every_epochs", 1)):
            _whole(name, getattr(self, name), least)
        for name in ("plateau_patience", "stop_patience"):
            if getattr(self, name) is not None:
                _whole(name, getattr(self, name), 0)
        if not 0 < self.least_rate <= self.learning_rate < math.inf:
            raise TrainingError(f"learning_rate is {self.learning_rate}: from least_rate ({self.least_rate}) up.")
        if not 0 < self.plateau_factor < 1:
            raise TrainingError(f"plateau_factor is {self.plateau_factor}: expected between 0 and 1.")

    @property
    def of_the_result(self) -> dict[str, Any]:
        """What decides the numbers of every epoch; a checkpoint of a training where one differs is refused."""
        return {name: value for name, value in asdict(self).items() if name not in _NOT_OF_THE_RESULT}


def _whole(name: str, value: object, least: int) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise TrainingError(f"{name} is {value!r}: expected a whole number, {least} or more.")
