"""What all ways of predicting attributes have in common: to be fitted to textures, and to be asked about one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from numpy.typing import NDArray

from palpate.modeling.attributes.material import SIGHT, TOUCH, MaterialError, Modality, Pair, Texture
from palpate.modeling.training.methods import FitOptions, MethodOf
from palpate.signals.arrays import Array

BOTH: frozenset[Modality] = frozenset(("touch", "sight"))


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
    it wants that where `early_stopping` is asked for.

    `restore` gives back what `fitted.saved()` gave, from arrays and plain values; None: it cannot be kept as a file.
    """

    sees: frozenset[Modality] = BOTH
    holds_out: bool = False
    may_hold: bool = False
    restore: Callable[[Mapping[str, NDArray[Any]], Mapping[str, Any]], Fitted] | None = None

    def holds(self, settings: Mapping[str, Any]) -> bool:
        """Whether it watches `held` under these settings."""
        return self.holds_out or (self.may_hold and bool(settings.get("early_stopping")))

    @property
    def in_epochs(self) -> bool:
        """Whether it is trained in epochs, which takes long."""
        return self.holds_out or self.may_hold


def predictions(fitted: Fitted, textures: Sequence[Texture]) -> list[Array | MaterialError]:
    """What `predict` says of each texture, or why it says nothing; computed together where the method can."""
    together = getattr(fitted, "predict_all", None)
    return [_said(fitted, each) for each in textures] if together is None else list(together(textures))


def _said(fitted: Fitted, texture: Texture) -> Array | MaterialError:
    try:
        return fitted.predict(texture)
    except MaterialError as error:
        return error
