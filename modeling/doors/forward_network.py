"""Prediction of ratings from force: the residual network of thesis 5.4, trained as there, and a small dense one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.doors.networks import (
    QUICK_EPOCHS,
    ForceToPerception,
    Rescale,
    answers,
    exported_network,
    training_rows,
)
from palpate.modeling.doors.preparing import TrainingRows, checked_forces
from palpate.modeling.files.model_files import Exported
from palpate.modeling.training.loop import Trained, train
from palpate.modeling.training.seeding import seeded
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import Pairs, pairs
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS

DELTA = 2.0
"""The error at which equation 5.4 changes from quadratic to linear, on 0..100."""
SETTINGS = Settings(
    epochs=200, batch=8, learning_rate=1e-3, least_rate=1e-6, plateau_patience=4, stop_patience=12, every_epochs=5
)
"""Settings of thesis 5.4.1.4; the learning rate is Keras' for Adam; patiences and early stopping are our choice."""
LITERAL_SETTINGS = replace(SETTINGS, stop_patience=None, keep_last=True)
"""The thesis to the letter: all 200 epochs, and the weights after the last. Held-out rows only lower the rate."""
DENSE_HIDDEN = (64, 32)
DENSE_DROPOUT = 0.1
DENSE_SETTINGS = Settings(
    epochs=200, batch=8, learning_rate=1e-3, least_rate=1e-6, plateau_patience=6, stop_patience=20, every_epochs=50
)


@dataclass(frozen=True)
class FittedForward:
    """A trained network from forces in newtons to ratings on 0..100, and its training."""

    network: nn.Sequential
    trained: Trained

    def predict(self, given: Array) -> Array:
        """Return ratings (n, attributes) on 0..100 of profiles (n, 621) in newtons.

        Raises ModelDataError on invalid profiles.
        """
        return answers(self.network, checked_forces(given))

    def exported(self) -> Exported:
        """Return the network as steps and float32 tensors."""
        return exported_network(self.network)


def fit_network(learning: Learning, inner: Callable[[int], nn.Module], settings: Settings) -> FittedForward:
    """Train a network (batch, 621) to (batch, attributes), both centred, by the Huber loss of equation 5.4.

    The first layer centres newtons, the last one scales its answers to 0..100, where the loss is computed. The thesis'
    scaling of the forces to 0..100 is a gain and an offset, like centring: the two are one layer. Raises ModelDataError
    for data that cannot be learned from, TrainingError for a training that does not converge.
    """
    rows, held = training_rows(learning)
    chosen = learning.training_settings(settings, QUICK_EPOCHS)
    attributes = len(learning.train.attributes)
    network = nn.Sequential(
        Rescale.down(rows.force_N), seeded(lambda: inner(attributes), chosen.seed), Rescale.up(rows.rating)
    )
    watched = None if held is None else _pairs(held)
    trained = train(network, _pairs(rows), watched, huber, chosen, report=learning.report)
    return FittedForward(network, trained)


def huber(answer: Tensor, target: Tensor) -> Tensor:
    """Return the loss of equation 5.4 with a delta of 2 on 0..100, the mean over rows and attributes."""
    return functional.huber_loss(answer, target, delta=DELTA)


def _pairs(rows: TrainingRows) -> Pairs:
    return pairs(rows.force_N, rows.rating)


NETWORK = Method(
    name="network",
    title="Residual convolutional network",
    fit=partial(fit_network, inner=ForceToPerception, settings=SETTINGS),
    holds_out=True,
    source="thesis 5.4",
)
NETWORK_THESIS = Method(
    name="network_thesis",
    title="Residual convolutional network, to the letter",
    fit=partial(fit_network, inner=ForceToPerception, settings=LITERAL_SETTINGS),
    holds_out=True,
    source="thesis 5.4, all 200 epochs, weights of the last",
)


def dense(attributes: int) -> nn.Sequential:
    """Return a network from (batch, 621) to (batch, attributes) with hidden layers of 64 and 32."""
    first, second = DENSE_HIDDEN
    return nn.Sequential(
        nn.Linear(POINTS, first), nn.ReLU(), nn.Dropout(DENSE_DROPOUT),
        nn.Linear(first, second), nn.ReLU(), nn.Linear(second, attributes),
    )  # fmt: skip


MLP = Method(
    name="mlp",
    title="Small dense network",
    fit=partial(fit_network, inner=dense, settings=DENSE_SETTINGS),
    holds_out=True,
    source="ours: 621 - 64 - 32 - 7, trained as the network of thesis 5.4",
)
