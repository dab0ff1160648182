"""Methods that predict attributes: their data, their predictions, and how networks are trained on rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

from numpy.typing import NDArray

from palpate.modeling.attributes.material import SIGHT, TOUCH, MaterialError, Modality, Pair, Texture
from palpate.modeling.training.methods import FitOptions, MethodOf
from palpate.modeling.training.settings import Settings
from palpate.signals.arrays import Array

BOTH: frozenset[Modality] = frozenset(("touch", "sight"))
ROW_SETTINGS = Settings(
    epochs=200, batch=32, learning_rate=1e-3, plateau_patience=None, stop_patience=10, every_epochs=10
)
"""Epochs, Adam and patience of thesis 3.5.3; batch and rate are our choice (the rate is Keras' default for Adam)."""
CONVOLVED = replace(ROW_SETTINGS, epochs=100, batch=16, learning_rate=3e-4)
"""Settings of the convolutional networks. At a rate of 1e-3 the first steps silence their dense layer, which has
thousands of inputs, none below 0. Half of the thesis' epochs limit the time; on synthetic textures training stopped
between the 13th and the 66th epoch."""


@dataclass(frozen=True)
class Learning(FitOptions):
    """The data and options of one fit.

    `train` are textures to learn from, `held` others that a network watches to stop early (empty for a method that does
    not); all are rated. `touch` and `sight` are the kinds of features. `settings` may also have early_stopping.
    """

    train: tuple[Texture, ...]
    held: tuple[Texture, ...]
    attributes: tuple[Pair, ...]
    touch: tuple[str, ...] = TOUCH
    sight: tuple[str, ...] = SIGHT


class Fitted(Protocol):
    """A fitted method.

    A network also has `trained` (palpate.modeling.training.loop.Trained). A method that is faster with many textures at
    once has `predict_all`, which returns a list with what `predict` returns or raises for each texture.
    """

    def predict(self, texture: Texture) -> Array:
        """Return predictions (n, attributes) on 0..100, not clipped, a row for each segment, picture or pair of them.

        The texture's prediction is their mean. Raises MaterialError for features that it was not fitted to.
        """


@dataclass(frozen=True)
class Method(MethodOf[Learning, Fitted]):
    """A method that predicts attributes. `sees`: its modalities; `holds_out`: whether it watches held textures;
    `may_hold`: whether it does with the setting `early_stopping`.

    `restore` returns the fitted method from the arrays and plain values of `saved()`; None where it cannot be saved.
    """

    sees: frozenset[Modality] = BOTH
    holds_out: bool = False
    may_hold: bool = False
    restore: Callable[[Mapping[str, NDArray[Any]], Mapping[str, Any]], Fitted] | None = None

    def holds(self, settings: Mapping[str, Any]) -> bool:
        """Return whether it watches held textures with these settings."""
        return self.holds_out or (self.may_hold and bool(settings.get("early_stopping")))

    @property
    def in_epochs(self) -> bool:
        """Whether it is trained in epochs."""
        return self.holds_out or self.may_hold


def predictions(fitted: Fitted, textures: Sequence[Texture]) -> list[Array | MaterialError]:
    """Return the prediction (n, attributes) of each texture, or its error; all at once where the method can."""
    if (predict_all := getattr(fitted, "predict_all", None)) is not None:
        return list(predict_all(textures))
    answers: list[Array | MaterialError] = []
    for texture in textures:
        try:
            answers.append(fitted.predict(texture))
        except MaterialError as error:
            answers.append(error)
    return answers


@dataclass(frozen=True)
class RowPlan:
    """How a network is trained on rows: its modalities in order, and how often an epoch shows each texture.

    Each time the row is a random segment, picture, variant of a picture, or pair of them. With `steps` above 1 touch is
    that many successive segments.
    """

    name: str
    sees: tuple[Modality, ...]
    shows: int
    steps: int = 1
    settings: Settings = ROW_SETTINGS
