"""A small dense network over the profile: what one would try before a convolutional one."""

from __future__ import annotations

from torch import nn

from palpate.modeling.doors.forward_network import FeltThrough, fit_network
from palpate.modeling.doors.methods import Learning, Method
from palpate.modeling.training.settings import Settings
from palpate.signals.doors.grid import POINTS

HIDDEN = (64, 32)
DROPOUT = 0.1
SETTINGS = Settings(
    epochs=200, batch=8, learning_rate=1e-3, least_rate=1e-6, plateau_patience=6, stop_patience=20, every_epochs=50
)


def dense(attributes: int) -> nn.Sequential:
    """(batch, 621) to (batch, attributes) through hidden layers of 64 and 32."""
    first, second = HIDDEN
    return nn.Sequential(
        nn.Linear(POINTS, first), nn.ReLU(), nn.Dropout(DROPOUT),
        nn.Linear(first, second), nn.ReLU(), nn.Linear(second, attributes),
    )  # fmt: skip


def _fit(learning: Learning) -> FeltThrough:
    return fit_network(learning, dense, SETTINGS)


MLP = Method(
    name="mlp",
    title="Small dense network",
    fit=_fit,
    holds_out=True,
    source="ours: 621 - 64 - 32 - 7, trained as the network of thesis 5.4",
)
