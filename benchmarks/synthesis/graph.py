"""A card's steps translated for other runtimes, operation by operation, so that one model runs in every runtime.

Values have the length first, (length, channels), and lists are (1, size), as dense layers of all runtimes need them.
Only the steps of FoTEN and its variants are supported.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.textures.recording import TextureDataError
from palpate.signals.models import card as steps_of
from palpate.signals.models import card_steps as signals_of
from palpate.signals.models.card import Step

Numbers = NDArray[np.float32]
Tensors = Mapping[str, NDArray[Any]]
T = TypeVar("T")


class Graph(Protocol[T]):
    """A runtime's graph. All values are float32; `linear` has weight (out, in) and an optional relu."""

    def constant(self, numbers: Numbers) -> T: ...
    def reshape(self, x: T, shape: tuple[int, ...]) -> T: ...
    def permute(self, x: T, order: tuple[int, ...]) -> T: ...
    def linear(self, x: T, weight: Numbers, bias: Numbers, relu: bool) -> T: ...
    def product(self, x: T, y: T, turned: bool) -> T: ...
    def add(self, x: T, y: T) -> T: ...
    def multiply(self, x: T, y: T) -> T: ...
    def part(self, x: T, start: tuple[int, ...], size: tuple[int, ...]) -> T: ...
    def join(self, parts: Sequence[T], axis: int) -> T: ...
    def function(self, name: str, x: T) -> T: ...
    def softmax(self, x: T) -> T: ...
    def norm(self, x: T, weight: Numbers, bias: Numbers, tiny: float) -> T: ...
    def angle(self, imaginary: T, real: T) -> T: ...


@dataclass(frozen=True)
class Value(Generic[T]):
    """A tensor of the runtime, and its shape in the card: (length, channels), or (size,)."""

    x: T
    shape: tuple[int, ...]

    @property
    def lies(self) -> tuple[int, int]:
        """The two sides of the value's shape in the runtime."""
        return (1, self.shape[0]) if len(self.shape) == 1 else (self.shape[1], self.shape[0])


