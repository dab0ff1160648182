"""The data that door models are trained on: a force profile and mean ratings for each stimulus."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from palpate.signals.arrays import Array, Indices


class ModelDataError(ValueError):
    """Data that no model can be trained on or asked about: the message says where, what was found, what is expected."""


@dataclass(frozen=True)
class DoorData:
    """One row for each stimulus.

    `force_N` is (n, 621), in newtons over 0..62 degrees; `rating` (n, attributes) the mean over raters on the study's
    scale, from `scale[0]` (the attribute's own word) to `scale[1]` (its antonym); `sd` the SD between raters, NaN where
    it is not known (one rater, or a table without it); `raters` (n,) how many there were, the fewest where attributes
    differ, 0 where it is not known. `source` names what a stimulus was made from: stimuli of one source never lie on
    both sides of a split. `groups` (n,) names the people who rated it (one group of raters rates some of the stimuli).
    """

    attributes: tuple[str, ...]
    antonyms: tuple[str, ...]
    scale: tuple[float, float]
    ids: tuple[str, ...]
    doors: tuple[str, ...]
    variants: tuple[str, ...]
    source: tuple[str, ...]
    groups: tuple[str, ...]
    force_N: Array
    rating: Array
    sd: Array
    raters: Indices
    simulated: bool
    made_from: tuple[str, ...] = ()
    """What the data came from: files and their SHA-256, one line each."""

    def __len__(self) -> int:
        return len(self.ids)

    def rows(self, which: Indices) -> Self:
        """The same data with these rows only, in this order."""
        picked: dict[str, Any] = {name: tuple(getattr(self, name)[i] for i in which) for name in _NAMES}
        picked |= {name: getattr(self, name)[which] for name in _ARRAYS}
        return replace(self, **picked)

    @property
    def digest(self) -> str:
        """SHA-256 over everything that a model can learn from."""
        found = hashlib.sha256("\x1f".join((*self.attributes, *self.ids, *self.source)).encode())
        for array in (self.force_N, self.rating, np.asarray(self.scale, dtype=np.float64)):
            found.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
        return found.hexdigest()


_NAMES = ("ids", "doors", "variants", "source", "groups")
_ARRAYS = ("force_N", "rating", "sd", "raters")
