"""A small training that everything of the trainer shows itself on: dropout, a schedule, held-out rows."""

from __future__ import annotations

import numpy as np
from torch import nn

from palpate.modeling.training.loop import Trained, train
from palpate.modeling.training.seeding import seeded
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import pairs


def rows(count=40, seed=5):
    rng = np.random.default_rng(seed)
    inputs = rng.normal(size=(count, 6))
    return inputs, np.tanh(inputs @ rng.normal(size=(6, 2))) + 0.1 * rng.normal(size=(count, 2))


def network(seed=3):
    return seeded(lambda: nn.Sequential(nn.Linear(6, 12), nn.ReLU(), nn.Dropout(0.2), nn.Linear(12, 2)), seed)


def settings(**other):
    given = {"epochs": 12, "batch": 8, "learning_rate": 0.02, "plateau_patience": 0, "plateau_factor": 0.5}
    return Settings(**{**given, **other})


def trained(model=None, data=None, loss=None, *, report=lambda line: None, clock=lambda: 0.0, **other) -> tuple:
    """(network, Trained) of the small training."""
    model = model or network()
    inputs, targets = data or rows()
    result = train(
        model, pairs(inputs[:30], targets[:30]), pairs(inputs[30:], targets[30:]), loss or nn.HuberLoss(delta=2.0),
        settings(**other), report=report, clock=clock,
    )  # fmt: skip
    return model, result


def the_same(one: tuple, other: tuple) -> bool:
    """Whether two trainings came to the same bits: weights, losses, rates, best epoch."""
    weights = [{name: tensor.numpy().tobytes() for name, tensor in net.state_dict().items()} for net, _ in (one, other)]
    return weights[0] == weights[1] and history_of(one[1]) == history_of(other[1])


def history_of(result: Trained):
    return [(e.epoch, e.learning_rate, e.train_loss, e.held_loss) for e in result.history], result.best_epoch
