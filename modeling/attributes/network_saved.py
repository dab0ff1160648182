"""A trained network as arrays and plain values, with how it sees features and scales ratings; and the way back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from palpate.modeling.attributes.network_rows import Look, Target

NETWORK = "network."
Arrays = Mapping[str, NDArray[Any]]


def arrays_of(network: nn.Module, looks: Iterable[Look], target: Target) -> dict[str, NDArray[Any]]:
    """Weights, standardisation, and the scale of the ratings."""
    arrays = {NETWORK + name: tensor.numpy() for name, tensor in network.state_dict().items()}
    for look in looks:
        arrays |= {f"{look.modality}.mean": look.mean, f"{look.modality}.gain": look.gain}
    return arrays | {"target.mean": target.mean, "target.sd": np.array([target.sd])}


def told_of(looks: Iterable[Look]) -> list[list[Any]]:
    """What `looks_in` wants beside the arrays."""
    return [[look.modality, list(look.kinds), list(look.sizes)] for look in looks]


def looks_in(arrays: Arrays, told: Iterable[tuple[Any, Iterable[str], Iterable[int]]]) -> tuple[Look, ...]:
    """How features were seen. Raises KeyError where an array lacks."""
    return tuple(
        Look(modality, tuple(kinds), tuple(sizes), arrays[f"{modality}.mean"], arrays[f"{modality}.gain"])
        for modality, kinds, sizes in told
    )


def target_in(arrays: Arrays) -> Target:
    """The scale of the ratings. Raises KeyError where an array lacks."""
    return Target(arrays["target.mean"], float(arrays["target.sd"][0]))


def load_into(network: nn.Module, arrays: Arrays) -> None:
    """Give a network its weights. Raises RuntimeError where they are another's."""
    own = {name.removeprefix(NETWORK): array for name, array in arrays.items() if name.startswith(NETWORK)}
    network.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in own.items()})
