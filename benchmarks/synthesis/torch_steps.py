"""A card in eager PyTorch: as straight-line code of functions, or with torch's stock encoder layers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, fx, nn
from torch.nn import functional

from benchmarks.synthesis.graph import Numbers, Tensors, Tracer, Value
from palpate.signals.arrays import Array
from palpate.signals.models import card_steps as signals_of
from palpate.signals.models.card import Activation, Card, Conv, Step

FUNCTIONS: dict[str, Callable[..., Tensor]] = {
    "relu": torch.relu, "sqrt": torch.sqrt, "cos": torch.cos, "sin": torch.sin, "exp": torch.exp, "log": torch.log,
    "abs": torch.abs, "tanh": torch.tanh, "sigmoid": torch.sigmoid, "square": torch.square,
    "softplus": functional.softplus,
}  # fmt: skip
ENCODER = (signals_of.Keep, signals_of.Attention, signals_of.Add, signals_of.Norm, signals_of.Keep, Conv, Activation,
           Conv, signals_of.Add, signals_of.Norm)  # fmt: skip
"""The steps of one encoder layer, normalised after each part."""


def torch_eager(card: Card, tensors: Tensors, stock: bool = False) -> Callable[[Array], Array]:
    """Return one step by PyTorch without gradients; the caller sets the threads.

    With `stock`, encoder layers are nn.TransformerEncoderLayer.
    """
    graph = _Torch()
    inputs = graph.graph.placeholder("given")
    tracer = (_Stock if stock else _Own)(graph, tensors)
    graph.graph.output(tracer.run(card.steps, Value(inputs, (card.takes.size,))).x)
    module = fx.GraphModule(graph.root, graph.graph).eval()

    def run(window: Array) -> Array:
        with torch.inference_mode():
            answer: Tensor = module(torch.from_numpy(window.astype(np.float32))[None])
        return np.asarray(answer[0].numpy(), dtype=np.float64)

    return run


def _encoder(steps: Sequence[Step], tensors: Tensors, width: int) -> nn.Module:
    """Return the stock encoder layer with these steps' numbers."""
    _, mix, _, first, _, wide, _, narrow, _, second = steps
    if not isinstance(mix, signals_of.Attention) or not isinstance(wide, Conv) or not isinstance(narrow, Conv):
        raise TypeError("no encoder layer")
    layer = nn.TransformerEncoderLayer(width, mix.heads, len(tensors[wide.weight]), batch_first=True)
    tensor_names = {
        "self_attn.in_proj_weight": mix.weight, "self_attn.in_proj_bias": mix.bias,
        "self_attn.out_proj.weight": mix.out, "self_attn.out_proj.bias": mix.out_bias,
        "linear1.weight": wide.weight, "linear1.bias": wide.bias,
        "linear2.weight": narrow.weight, "linear2.bias": narrow.bias,
    }  # fmt: skip
    for name, norm in (("norm1", first), ("norm2", second)):
        if isinstance(norm, signals_of.Norm):
            tensor_names |= {f"{name}.weight": norm.weight, f"{name}.bias": norm.bias}
            getattr(layer, name).eps = norm.tiny
    shapes = {name: value.shape for name, value in layer.state_dict().items()}
    layer.load_state_dict({name: torch.tensor(tensors[tensor_names[name]]).reshape(shapes[name]) for name in shapes})
    return layer.eval()


