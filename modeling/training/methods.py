"""Options of a fit and learning methods, as doors, textures and attributes share them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Generic, TypeVar

from palpate.modeling.training.settings import Settings
from palpate.protocols.progress import Report, silent

WISHES = ("epochs", "batch", "threads", "checkpoint", "stop_patience", "learning_rate")
"""Names of a caller's settings that override those of a network's training."""
LearningT = TypeVar("LearningT")
FittedT = TypeVar("FittedT")


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """Options of a fit; each domain's subclass adds the data.

    `settings`, by name: those of `WISHES`, `quick`, and a method's own; unknown ones are ignored.
    """

    seed: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)
    report: Report = silent

    def training_settings(self, default: Settings, quick_epochs: int) -> Settings:
        """Return a method's settings, overridden by the caller's.

        `quick` trains for at most `quick_epochs` where no number is given. Raises TrainingError for an invalid value.
        """
        overrides: dict[str, Any] = {}
        if self.settings.get("quick"):
            overrides["epochs"] = min(default.epochs, quick_epochs)
        overrides |= {name: self.settings[name] for name in WISHES if name in self.settings}
        return replace(default, seed=self.seed, **overrides)


@dataclass(frozen=True)
class MethodOf(Generic[LearningT, FittedT]):
    """A learning method: `fit` returns the fitted model, `source` is the publication it comes from."""

    name: str
    title: str
    fit: Callable[[LearningT], FittedT]
    source: str = field(default="", kw_only=True)
