"""What all ways of learning have in common, whatever they learn: what a caller may ask of a fit, and a method."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

from palpate.modeling.training.settings import Settings
from palpate.protocols.progress import Report, silent

WISHES = ("epochs", "batch", "threads", "checkpoint", "stop_patience", "learning_rate")
"""The settings of a caller that go to a network's training as they are."""
LearningT = TypeVar("LearningT")
FittedT = TypeVar("FittedT")


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """What the caller wants of a fit; each domain adds what is learned from.

    `settings`, by name: those of `WISHES`, `quick`, and what a method reads itself; unknown ones are left alone.
    """

    seed: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)
    report: Report = silent

    def training_settings(self, default: Settings, quick_epochs: int) -> Settings:
        """Return a method's settings with the caller's wishes over them.

        `quick` trains for so many epochs where no number is given. Raises TrainingError for a value without sense.
        """
        wished: dict[str, Any] = {}
        if self.settings.get("quick"):
            wished["epochs"] = min(default.epochs, quick_epochs)
        wished |= {name: self.settings[name] for name in WISHES if name in self.settings}
        return replace(default, seed=self.seed, **wished)


@dataclass(frozen=True)
class MethodOf(Generic[LearningT, FittedT]):
    """A way to learn: `fit` gives the fitted model, `source` is where the way comes from."""

    name: str
    title: str
    fit: Callable[[LearningT], FittedT]
    source: str = field(default="", kw_only=True)