class _Torch:
    """A builder of a torch.fx graph of straight-line code, whose values are nodes."""

    def __init__(self) -> None:
        self.graph, self.root = fx.Graph(), nn.Module()
        self.count = 0

    def buffer(self, numbers: Numbers) -> fx.Node:
        """Add a buffer and return its node."""
        self.count += 1
        self.root.register_buffer(f"b{self.count}", torch.tensor(numbers))
        return self.graph.get_attr(f"b{self.count}")

    def layer(self, module: nn.Module, x: fx.Node) -> fx.Node:
        """Add a module applied to x as a batch of one, and return its node."""
        self.count += 1
        self.root.add_module(f"m{self.count}", module)
        inner = self.graph.call_module(f"m{self.count}", (self.call(torch.unsqueeze, x, 0),))
        return self.call(torch.squeeze, inner, 0)

    def call(self, function: Callable[..., Any], *inputs: Any, **options: Any) -> fx.Node:
        """Add a function call and return its node."""
        return self.graph.call_function(function, inputs, options)

    def constant(self, numbers: Numbers) -> fx.Node:
        return self.buffer(numbers)

    def reshape(self, x: fx.Node, shape: tuple[int, ...]) -> fx.Node:
        return self.call(torch.reshape, x, shape)

    def permute(self, x: fx.Node, order: tuple[int, ...]) -> fx.Node:
        return self.call(torch.permute, x, order)

    def linear(self, x: fx.Node, weight: Numbers, bias: Numbers, relu: bool) -> fx.Node:
        product = self.call(functional.linear, x, self.buffer(weight), self.buffer(bias))
        return self.call(torch.relu, product) if relu else product

    def product(self, x: fx.Node, y: fx.Node, turned: bool) -> fx.Node:
        return self.call(torch.bmm, x, self.permute(y, (0, 2, 1)) if turned else y)

    def add(self, x: fx.Node, y: fx.Node) -> fx.Node:
        return self.call(torch.add, x, y)

    def multiply(self, x: fx.Node, y: fx.Node) -> fx.Node:
        return self.call(torch.mul, x, y)

    def part(self, x: fx.Node, start: tuple[int, ...], size: tuple[int, ...]) -> fx.Node:
        for axis, (first, count) in enumerate(zip(start, size, strict=True)):
            x = self.call(torch.narrow, x, axis, first, count)
        return x

    def join(self, parts: Sequence[fx.Node], axis: int) -> fx.Node:
        return self.call(torch.cat, list(parts), axis)

    def function(self, name: str, x: fx.Node) -> fx.Node:
        return self.call(FUNCTIONS[name], x)

    def softmax(self, x: fx.Node) -> fx.Node:
        return self.call(torch.softmax, x, -1)

    def norm(self, x: fx.Node, weight: Numbers, bias: Numbers, tiny: float) -> fx.Node:
        return self.call(functional.layer_norm, x, [len(weight)], self.buffer(weight), self.buffer(bias), tiny)

    def angle(self, imaginary: fx.Node, real: fx.Node) -> fx.Node:
        return self.call(torch.atan2, imaginary, real)


class _Own(Tracer[fx.Node]):
    """A tracer that uses torch's own attention function."""

    graph: _Torch

    def _attention(self, step: signals_of.Attention, value: Value[fx.Node]) -> Value[fx.Node]:
        graph, (width, length) = self.graph, value.shape
        mixed = graph.linear(value.x, self._reals(step.weight), self._reals(step.bias), False)
        heads = graph.permute(graph.reshape(mixed, (length, 3, step.heads, width // step.heads)), (1, 2, 0, 3))
        three = [graph.call(torch.select, heads, 0, one) for one in range(3)]
        answers = graph.permute(graph.call(functional.scaled_dot_product_attention, *three), (1, 0, 2))
        joined = graph.reshape(answers, (length, width))
        return Value(graph.linear(joined, self._reals(step.out), self._reals(step.out_bias), False), value.shape)


class _Stock(Tracer[fx.Node]):
    """A tracer that uses a stock module for every encoder layer."""

    graph: _Torch

    def _next(self, steps: Sequence[Step], value: Value[fx.Node]) -> tuple[Value[fx.Node], int]:
        these = steps[: len(ENCODER)]
        if tuple(type(step) for step in these) != ENCODER:
            return super()._next(steps, value)
        layer = _encoder(these, self.tensors, value.shape[0])
        return Value(self.graph.layer(layer, value.x), value.shape), len(ENCODER)
