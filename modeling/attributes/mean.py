"""The mean of the textures that were learned from, whatever is asked about: what every other method has to beat."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from palpate.modeling.attributes.learnable import textures_of
from palpate.modeling.attributes.material import Texture
from palpate.modeling.attributes.methods import Learning, Method
from palpate.signals.arrays import Array


@dataclass(frozen=True)
class Mean:
    """The same for all."""

    mean: Array

    def predict(self, _texture: Texture) -> Array:
        """(1, attributes) on 0..100."""
        return self.mean[None].copy()

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Arrays and what is told of them, for `restored`."""
        return {"mean": self.mean}, {"method": MEAN.name}


def fit(learning: Learning) -> Mean:
    """The mean rating of each attribute, each texture counted once."""
    _, ratings = textures_of(learning, least=1)
    return Mean(ratings.mean(axis=0))


def restored(tensors: Mapping[str, NDArray[Any]], _told: Mapping[str, Any]) -> Mean:
    """What `saved` gave, fitted again."""
    return Mean(tensors["mean"])


MEAN = Method(
    "mean", "Mean of the training textures", fit, sees=frozenset(), source="the reference of R2", restore=restored
)
