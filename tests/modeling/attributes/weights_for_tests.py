"""Made-up weights of ResNet-50: of every entry of its state, decided by its name and shape alone."""

import hashlib

import numpy as np
import torch

from palpate.modeling.attributes.resnet import ResNet50


def drawn_state(seed=0):
    """As a trained network has them: convolutions of He's size, normalisations that do something."""
    with torch.device("meta"):
        state = ResNet50().state_dict()
    return {name: drawn_tensor(name, tuple(like.shape), seed) for name, like in state.items()}


def drawn_tensor(name, shape, seed=0):
    key = int.from_bytes(hashlib.sha256(f"{seed} {name}".encode()).digest()[:8], "big")
    chance = np.random.Generator(np.random.PCG64(key))
    if name.endswith("num_batches_tracked"):
        return torch.tensor(100)
    if name.endswith("running_var") or (len(shape) == 1 and name.endswith("weight")):
        return torch.from_numpy(chance.uniform(0.5, 1.0, shape).astype("f4"))
    size = np.sqrt(2 / np.prod(shape[1:])) if len(shape) > 1 else 0.1
    return torch.from_numpy((size * chance.standard_normal(shape, dtype="f4")).astype("f4"))


def drawn_input(n=1, side=64):
    """(n, 3, side, side), as normalised colours are."""
    return torch.from_numpy(np.random.Generator(np.random.PCG64(5)).standard_normal((n, 3, side, side), dtype="f4"))
