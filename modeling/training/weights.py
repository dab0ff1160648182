"""A network's weights as a set of tensors: copied, restored, and never with a number that is not finite."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import torch
from torch import Tensor, nn
from torch.nn.utils import get_total_norm

from palpate.modeling.training.refusals import TrainingError

Weights = Mapping[str, Tensor]


def copied(network: nn.Module) -> dict[str, Tensor]:
    """Weights and buffers (running means), each a tensor of its own."""
    return {name: tensor.detach().clone().contiguous() for name, tensor in network.state_dict().items()}


def restore(network: nn.Module, weights: Weights) -> None:
    """Put copied weights back."""
    network.load_state_dict(dict(weights))


def finite(tensors: Iterable[Tensor]) -> bool:
    """Whether every number is finite; a tensor of whole numbers always is.

    A finite norm says so at a thirtieth of the time of looking at each number; one that overflowed does not deny it.
    """
    floats = [tensor for tensor in tensors if tensor.is_floating_point()]
    if math.isfinite(float(get_total_norm(floats))):
        return True
    return all(bool(torch.isfinite(tensor).all()) for tensor in floats)


def trainable(network: nn.Module) -> list[nn.Parameter]:
    """What is to be trained. Raises TrainingError where there is nothing, or where the trainer cannot vouch for it."""
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