class Tracer(Generic[T]):
    """A translator of the steps in one pass; values that a later step uses are stored by name."""

    def __init__(self, graph: Graph[T], tensors: Tensors) -> None:
        self.graph, self.tensors = graph, tensors
        self.kept: dict[str, Value[T]] = {}

    def run(self, steps: Sequence[Step], value: Value[T]) -> Value[T]:
        """Return the output value of the steps."""
        place = 0
        while place < len(steps):
            value, count = self._next(steps[place:], value)
            place += count
        return value

    def _next(self, steps: Sequence[Step], value: Value[T]) -> tuple[Value[T], int]:
        """Return the value after one step, or after two where a relu follows a product, and the number of steps."""
        step, relu = steps[0], len(steps) > 1 and _is_relu(steps[1])
        if isinstance(step, steps_of.Dense):
            return self._dense(step, value, relu), 1 + relu
        if isinstance(step, steps_of.Conv):
            return self._conv(step, value, relu), 1 + relu
        handler: Callable[[Any, Value[T]], Value[T]] | None = getattr(self, f"_{step.do}", None)
        if handler is None:
            raise TextureDataError(f"the bench's other runtimes do not know the step {step.do!r}; give a FoTEN.")
        return handler(step, value), 1

    def _reals(self, name: str) -> Numbers:
        return np.asarray(self.tensors[name], dtype=np.float32)

    def _dense(self, step: steps_of.Dense, value: Value[T], relu: bool) -> Value[T]:
        weight = self._reals(step.weight)
        if len(value.shape) == 2:  # its numbers lie length first
            weight = weight.reshape(-1, *value.shape).swapaxes(1, 2).reshape(len(weight), -1)
        flat = self._flat(value)
        return Value(self.graph.linear(flat, weight, self._reals(step.bias), relu), (len(weight),))

    def _flat(self, value: Value[T]) -> T:
        size = value.lies[0] * value.lies[1]
        return value.x if value.lies[0] == 1 else self.graph.reshape(value.x, (1, size))

    def _conv(self, step: steps_of.Conv, value: Value[T], relu: bool) -> Value[T]:
        weight = self._reals(step.weight)
        if weight.shape[2] != 1 or step.pad:
            raise TextureDataError("the bench's other runtimes know no convolution wider than 1; give a FoTEN.")
        linear = self.graph.linear(value.x, weight[:, :, 0], self._reals(step.bias), relu)
        return Value(linear, (len(weight), value.shape[1]))

    def _reshape(self, step: steps_of.Reshape, value: Value[T]) -> Value[T]:
        """Reshape in C order of the card's shape; values are transposed unless one side is 1 or a shape is a list."""
        graph, shape = self.graph, step.shape
        if len(value.shape) == 2:
            turned = value.x if 1 in value.shape else graph.permute(value.x, (1, 0))
            value = Value(graph.reshape(turned, (1, value.lies[0] * value.lies[1])), (int(np.prod(value.shape)),))
        if len(shape) == 1:
            return Value(value.x, shape)
        if 1 in shape:
            return Value(graph.reshape(value.x, (shape[1], shape[0])), shape)
        return Value(graph.permute(graph.reshape(value.x, shape), (1, 0)), shape)

    def _affine(self, step: steps_of.Affine, value: Value[T]) -> Value[T]:
        x, graph = value.x, self.graph
        for number, plain, put in ((step.gain, 1.0, graph.multiply), (step.offset, 0.0, graph.add)):
            numbers = self._reals(number) if isinstance(number, str) else np.array([number], np.float32)
            if not (numbers == plain).all():
                spread = np.broadcast_to(numbers, value.shape).astype(np.float32)
                lies = spread.T if len(value.shape) == 2 else spread[None]
                x = put(x, graph.constant(np.ascontiguousarray(lies)))
        return Value(x, value.shape)

    def _activation(self, step: steps_of.Activation, value: Value[T]) -> Value[T]:
        return Value(self.graph.function(step.function, value.x), value.shape)

    def _keep(self, step: signals_of.Keep, value: Value[T]) -> Value[T]:
        self.kept[step.kept] = value
        return value

    def _recall(self, step: signals_of.Recall, _value: Value[T]) -> Value[T]:
        return self.kept[step.kept]

    def _add(self, step: signals_of.Add, value: Value[T]) -> Value[T]:
        return Value(self.graph.add(value.x, self.kept[step.kept].x), value.shape)

    def _join(self, step: signals_of.Join, value: Value[T]) -> Value[T]:
        parts = [value, *(self.kept[name] for name in step.kept)]
        channels = sum(part.shape[0] for part in parts)
        return Value(self.graph.join([part.x for part in parts], 1), (channels, *value.shape[1:]))

    def _part(self, step: signals_of.Part, value: Value[T]) -> Value[T]:
        if step.along == "length":
            raise TextureDataError("the bench's other runtimes take no part of the length; give a FoTEN.")
        rows, count = value.lies[0], step.stop - step.start
        return Value(self.graph.part(value.x, (0, step.start), (rows, count)), (count, *value.shape[1:]))

    def _norm(self, step: signals_of.Norm, value: Value[T]) -> Value[T]:
        normed = self.graph.norm(value.x, self._reals(step.weight), self._reals(step.bias), step.tiny)
        return Value(normed, value.shape)

    def _attention(self, step: signals_of.Attention, value: Value[T]) -> Value[T]:
        """Add attention with 1 / sqrt(depth) within the queries' weights, as a converter would."""
        graph, (width, length) = self.graph, value.shape
        depth = width // step.heads
        weight, bias = self._reals(step.weight).copy(), self._reals(step.bias).copy()
        weight[:width] *= depth**-0.5
        bias[:width] *= depth**-0.5
        mixed = graph.reshape(graph.linear(value.x, weight, bias, False), (length, 3, step.heads, depth))
        mixed = graph.permute(mixed, (1, 2, 0, 3))
        size = (1, step.heads, length, depth)
        heads = [graph.reshape(graph.part(mixed, (one, 0, 0, 0), size), size[1:]) for one in range(3)]
        shares = graph.softmax(graph.product(heads[0], heads[1], True))
        answers = graph.permute(graph.product(shares, heads[2], False), (1, 0, 2))
        joined = graph.reshape(answers, (length, width))
        return Value(graph.linear(joined, self._reals(step.out), self._reals(step.out_bias), False), value.shape)

    def _polar(self, _step: signals_of.Polar, value: Value[T]) -> Value[T]:
        graph, (real, imaginary) = self.graph, self._two(value)
        square = graph.add(graph.multiply(real, real), graph.multiply(imaginary, imaginary))
        both = [graph.function("sqrt", square), graph.angle(imaginary, real)]
        return Value(graph.join(both, 1), value.shape)

    def _cartesian(self, _step: signals_of.Cartesian, value: Value[T]) -> Value[T]:
        graph, (size, phase) = self.graph, self._two(value)
        both = [graph.multiply(size, graph.function(name, phase)) for name in ("cos", "sin")]
        return Value(graph.join(both, 1), value.shape)

    def _two(self, value: Value[T]) -> tuple[T, T]:
        length = value.shape[1]
        return self.graph.part(value.x, (0, 0), (length, 1)), self.graph.part(value.x, (0, 1), (length, 1))


def _is_relu(step: Step) -> bool:
    return isinstance(step, steps_of.Activation) and step.function == "relu"
