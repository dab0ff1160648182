"""The learning rate and the end of a training, as a pure function of the losses so far."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from palpate.modeling.training.settings import Settings

THRESHOLD = 1e-4
"""The share by which a loss must fall to count as an improvement of the plateau, as torch's schedule has it."""


@dataclass(frozen=True)
class Course:
    """Where a training stands after some epochs: the rate of the next one, and which was the best."""

    rate: float
    epochs: int = 0
    best_epoch: int = 0
    best_loss: float = math.inf
    low: float = math.inf
    waited: int = 0

    def after(self, loss: float, settings: Settings) -> Course:
        """The course after one more epoch with this watched loss."""
        epochs = self.epochs + 1
        course = replace(self, epochs=epochs)
        if settings.keep_last or loss < self.best_loss:
            course = replace(course, best_epoch=epochs, best_loss=loss)
        if loss < self.low * (1 - THRESHOLD) if self.low > 0 else loss < self.low:
            return replace(course, low=loss, waited=0)
        return replace(course, waited=self.waited + 1)._lowered(settings)

    def _lowered(self, settings: Settings) -> Course:
        if settings.plateau_patience is None or self.waited <= settings.plateau_patience:
            return self
        return replace(self, rate=max(self.rate * settings.plateau_factor, settings.least_rate), waited=0)

    def over(self, settings: Settings) -> bool:
        """Whether early stopping ends the training here."""
        return settings.stop_patience is not None and self.epochs - self.best_epoch > settings.stop_patience

    def ended(self, settings: Settings) -> bool:
        """Whether no further epoch follows."""
        return self.epochs >= settings.epochs or self.over(settings)


def course_of(losses: Iterable[float], settings: Settings) -> Course:
    """The course after these watched losses, one an epoch (Keras and torch call this ReduceLROnPlateau)."""
    course = Course(settings.learning_rate)
    for loss in losses:
        course = course.after(loss, settings)
    return course
