"""Ratings to force by the network of thesis 5.6: an encoder of its own, and the forward network's decoder, frozen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import torch
from torch import nn
from torch.nn.functional import mse_loss

from palpate.modeling.doors.data import TOP, Scaling
from palpate.modeling.doors.forward_network import FittedForward
from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.networks import (
    ATTRIBUTES,
    ForceToPerception,
    PerceptionToForce,
    Rescale,
    answers,
    exported_network,
    training_rows,
)
from palpate.modeling.doors.preparing import PLAYABLE, TrainingRows, checked_wishes
from palpate.modeling.evaluate.rows import ModelDataError
from palpate.modeling.files.model_files import Exported
from palpate.modeling.training.loop import Trained, train
from palpate.modeling.training.seeding import seeded, training_state
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import Pairs, pairs
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS
from palpate.signals.doors.limits import bounded_profiles
from palpate.signals.models.card import Affine

SETTINGS = Settings(
    epochs=200, batch=8, learning_rate=1e-4, least_rate=1e-6, plateau_patience=None, stop_patience=6, every_epochs=10
)
"""Settings of thesis 5.6.1.1; the patience is our choice. A checkpoint has 670 MB, hence only every tenth epoch."""
QUICK_EPOCHS = 2


@dataclass(frozen=True)
class FittedInverse:
    """A trained network from ratings on 0..100 to forces on 0..100, the scaling to newtons, and its training."""

    network: nn.Sequential
    scaling: Scaling
    trained: Trained

    def predict(self, given: Array) -> Array:
        """Return profiles (n, 621) in newtons, within the limits, of ratings (n, 7) on 0..100."""
        scaled = answers(self.network, checked_wishes(given, ATTRIBUTES))
        return bounded_profiles(self.scaling.force_down(scaled))

    def exported(self) -> Exported:
        """Return the network as steps and float32 tensors, followed by the scaling to newtons and the limits."""
        low, high = self.scaling.force_N
        newtons = Affine(gain=(high - low) / TOP, offset=low)
        return exported_network(self.network, newtons, PLAYABLE)


def fit(learning: Learning, settings: Settings = SETTINGS) -> FittedInverse:
    """Train the encoder and the last dense layer; the decoder is the trained forward network's, unchanged.

    The first layer centres ratings, the last one scales forces to 0..100, where the squared error is computed. The
    decoder starts with latents of the usual size: see `_hand_over`. Raises ModelDataError for data that cannot be
    learned from or without the forward network, TrainingError for a training that does not converge.
    """
    forward = learning.forward
    if not (isinstance(forward, FittedForward) and isinstance(forward.network[1], ForceToPerception)):
        raise ModelDataError("the inverse network builds on the decoder of a trained forward network: none was given.")
    rows, held = training_rows(learning)
    if (attributes := rows.rating.shape[1]) != ATTRIBUTES:
        raise ModelDataError(f"the network of thesis 5.6 takes {ATTRIBUTES} ratings, this study has {attributes}.")
    chosen = learning.training_settings(settings, QUICK_EPOCHS)
    inner = seeded(lambda: PerceptionToForce(_inner(forward).decoder), chosen.seed)
    scaled = learning.scaling.force_up(rows.force_N)
    network = nn.Sequential(Rescale.down(rows.rating), inner, Rescale.up(scaled))
    _hand_over(network, forward, rows)
    watched = None if held is None else _pairs(held, learning.scaling)
    trained = train(network, _pairs(rows, learning.scaling), watched, mse_loss, chosen, report=learning.report)
    return FittedInverse(network, learning.scaling, trained)


def _inner(forward: FittedForward) -> ForceToPerception:
    return cast(ForceToPerception, forward.network[1])


def _hand_over(network: nn.Sequential, forward: FittedForward, rows: TrainingRows) -> None:
    """Give the encoder's latents the mean and SD of the forward network's latents of the training profiles.

    The frozen decoder was trained on these. With torch's initialisation the latents vary twenty times less, and the
    network makes the same profile for every wish in the first epochs. After Mishkin and Matas 2016 (LSUV).
    """
    inner = cast(PerceptionToForce, network[1])
    with training_state(0, 1), torch.no_grad():
        into = nn.Sequential(network[0], nn.Unflatten(1, (1, ATTRIBUTES)), inner.encoder, inner.project)
        known = nn.Sequential(forward.network[0], nn.Unflatten(1, (1, POINTS)), _inner(forward).encoder, nn.Flatten())
        mine, theirs = torch.as_tensor(answers(into, rows.rating)), torch.as_tensor(answers(known, rows.force_N))
        spread = [float((latent - latent.mean(dim=0)).pow(2).mean().sqrt()) for latent in (mine, theirs)]
        gain = spread[1] / spread[0] if min(spread) > 0 else 1.0
        inner.project.bias.add_(theirs.mean(dim=0) / gain - mine.mean(dim=0)).mul_(gain)
        inner.project.weight.mul_(gain)


def _pairs(rows: TrainingRows, scaling: Scaling) -> Pairs:
    return pairs(rows.rating, scaling.force_up(rows.force_N))


INVERSE_NETWORK = Method(
    name="network",
    title="Convolutional network with a transferred decoder",
    fit=fit,
    holds_out=True,
    needs_forward="network",
    source="thesis 5.6",
)
