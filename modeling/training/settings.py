"""The settings of a training, and its course: the learning rate, the best epoch, and the end.

The course is a pure function of the losses so far."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from palpate.modeling.training.refusals import TrainingError

_NOT_OF_THE_RESULT = ("epochs", "checkpoint", "every_epochs", "stop_patience")
"""Settings that do not change the numbers of an epoch: the end of a training, and its checkpoints."""
THRESHOLD = 1e-4
"""The share by which a loss must fall to end a plateau, as in torch's ReduceLROnPlateau."""


@dataclass(frozen=True)
class Settings:
    """Settings of a training; a patience is in epochs. Raises TrainingError for an invalid value.

    The learning rate starts at `learning_rate` and is multiplied by `plateau_factor` when the watched loss has not
    improved for more than `plateau_patience` epochs (None: never), down to `least_rate`. After more than
    `stop_patience` epochs without a better one the training ends (None: never). With `keep_last` the last epoch counts
    as the best, and the training never ends early. `threads` changes the result, since it changes the order of sums.
    `checkpoint` is a folder; the training is saved there every `every_epochs` epochs.
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
        """The settings that the numbers of an epoch depend on; a checkpoint with others is refused."""
        return {name: value for name, value in asdict(self).items() if name not in _NOT_OF_THE_RESULT}


def _whole(name: str, value: object, least: int) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise TrainingError(f"{name} is {value!r}: expected a whole number, {least} or more.")


@dataclass(frozen=True)
class Course:
    """The course of a training after `epochs` epochs: the rate of the next epoch, and the best one so far.

    `low` is the plateau's lowest loss, `waited` the number of epochs since.
    """

    rate: float
    epochs: int = 0
    best_epoch: int = 0
    best_loss: float = math.inf
    low: float = math.inf
    waited: int = 0

    def after(self, loss: float, settings: Settings) -> Course:
        """Return the course after one more epoch with this watched loss."""
        epochs = self.epochs + 1
        course = replace(self, epochs=epochs)
        if settings.keep_last or loss < self.best_loss:
            course = replace(course, best_epoch=epochs, best_loss=loss)
        if loss < self.low * (1 - THRESHOLD) if self.low > 0 else loss < self.low:
            return replace(course, low=loss, waited=0)
        course = replace(course, waited=self.waited + 1)
        if settings.plateau_patience is None or course.waited <= settings.plateau_patience:
            return course
        return replace(course, rate=max(course.rate * settings.plateau_factor, settings.least_rate), waited=0)

    def over(self, settings: Settings) -> bool:
        """Return whether early stopping ends the training here."""
        return settings.stop_patience is not None and self.epochs - self.best_epoch > settings.stop_patience

    def ended(self, settings: Settings) -> bool:
        """Return whether no further epoch follows."""
        return self.epochs >= settings.epochs or self.over(settings)


def course_of(losses: Iterable[float], settings: Settings) -> Course:
    """Return the course after these watched losses, one per epoch (ReduceLROnPlateau in Keras and torch)."""
    course = Course(settings.learning_rate)
    for loss in losses:
        course = course.after(loss, settings)
    return course
