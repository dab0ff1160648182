"""A card as a .tflite for LiteRT, the runtime of the thesis: built by its schema, for the bench only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.synthesis.graph import Numbers, Tensors, Tracer, Value
from palpate.signals.arrays import Array
from palpate.signals.models.card import Card

SCHEMA = 3
UNARY = {"relu": "RELU", "sqrt": "SQRT", "cos": "COS", "sin": "SIN", "exp": "EXP", "log": "LOG", "abs": "ABS",
         "tanh": "TANH", "sigmoid": "LOGISTIC", "square": "SQUARE"}  # fmt: skip


def litert(card: Card, tensors: Tensors) -> Callable[[Array], Array]:
    """Return one step by LiteRT in float32, one thread, its default delegate. Raise ImportError where it is missing."""
    interpreters = import_module("ai_edge_litert.interpreter")
    graph = _TfLite()
    inputs = graph.tensor((1, card.takes.size))
    answer = Tracer(graph, tensors).run(card.steps, Value(inputs, (card.takes.size,)))
    interpreter = interpreters.Interpreter(model_content=graph.file_bytes(inputs, answer.x), num_threads=1)
    interpreter.allocate_tensors()
    place, out = interpreter.get_input_details()[0]["index"], interpreter.get_output_details()[0]["index"]

    def run(window: Array) -> Array:
        interpreter.set_tensor(place, window.astype(np.float32)[None])
        interpreter.invoke()
        return np.asarray(interpreter.get_tensor(out)[0], dtype=np.float64)

    return run


class _TfLite:
    """A writer of .tflite files.

    Tensors are numbers in the file's list; shapes are tracked, since the schema needs them.
    """

    def __init__(self) -> None:
        self.schema = import_module("ai_edge_litert.schema_py_generated")
        self.buffers: list[Any] = [self.schema.BufferT()]
        self.tensors: list[Any] = []
        self.operators: list[Any] = []
        self.codes: dict[int, int] = {}

    def tensor(self, shape: tuple[int, ...], buffer: int = 0, kind: str = "FLOAT32") -> int:
        """Add a new tensor and return its number."""
        tensor = self.schema.TensorT()
        tensor.shape, tensor.type = list(shape), getattr(self.schema.TensorType, kind)
        tensor.buffer, tensor.name = buffer, f"t{len(self.tensors)}"
        self.tensors.append(tensor)
        return len(self.tensors) - 1

    def constant(self, numbers: Numbers | np.ndarray[Any, np.dtype[np.int32]]) -> int:
        """Add a constant tensor and return its number; integers are indices and shapes."""
        buffer = self.schema.BufferT()
        buffer.data = np.frombuffer(np.ascontiguousarray(numbers).tobytes(), dtype=np.uint8)
        self.buffers.append(buffer)
        return self.tensor(numbers.shape, len(self.buffers) - 1, "INT32" if numbers.dtype == np.int32 else "FLOAT32")

    def op(self, name: str, inputs: Sequence[int], shape: tuple[int, ...], options: str = "", **fields: Any) -> int:
        """Add an operation with one output and return its number."""
        code = getattr(self.schema.BuiltinOperator, name)
        operator, out = self.schema.OperatorT(), self.tensor(shape)
        operator.opcodeIndex = self.codes.setdefault(code, len(self.codes))
        operator.inputs, operator.outputs = list(inputs), [out]
        if options:
            operator.builtinOptionsType = getattr(self.schema.BuiltinOptions, options)
            operator.builtinOptions = getattr(self.schema, f"{options}T")()
            for field, value in fields.items():
                setattr(operator.builtinOptions, field, value)
        self.operators.append(operator)
        return out

    def shape(self, x: int) -> tuple[int, ...]:
        """Return the shape of a tensor."""
        return tuple(self.tensors[x].shape)

    def reshape(self, x: int, shape: tuple[int, ...]) -> int:
        places = self.constant(np.array(shape, np.int32))
        return self.op("RESHAPE", (x, places), shape, "ReshapeOptions", newShape=list(shape))

    def permute(self, x: int, order: tuple[int, ...]) -> int:
        shape = self.shape(x)
        places = self.constant(np.array(order, np.int32))
        return self.op("TRANSPOSE", (x, places), tuple(shape[axis] for axis in order), "TransposeOptions")

    def linear(self, x: int, weight: Numbers, bias: Numbers, relu: bool) -> int:
        kinds = self.schema.ActivationFunctionType
        shape = (*self.shape(x)[:-1], len(weight))
        inputs = (x, self.constant(weight), self.constant(bias))
        return self.op(
            "FULLY_CONNECTED", inputs, shape, "FullyConnectedOptions", keepNumDims=True,
            fusedActivationFunction=kinds.RELU if relu else kinds.NONE,
        )  # fmt: skip

    def product(self, x: int, y: int, turned: bool) -> int:
        shape = (*self.shape(x)[:-1], self.shape(y)[-2 if turned else -1])
        return self.op("BATCH_MATMUL", (x, y), shape, "BatchMatMulOptions", adjX=False, adjY=turned)

    def add(self, x: int, y: int) -> int:
        return self.op("ADD", (x, y), self._wider(x, y), "AddOptions")

    def multiply(self, x: int, y: int) -> int:
        return self.op("MUL", (x, y), self._wider(x, y), "MulOptions")

    def _wider(self, x: int, y: int) -> tuple[int, ...]:
        return tuple(np.broadcast_shapes(self.shape(x), self.shape(y)))

    def part(self, x: int, start: tuple[int, ...], size: tuple[int, ...]) -> int:
        places = [self.constant(np.array(numbers, np.int32)) for numbers in (start, size)]
        return self.op("SLICE", (x, *places), size, "SliceOptions")

    def join(self, parts: Sequence[int], axis: int) -> int:
        shape = list(self.shape(parts[0]))
        shape[axis] = sum(self.shape(part)[axis] for part in parts)
        return self.op("CONCATENATION", parts, tuple(shape), "ConcatenationOptions", axis=axis)

    def function(self, name: str, x: int) -> int:
        if name == "softplus":
            one = self.constant(np.ones(1, np.float32))
            return self.function("log", self.add(self.function("exp", x), one))
        return self.op(UNARY[name], (x,), self.shape(x))

    def softmax(self, x: int) -> int:
        return self.op("SOFTMAX", (x,), self.shape(x), "SoftmaxOptions", beta=1.0)

    def norm(self, x: int, weight: Numbers, bias: Numbers, tiny: float) -> int:
        shape = self.shape(x)
        last = self.constant(np.array([len(shape) - 1], np.int32))
        one = (*shape[:-1], 1)
        mean = self.op("MEAN", (x, last), one, "ReducerOptions", keepDims=True)
        apart = self.op("SUB", (x, mean), shape, "SubOptions")
        square = self.op("MEAN", (self.multiply(apart, apart), last), one, "ReducerOptions", keepDims=True)
        scale = self.op("RSQRT", (self.add(square, self.constant(np.array([tiny], np.float32))),), one)
        scaled = self.multiply(self.multiply(apart, scale), self.constant(weight))
        return self.add(scaled, self.constant(bias))

    def angle(self, imaginary: int, real: int) -> int:
        return self.op("ATAN2", (imaginary, real), self.shape(real))

    def file_bytes(self, inputs: int, answer: int) -> bytes:
        """Return the bytes of the file."""
        flatbuffers = import_module("flatbuffers")
        schema = self.schema
        subgraph, model = schema.SubGraphT(), schema.ModelT()
        subgraph.tensors, subgraph.operators = self.tensors, self.operators
        subgraph.inputs, subgraph.outputs = [inputs], [answer]
        for code in self.codes:
            entry = schema.OperatorCodeT()
            entry.builtinCode, entry.deprecatedBuiltinCode, entry.version = code, min(code, 127), 1
            model.operatorCodes = [*(model.operatorCodes or []), entry]
        model.version, model.subgraphs, model.buffers = SCHEMA, [subgraph], self.buffers
        builder = flatbuffers.Builder(1 << 22)
        builder.Finish(model.Pack(builder), b"TFL3")
        return bytes(builder.Output())
