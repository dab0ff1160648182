"""Two networks trained against each other (Goodfellow et al. 2014), by the loop that trains one.

The generator makes, the critic tells what was made from what is real. Both are the parts of one network, so that
checkpoints, early stopping and the best weights are those of every training. The watched loss is the caller's: how far
what is made for held-out conditions lies from what is real; the adversaries' own losses say nothing about that.
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
    """A generator, (condition, noise) to what is made, and its critic, (condition, made or real) to one number a row.

    Its source gives (condition, noise) as inputs and what is real as targets; it answers as the generator does.
    """

    def __init__(self, generator: nn.Module, critic: nn.Module) -> None:
        super().__init__()
        self.generator, self.critic = generator, critic

    def forward(self, condition: Tensor, noise: Tensor) -> Tensor:
        """Return what the generator makes."""
        result: Tensor = self.generator(condition, noise)
        return result


def two_adams(parameters: list[nn.Parameter], rate: float) -> Optimizer:
    """Return an Adam for each network: it remembers each weight by itself and passes over those without a gradient.

    Betas of 0.5 and 0.99: with more momentum the two run in circles (Radford et al. 2016).
    """
    return Adam(parameters, lr=rate, betas=(0.5, 0.99), fused=True)


@dataclass(frozen=True)
class Adversarial:
    """An epoch of both: for each batch a step of the critic, then one of the generator.

    Logistic losses, the generator's not saturating (Goodfellow et al. 2014); `penalty` is half the weight of the
    critic's squared gradient at what is real, without which the two need not settle (R1, Mescheder et al. 2018).
    """

    penalty: float = 0.5

    def __call__(
        self, network: nn.Module, optimiser: Optimizer, data: Source, loss: Loss, settings: Settings, epoch: int
    ) -> float:
        """Return the mean of `loss` between what was made and what is real over the epoch's rows; it is only looked at.

        Raises TrainingError, before the step that it would spoil, for a loss or gradient that is not finite.
        """
        if not isinstance(network, Adversaries):
            raise TrainingError(f"{type(network).__name__} is not a generator with a critic (Adversaries).")
        network.train()
        chance, total = batch_chance(settings.seed, epoch), 0.0
        for batch, rows in enumerate(batches(order(settings.seed, epoch, len(data)), settings.batch), 1):
            inputs, real = data.batch(rows, chance)
            # condition and noise
            if not isinstance(inputs, tuple) or len(inputs) != 2:
                raise TrainingError("a generator's source gives two inputs: condition and noise.")
            condition, noise = inputs
            made = network(condition, noise)
            critic_loss = self._criticise(network.critic, condition, torch.as_tensor(real), made.detach())
            _step(network.critic, optimiser, critic_loss, epoch, batch)
            deceived = functional.softplus(-network.critic(condition, made)).mean()
            _step(network.generator, optimiser, deceived, epoch, batch)
            total += number(loss(made.detach(), real), epoch, batch) * len(rows)
        return total / len(data)

    def _criticise(self, critic: nn.Module, condition: Tensor, real: Tensor, made: Tensor) -> Tensor:
        """Return the critic's loss."""
        real = real.detach().requires_grad_()
        judgement = critic(condition, real)
        (slope,) = torch.autograd.grad(judgement.sum(), real, create_graph=True)
        steep = slope.flatten(1).square().sum(dim=1).mean()
        wrong = functional.softplus(-judgement).mean() + functional.softplus(critic(condition, made)).mean()
        result: Tensor = wrong + self.penalty * steep
        return result


def _step(part: nn.Module, optimiser: Optimizer, loss: Tensor, epoch: int, batch: int) -> None:
    """One step of this network alone."""
    number(loss, epoch, batch)
    weights = list(part.parameters())
    optimiser.zero_grad(set_to_none=True)
    backward(loss, inputs=weights)
    refuse_gradient(weights, epoch, batch)
    optimiser.step()


def energy_distance(made: Tensor, real: Tensor) -> Tensor:
    """Return how far two samples lie apart, (n, ...) each, row for row of the same condition (Szekely and Rizzo 2013).

    2 E|made - real| - E|made - made'| - E|real - real'| over different rows, so that two samples of one distribution
    are 0 apart on average; a single row is 0 apart.
    """
    rows, others = made.flatten(1), real.flatten(1)
    count = len(rows)
    if count < 2:
        return rows.new_zeros(())
    apart = 2 * torch.cdist(rows, others) - torch.cdist(rows, rows) - torch.cdist(others, others)
    result: Tensor = (apart.sum() - apart.diagonal().sum()) / (count * (count - 1))
    return result
