"""Other runtimes that can run a model's card on this machine, one step at a time, for comparison with Palpate's.

None of them is needed by the product: a runtime that is not installed is left out, and named.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from benchmarks.synthesis.graph import Tensors
from palpate.signals.arrays import Array
from palpate.signals.models.card import Card

Step = Callable[[Array], Array]
"""A function from a window (3 window) in units to the answer (1 or 2), in float64."""


def other_runtimes(card: Card, tensors: Tensors) -> tuple[Mapping[str, Step], tuple[str, ...]]:
    """Return the installed runtimes and the names of the missing ones; set torch to one thread."""
    installed, missing = {}, []
    for name, make in MAKERS.items():
        try:
            installed[name] = make(card, tensors)
        except ImportError:
            missing.append(name)
    return installed, tuple(missing)


def read_plainly(card: Path) -> tuple[Card, Tensors]:
    """Return a card and its tensors, all in float32, without the checks of palpate.signals.models.file."""
    from safetensors.numpy import load_file

    parsed = Card.model_validate_json(card.read_bytes())
    tensors = load_file(card.parent / parsed.weights.file)
    return parsed, {name: tensor.astype(np.float32) for name, tensor in tensors.items()}


def _torch(card: Card, tensors: Tensors, stock: bool) -> Step:
    import torch

    from benchmarks.synthesis.torch_steps import torch_eager

    torch.set_num_threads(1)
    return torch_eager(card, tensors, stock)


def _litert(card: Card, tensors: Tensors) -> Step:
    from benchmarks.synthesis.litert_steps import litert

    return litert(card, tensors)


def _onnx(card: Card, tensors: Tensors) -> Step:
    from benchmarks.synthesis.onnx_steps import onnx_runtime

    return onnx_runtime(card, tensors)


def _open_vino(card: Card, tensors: Tensors) -> Step:
    from benchmarks.synthesis.onnx_steps import open_vino

    return open_vino(card, tensors)


MAKERS: Mapping[str, Callable[[Card, Tensors], Step]] = {
    "PyTorch eager, own layers": lambda card, tensors: _torch(card, tensors, False),
    "PyTorch eager, stock layers": lambda card, tensors: _torch(card, tensors, True),
    "LiteRT float32": _litert,
    "ONNX Runtime": _onnx,
    "OpenVINO float32": _open_vino,
}
