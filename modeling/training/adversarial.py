"""Two networks trained against each other (Goodfellow et al. 2014), by the loop that trains one.

The generator makes samples; the critic tells them from real ones. Both are parts of one network, so checkpoints, early
stopping and the choice of the best weights work as for any network. The watched loss is the caller's: how far samples
for held-out conditions lie from real ones. The adversaries' own losses do not measure that.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.autograd import backward
from torch.nn import functional
from torch.optim import Adam, Optimizer

from palpate.modeling.training.refusals import TrainingError
from palpate.modeling.training.seeding import batch_chance, order
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import Source
from palpate.modeling.training.steps import Loss, batches, number, refuse_gradient


class Adversaries(nn.Module):
    """A generator, (condition, noise) to samples, and its critic, (condition, samples) to one number per row.

    Its source gives (condition, noise) as inputs and real samples as targets. Its output is the generator's.
    """

    def __init__(self, generator: nn.Module, critic: nn.Module) -> None:
        super().__init__()
        self.generator, self.critic = generator, critic

    def forward(self, condition: Tensor, noise: Tensor) -> Tensor:
        """Return the generator's samples, one per row."""
        result: Tensor = self.generator(condition, noise)
        return result


def two_adams(parameters: list[nn.Parameter], rate: float) -> Optimizer:
    """Return one Adam for both networks: it has a state per weight and skips weights without a gradient.

    Betas are 0.5 and 0.99: with more momentum the two networks oscillate (Radford et al. 2016).
    """
    return Adam(parameters, lr=rate, betas=(0.5, 0.99), fused=True)


@dataclass(frozen=True)
class Adversarial:
    """An epoch of both networks: for each batch a step of the critic, then a step of the generator.

    Losses are logistic, the generator's non-saturating (Goodfellow et al. 2014). `penalty` multiplies the mean squared
    gradient of the critic at real samples (R1, Mescheder et al. 2018); without it the training need not converge.
    """

    penalty: float = 0.5

    def __call__(
        self, network: nn.Module, optimiser: Optimizer, data: Source, loss: Loss, settings: Settings, epoch: int
    ) -> float:
        """Train for one epoch; return the mean of `loss` between samples and real rows, which is not trained on.

        Raises TrainingError, before the optimiser's step, for a loss or gradient that is not finite.
        """
        if not isinstance(network, Adversaries):
            raise TrainingError(f"{type(network).__name__} is not a generator with a critic (Adversaries).")
        network.train()
        chance, total = batch_chance(settings.seed, epoch), 0.0
        for batch, rows in enumerate(batches(order(settings.seed, epoch, len(data)), settings.batch), 1):
            inputs, real = data.batch(rows, chance)
            if not isinstance(inputs, tuple) or len(inputs) != 2:
                raise TrainingError("a generator's source gives two inputs: condition and noise.")
            condition, noise = inputs
            samples = network(condition, noise)
            critic_loss = self._critic_loss(network.critic, condition, torch.as_tensor(real), samples.detach())
            _step(network.critic, optimiser, critic_loss, epoch, batch)
            generator_loss = functional.softplus(-network.critic(condition, samples)).mean()
            _step(network.generator, optimiser, generator_loss, epoch, batch)
            total += number(loss(samples.detach(), real), epoch, batch) * len(rows)
        return total / len(data)

    def _critic_loss(self, critic: nn.Module, condition: Tensor, real: Tensor, samples: Tensor) -> Tensor:
        """Return the critic's logistic loss with its gradient penalty."""
        real = real.detach().requires_grad_()
        score = critic(condition, real)
        (gradient,) = torch.autograd.grad(score.sum(), real, create_graph=True)
        squared_gradient = gradient.flatten(1).square().sum(dim=1).mean()
        logistic = functional.softplus(-score).mean() + functional.softplus(critic(condition, samples)).mean()
        result: Tensor = logistic + self.penalty * squared_gradient
        return result


def _step(part: nn.Module, optimiser: Optimizer, loss: Tensor, epoch: int, batch: int) -> None:
    """Take one step that changes only this network's weights."""
    number(loss, epoch, batch)
    weights = list(part.parameters())
    optimiser.zero_grad(set_to_none=True)
    backward(loss, inputs=weights)
    refuse_gradient(weights, epoch, batch)
    optimiser.step()


def energy_distance(samples: Tensor, real: Tensor) -> Tensor:
    """Return the energy distance of two samples, (n, ...) each, row i of both under one condition.

    2 E|sample - real| - E|sample - sample'| - E|real - real'| over different rows (Szekely and Rizzo 2013), so that two
    samples of one distribution are 0 apart on average. A single row gives 0.
    """
    rows, others = samples.flatten(1), real.flatten(1)
    count = len(rows)
    if count < 2:
        return rows.new_zeros(())
    distances = 2 * torch.cdist(rows, others) - torch.cdist(rows, rows) - torch.cdist(others, others)
    result: Tensor = (distances.sum() - distances.diagonal().sum()) / (count * (count - 1))
    return result
