"""Fitting the visuo-tactile network, or one of its halves, to textures, and asking it about one (thesis 3.5.3)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from palpate.modeling.attributes.learnable import textures_of
from palpate.modeling.attributes.material import MaterialError, Modality, Texture, ratings_of
from palpate.modeling.attributes.methods import Learning
from palpate.modeling.attributes.network_rows import Look, Shown, Target, drawn, look_of, shown, spread_out, target_of
from palpate.modeling.attributes.network_saved import arrays_of, load_into, looks_in, target_in, told_of
from palpate.modeling.attributes.visuo_tactile import VisuoTactile, rmse
from palpate.modeling.training.loop import Trained, adam, train
from palpate.modeling.training.optimisers import cosine
from palpate.modeling.training.seeding import seeded, training_state
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import Made
from palpate.signals.arrays import Array

SETTINGS = Settings(epochs=30, batch=2, learning_rate=5e-4, plateau_patience=None, stop_patience=10, every_epochs=5)
"""The thesis has at most 200 epochs, which would take a fold ten to twenty minutes; in 30 the rate falls along a cosine
to nearly nothing, so that stopping there is no accident (22 are too few: docs/reference/attribute-models.md). Adam, and
a patience of 10 where textures are watched, are the thesis', batch and rate ours."""
LITERAL_SETTINGS = replace(SETTINGS, epochs=200, learning_rate=1e-3)
"""Thesis 3.5.3: 200 epochs at most, ended after more than 10 without a better one, Adam. The rate is Keras' own and
stays as it is; the batch, which the thesis does not give, is ours."""
QUICK_EPOCHS = 2
SEGMENTS = 2
"""Segments that a picture is shown with each time: HV-Net costs nine times what HT-Net does."""
HELD_PICTURES, HELD_SEGMENTS = 2, 8
"""What is looked at of each texture that is watched."""
PICTURES_AT_ONCE, SEGMENTS_AT_ONCE = 8, 64


