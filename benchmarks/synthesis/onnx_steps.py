"""A card as an ONNX graph, for ONNX Runtime and OpenVINO: built by hand, for the bench only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.synthesis.graph import Numbers, Tensors, Tracer, Value
from palpate.signals.arrays import Array
from palpate.signals.models.card import Card

OPSET, IR = 18, 9
UNARY = {"relu": "Relu", "sqrt": "Sqrt", "cos": "Cos", "sin": "Sin", "exp": "Exp", "log": "Log", "abs": "Abs",
         "tanh": "Tanh", "sigmoid": "Sigmoid", "softplus": "Softplus"}  # fmt: skip


def onnx_runtime(card: Card, tensors: Tensors) -> Callable[[Array], Array]:
    """Return one step by ONNX Runtime, one thread, with input and output bound once.

    Raise ImportError if it is missing.
    """
    onnxruntime = import_module("onnxruntime")

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(_model(card, tensors), options, providers=["CPUExecutionProvider"])
    inputs, answer = np.zeros((1, card.takes.size), np.float32), np.zeros((1, card.gives.size), np.float32)
    bound = [onnxruntime.OrtValue.ortvalue_from_numpy(values) for values in (inputs, answer)]
    binding = session.io_binding()
    binding.bind_ortvalue_input("given", bound[0])
    binding.bind_ortvalue_output("answer", bound[1])

    def run(window: Array) -> Array:
        bound[0].update_inplace(window.astype(np.float32)[None])
        session.run_with_iobinding(binding)
        return np.asarray(bound[1].numpy()[0], dtype=np.float64)

    return run


def open_vino(card: Card, tensors: Tensors) -> Callable[[Array], Array]:
    """Return one step by OpenVINO in float32 (its default is bfloat16), one thread.

    Raise ImportError if it is missing.
    """
    openvino = import_module("openvino")

    core = openvino.Core()
    one = {"INFERENCE_NUM_THREADS": 1, "NUM_STREAMS": 1, "PERFORMANCE_HINT": "LATENCY"}
    options = {"INFERENCE_PRECISION_HINT": "f32", **one}
    request = core.compile_model(core.read_model(_model(card, tensors)), "CPU", options).create_infer_request()
    inputs = np.zeros((1, card.takes.size), np.float32)
    request.set_input_tensor(openvino.Tensor(inputs, shared_memory=True))

    def run(window: Array) -> Array:
        inputs[0] = window
        request.infer()
        return np.asarray(request.get_output_tensor().data[0], dtype=np.float64)

    return run


def _model(card: Card, tensors: Tensors) -> bytes:
    onnx, helper = import_module("onnx"), import_module("onnx.helper")

    graph = _Onnx()
    traced = Tracer(graph, tensors).run(card.steps, Value("given", (card.takes.size,)))
    graph.op("Identity", [traced.x], out="answer")
    ends = [
        helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, (1, size))
        for name, size in (("given", card.takes.size), ("answer", card.gives.size))
    ]
    onnx_graph = helper.make_graph(graph.nodes, "step", ends[:1], ends[1:], graph.constants)
    model = helper.make_model(onnx_graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR)
    onnx.checker.check_model(model)
    return bytes(model.SerializeToString())


class _Onnx:
    """A builder of ONNX graphs, whose values are names."""

    def __init__(self) -> None:
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def constant(self, numbers: Any) -> str:
        name = f"c{len(self.constants)}"
        self.constants.append(import_module("onnx.numpy_helper").from_array(np.ascontiguousarray(numbers), name))
        return name

    def op(self, kind: str, inputs: Sequence[str], out: str = "", **fields: Any) -> str:
        """Add a node with one output and return its name."""
        helper = import_module("onnx.helper")
        name = out or f"v{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, list(inputs), [name], **fields))
        return name

    def _whole(self, *numbers: int) -> str:
        return self.constant(np.array(numbers, np.int64))

    def reshape(self, x: str, shape: tuple[int, ...]) -> str:
        return self.op("Reshape", [x, self._whole(*shape)])

    def permute(self, x: str, order: tuple[int, ...]) -> str:
        return self.op("Transpose", [x], perm=list(order))

    def linear(self, x: str, weight: Numbers, bias: Numbers, relu: bool) -> str:
        product = self.op("Gemm", [x, self.constant(weight), self.constant(bias)], transB=1)
        return self.op("Relu", [product]) if relu else product

    def product(self, x: str, y: str, turned: bool) -> str:
        return self.op("MatMul", [x, self.permute(y, (0, 2, 1)) if turned else y])

    def add(self, x: str, y: str) -> str:
        return self.op("Add", [x, y])

    def multiply(self, x: str, y: str) -> str:
        return self.op("Mul", [x, y])

    def part(self, x: str, start: tuple[int, ...], size: tuple[int, ...]) -> str:
        stop = tuple(first + count for first, count in zip(start, size, strict=True))
        return self.op("Slice", [x, self._whole(*start), self._whole(*stop), self._whole(*range(len(start)))])

    def join(self, parts: Sequence[str], axis: int) -> str:
        return self.op("Concat", parts, axis=axis)

    def function(self, name: str, x: str) -> str:
        return self.op("Mul", [x, x]) if name == "square" else self.op(UNARY[name], [x])

    def softmax(self, x: str) -> str:
        return self.op("Softmax", [x], axis=-1)

    def norm(self, x: str, weight: Numbers, bias: Numbers, tiny: float) -> str:
        return self.op("LayerNormalization", [x, self.constant(weight), self.constant(bias)], axis=-1, epsilon=tiny)

    def angle(self, imaginary: str, real: str) -> str:
        """Add an angle without atan2: an arc tangent, plus half a turn where the real part is negative."""
        zero, turn = self.constant(np.zeros(1, np.float32)), self.constant(np.array([np.pi], np.float32))
        back, none = self.constant(np.array([-np.pi], np.float32)), self.constant(np.zeros(1, np.float32))
        near = self.op("Atan", [self.op("Div", [imaginary, real])])
        half_turn = self.op("Where", [self.op("Less", [imaginary, zero]), back, turn])
        return self.op("Add", [near, self.op("Where", [self.op("Less", [real, zero]), half_turn, none])])
