"""What all methods have in common: what they learn from, what a fitted one answers, how networks are shown textures."""

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
"""Epochs, Adam and patience of thesis 3.5.3; batch and rate are ours (the rate is that of Adam in Keras)."""
CONVOLVED = replace(ROW_SETTINGS, epochs=100, batch=16, learning_rate=3e-4)
"""Of the networks that convolve. At a rate of 1e-3 the first steps switch off their dense layer: it is given thousands
of numbers, none below 0. Half of the thesis' epochs bound the time; on made-up textures they stopped between the
13th and the 66th."""


@dataclass(frozen=True)
class Learning(FitOptions):
    """What a method may learn from in one fit.

    `train` are textures to learn from, `held` others that a network watches to stop early (empty where the method does
    not ask for them); all rated. `touch` and `sight` name the features to be looked at. Among `settings` also
    early_stopping.
    """

    train: tuple[Texture, ...]
    held: tuple[Texture, ...]
    attributes: tuple[Pair, ...]
    touch: tuple[str, ...] = TOUCH
    sight: tuple[str, ...] = SIGHT


class Fitted(Protocol):
    """A fitted method.

    One that was trained in epochs also has `trained` (palpate.modeling.training.loop.Trained); one that is faster with
    many textures at once has `predict_all`, from textures to a list of what `predict` says or raises.
    """

    def predict(self, texture: Texture) -> Array:
        """(n, attributes) on 0..100, not clipped: one row for each of its segments, pictures or pairs of them; the
        texture's prediction is their mean. Raises MaterialError for features that it was not fitted to."""


@dataclass(frozen=True)
class Method(MethodOf[Learning, Fitted]):
    """A way to predict attributes. `sees`: what it looks at; `holds_out`: whether it wants `held`; `may_hold`: whether
    it does so with the setting `early_stopping`.

    `restore` gives back what `fitted.saved()` gave, from arrays and plain values; None: it cannot be saved as a file.
    """

    sees: frozenset[Modality] = BOTH
    holds_out: bool = False
    may_hold: bool = False
    restore: Callable[[Mapping[str, NDArray[Any]], Mapping[str, Any]], Fitted] | None = None

    def holds(self, settings: Mapping[str, Any]) -> bool:
        """Return whether it watches `held` under these settings."""
        return self.holds_out or (self.may_hold and bool(settings.get("early_stopping")))

    @property
    def in_epochs(self) -> bool:
        """Whether it is trained in epochs, which takes long."""
        return self.holds_out or self.may_hold


def predictions(fitted: Fitted, textures: Sequence[Texture]) -> list[Array | MaterialError]:
    """Return the prediction of each texture, or the error that refuses it; computed together where the method can."""
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
    """`sees` in the order in which the network takes it; `shows`: how often an epoch shows each texture.

    Each time it is another of its segments, or pictures and variants of them, or a pair, drawn by the seed. With
    `steps` the touch is so many successive segments.
    """

    name: str
    sees: tuple[Modality, ...]
    shows: int
    steps: int = 1
    settings: Settings = ROW_SETTINGS