@dataclass(frozen=True)
class FittedNetwork:
    """A trained network, how it sees features and scales ratings, and how its training went."""

    network: VisuoTactile
    sight: Look | None
    touch: Look | None
    target: Target
    trained: Trained | None = None

    def predict(self, texture: Texture) -> Array:
        """(n, attributes) on 0..100, not clipped; n is the greater of its segments and pictures.

        Every segment and every picture is looked at once: segment i goes with picture i, and where one of them ends
        before the other it begins anew. Raises MaterialError for features that it was not fitted to.
        """
        (found,) = self.predict_all([texture])
        if isinstance(found, MaterialError):
            raise found
        return found

    def predict_all(self, textures: Sequence[Texture]) -> list[Array | MaterialError]:
        """What `predict` says or raises of each, computed together: of short textures several times as fast."""
        seen = [self._shown(each) for each in textures]
        whole = [each for each in seen if isinstance(each, Shown)]
        with training_state(0, 1), torch.no_grad():
            self.network.eval()
            scaled = iter(_answers(self.network, whole) if whole else [])
        told = zip(textures, seen, strict=True)
        return [self._told(each.id, next(scaled)) if isinstance(one, Shown) else one for each, one in told]

    def _shown(self, texture: Texture) -> Shown | MaterialError:
        try:
            return shown(texture, self.sight, self.touch)
        except MaterialError as lacking:
            return lacking

    def _told(self, name: str, scaled: Tensor) -> Array | MaterialError:
        found = self.target.up(scaled.numpy().astype(np.float64))
        return found if np.isfinite(found).all() else MaterialError(f"{name}: the network's answer is not finite.")

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Arrays (weights, standardisation, scale of the ratings) and plain values, for `restored`."""
        looks = [look for look in (self.sight, self.touch) if look is not None]
        literal = {"literal": True} if self.network.literal else {}
        return arrays_of(self.network, looks, self.target), {"looks": told_of(looks), **literal}


def fit(learning: Learning, sees: frozenset[Modality], literal: bool = False) -> FittedNetwork:
    """Train a network that looks at the learning's features of `sees`.

    An epoch shows each texture once, with one of its pictures (or of their variants) and some of its segments; others
    every time. The last epoch is kept; where textures are held, that with the lowest RMSE on them. `literal` as for
    `VisuoTactile`, trained at a rate that stays as it is (`LITERAL_SETTINGS`). Raises MaterialError for textures that
    cannot be learned from, TrainingError for a training that does not converge.
    """
    textures, ratings = textures_of(learning)
    sight = look_of(textures, "sight", learning.sight) if "sight" in sees else None
    touch = look_of(textures, "touch", learning.touch) if "touch" in sees else None
    target = target_of(textures)
    settings = LITERAL_SETTINGS if literal else SETTINGS
    asked = learning.training_settings(settings, QUICK_EPOCHS)
    network = _network(sight, touch, target, asked.seed, literal)
    data = drawn([shown(each, sight, touch, variants=True) for each in textures], target.down(ratings), SEGMENTS)
    held = _watched(learning.held, sight, touch, target)
    asked = replace(asked, keep_last=held is None)
    steps = asked.epochs * math.ceil(len(data) / asked.batch)
    optimiser = adam if literal else cosine(steps)
    trained = train(network, data, held, rmse, asked, optimiser=optimiser, report=learning.report)
    return FittedNetwork(network, sight, touch, target, trained)


def restored(arrays: Mapping[str, NDArray[Any]], told: Mapping[str, Any]) -> FittedNetwork:
    """What `FittedNetwork.saved` gave, to be asked again; it answers to the bit as before.

    Raises MaterialError where the arrays are not those of such a network.
    """
    try:
        looks = {look.modality: look for look in looks_in(arrays, told["looks"])}
        target = target_in(arrays)
        literal = bool(told.get("literal", False))
        network = _network(looks.get("sight"), looks.get("touch"), target, 0, literal)
        load_into(network, arrays)
    except (KeyError, RuntimeError, TypeError, ValueError) as error:
        raise MaterialError(f"these are not the numbers of a visuo-tactile network: {error}") from error
    return FittedNetwork(network.eval(), looks.get("sight"), looks.get("touch"), target)


def _network(sight: Look | None, touch: Look | None, target: Target, seed: int, literal: bool = False) -> VisuoTactile:
    """With fresh weights; on one thread, since orthogonal ones are a product of sums."""
    length = None if sight is None else len(sight.mean)
    channels = None if touch is None else touch.channels
    with training_state(seed, 1):
        return seeded(lambda: VisuoTactile(length, channels, len(target.mean), literal), seed)


def _watched(held: Sequence[Texture], sight: Look | None, touch: Look | None, target: Target) -> Made | None:
    if not held:
        return None
    textures = [shown(each, sight, touch) for each in sorted(held, key=lambda each: each.id)]
    ratings = ratings_of(sorted(held, key=lambda each: each.id))
    return spread_out(textures, target.down(ratings), HELD_PICTURES, HELD_SEGMENTS)


def _answers(network: VisuoTactile, textures: Sequence[Shown]) -> list[Tensor]:
    """Scaled attributes (n, attributes) of each: every picture and every segment goes through its branch once."""
    branches = []
    if network.sight is not None:
        seen = [each.sight for each in textures if each.sight is not None]
        branches.append(_through(network.sight.looked, seen, PICTURES_AT_ONCE))
    if network.touch is not None:
        felt = [each.touch for each in textures if each.touch is not None]
        branches.append(_through(network.touch, felt, SEGMENTS_AT_ONCE))
    return [_paired(network, parts) for parts in zip(*branches, strict=True)]


def _through(branch: Callable[[Tensor], Tensor], rows: Sequence[Tensor], at_once: int) -> tuple[Tensor, ...]:
    """What a branch says of the rows of each texture, so many at once."""
    found = torch.cat([branch(part) for part in torch.split(torch.cat(list(rows)), at_once)])
    parts: tuple[Tensor, ...] = torch.split(found, [len(each) for each in rows])
    return parts


def _paired(network: VisuoTactile, parts: Sequence[Tensor]) -> Tensor:
    """One texture's (n, attributes): the shorter of pictures and segments begins anew where it ends."""
    rows = torch.arange(max(len(each) for each in parts))
    return network.head([each[rows % len(each)][:, None] for each in parts])[:, 0]
