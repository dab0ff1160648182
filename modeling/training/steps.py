"""The steps of an epoch: train, measure the held-out loss, predict, copy and restore weights."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.autograd import backward
from torch.nn.utils import get_total_norm
from torch.optim import Optimizer

from palpate.modeling.training.refusals import TrainingError
from palpate.modeling.training.seeding import batch_chance, order, training_state
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import Source, answer_of

Loss: TypeAlias = Callable[[Any, Any], Tensor]
"""A function of the network's answer and the target that returns one number, the mean over the rows of a batch."""
Weights = Mapping[str, Tensor]


def train_epoch(
    network: nn.Module, optimiser: Optimizer, data: Source, loss: Loss, settings: Settings, epoch: int
) -> float:
    """Train for one epoch, one step per batch, in the epoch's order; return the mean loss over the rows.

    Raises TrainingError, before the optimiser's step, for a loss or gradient that is not finite.
    """
    network.train()
    parameters = [parameter for group in optimiser.param_groups for parameter in group["params"]]
    chance = batch_chance(settings.seed, epoch)
    total = 0.0
    for batch, rows in enumerate(batches(order(settings.seed, epoch, len(data)), settings.batch), 1):
        inputs, targets = data.batch(rows, chance)
        optimiser.zero_grad(set_to_none=True)
        batch_loss = loss(answer_of(network, inputs), targets)
        total += number(batch_loss, epoch, batch) * len(rows)
        if batch_loss.requires_grad:
            backward(batch_loss)
        refuse_gradient(parameters, epoch, batch)
        optimiser.step()
    return total / len(data)


def mean_loss(network: nn.Module, held: Source, loss: Loss, settings: Settings, epoch: int) -> float:
    """Return the mean loss over all rows, in evaluation mode. Raises TrainingError where it is not finite."""
    network.eval()
    chance = batch_chance(settings.seed, 0)
    total = 0.0
    with torch.no_grad():
        for batch, rows in enumerate(batches(torch.arange(len(held)), max(settings.batch, 64)), 1):
            inputs, targets = held.batch(rows, chance)
            total += number(loss(answer_of(network, inputs), targets), epoch, batch, "held-out ") * len(rows)
    return total / len(held)


def batches(rows: Tensor, size: int) -> Iterator[Tensor]:
    """Yield `size` rows at a time, in their order."""
    return (rows[start : start + size] for start in range(0, len(rows), size))


def number(loss: Tensor, epoch: int, batch: int, which: str = "") -> float:
    """Return a loss as a number. Raises TrainingError where it has several elements or is not finite."""
    if loss.numel() != 1:
        raise TrainingError(f"the loss has shape {tuple(loss.shape)}: expected one number, the mean over the rows.")
    value = float(loss.detach())
    if not math.isfinite(value):
        place = f"epoch {epoch}, {which}batch {batch}"
        advice = "Look at the data for a spike, or begin with a smaller learning rate."
        raise TrainingError(f"{place}: the loss is {value}. {advice}", epoch, batch)
    return value


def refuse_gradient(parameters: list[nn.Parameter], epoch: int, batch: int) -> None:
    """Raise TrainingError where no weight has a gradient, or one is not finite."""
    gradients = [parameter.grad for parameter in parameters if parameter.grad is not None]
    if not gradients:
        raise TrainingError("the loss does not depend on the network's weights: no gradient.", epoch, batch)
    if not finite(gradients):
        raise TrainingError(f"epoch {epoch}, batch {batch}: a gradient is not finite.", epoch, batch)


def answers_of(network: nn.Module, inputs: NDArray[Any], at_once: int) -> NDArray[np.float64]:
    """Return a network's answers to rows, as float64, without dropout and on one thread, so that sums repeat exactly.

    `at_once` rows are computed together. Values outside float32 lead to answers that are not finite.
    """
    with np.errstate(over="ignore"):
        rows = torch.from_numpy(np.ascontiguousarray(inputs, dtype=np.float32))
    with training_state(0, 1), torch.no_grad():
        network.eval()
        raw = torch.cat([network(part) for part in torch.split(rows, at_once)])
    answers: NDArray[np.float64] = raw.numpy().astype(np.float64)
    return answers


def copied(network: nn.Module) -> dict[str, Tensor]:
    """Return copies of all weights and buffers (running means), by name."""
    return {name: tensor.detach().clone().contiguous() for name, tensor in network.state_dict().items()}


def restore(network: nn.Module, weights: Weights) -> None:
    """Load weights that `copied` returned."""
    network.load_state_dict(dict(weights))


def finite(tensors: Iterable[Tensor]) -> bool:
    """Return whether every number is finite; integer tensors always are.

    A finite norm proves it in a thirtieth of the time of checking each number; a norm that overflowed proves nothing.
    """
    floats = [tensor for tensor in tensors if tensor.is_floating_point()]
    if math.isfinite(float(get_total_norm(floats))):
        return True
    return all(bool(torch.isfinite(tensor).all()) for tensor in floats)


def trainable(network: nn.Module) -> list[nn.Parameter]:
    """Return the parameters to train.

    Raises TrainingError where there are none, or where weights are complex, not finite, or not on the CPU.
    """
    parameters = [parameter for parameter in network.parameters() if parameter.requires_grad]
    if not parameters:
        raise TrainingError(f"{type(network).__name__} has no weights to train: all are frozen, or there are none.")
    if away := {str(tensor.device) for tensor in network.state_dict().values()} - {"cpu"}:
        raise TrainingError(f"the network lies on {', '.join(sorted(away))}: this trainer computes on the CPU.")
    if any(tensor.is_complex() for tensor in network.state_dict().values()):
        raise TrainingError(f"{type(network).__name__} has complex weights: hold them as real and imaginary parts.")
    if not finite(network.state_dict().values()):
        raise TrainingError(f"{type(network).__name__} has weights that are not finite before training.")
    return parameters


def exported_float32(name: str, value: Tensor, error: type[ValueError]) -> NDArray[np.float32]:
    """Return a tensor as a float32 array for a model file. Raises `error` for values that are not finite."""
    array = np.array(value.detach().numpy(), dtype=np.float32, order="C")
    if not np.isfinite(array).all():
        raise error(f"{name}: holds values that are not finite; this network cannot be used.")
    return array
