"""Steps that are products of matrices: dense layers, convolutions, attention, recurrence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.models.card import Conv, Dense
from palpate.signals.models.card_steps import Attention, Lstm
from palpate.signals.models.form import LARGEST
from palpate.signals.models.native.draft import Draft
from palpate.signals.models.native.plain_steps import Tensors
from palpate.signals.models.native.shapes import at, by_length, fresh, is_list, settled, sides, tight
from palpate.signals.models.native.values import Linear, NotCompiled, Product, Spot, Value

NARROW = 4
"""A product is merged with the one before it where that one's input is this many times narrower."""


def dense(step: Dense, value: Value, draft: Draft, tensors: Tensors) -> Value:
    """Add a dense layer, its weights in the order in which the input's numbers lie."""
    weight, bias = _reals(tensors, step.weight), _reals(tensors, step.bias)
    if value.linear is None and not is_list(value):
        value = tight(draft, value)
        lies = sides(value) if value.length_first and 1 not in value.shape else None
        value = Value((value.size,), value.at, value.size, sides=lies)
    elif value.linear is not None:
        value = settled(draft, replace(value, shape=(value.size,)))
    if value.sides is not None:
        channels, length = value.sides
        weight = weight.reshape(-1, channels, length).swapaxes(1, 2).reshape(len(weight), -1)
    return multiplied(draft, value.spot, (0, 1, 1), weight.T, bias[None], (len(bias),))


def dense_formula(step: Dense, linear: Linear, tensors: Tensors) -> Value:
    """Return a dense layer applied to a value that is still a formula of the input, as a formula again."""
    weight, bias = _reals(tensors, step.weight), _reals(tensors, step.bias)
    _require_small(len(bias), linear)
    return Value((len(bias),), linear=Linear(weight @ linear.matrix, weight @ linear.offset + bias))


def conv_formula(step: Conv, value: Value, linear: Linear, tensors: Tensors) -> Value:
    """Return a convolution of width 1 applied to a value that is still a formula of the input, as a formula."""
    weight, bias = _reals(tensors, step.weight)[:, :, 0], _reals(tensors, step.bias)
    length = sides(value)[1]
    _require_small(len(bias) * length, linear)
    matrix: Array = np.tensordot(weight, linear.matrix.reshape(weight.shape[1], length, -1), 1).astype(np.float64)
    offset = weight @ linear.offset.reshape(weight.shape[1], length) + bias[:, None]
    return Value((len(bias), length), linear=Linear(matrix.reshape(offset.size, -1), offset.reshape(-1)))


def _require_small(rows: int, linear: Linear) -> None:
    if rows * linear.matrix.shape[1] > LARGEST:
        raise NotCompiled(f"a spectrum of {rows} numbers")


def multiplied(
    draft: Draft, spot: Spot, steps: tuple[int, int, int], weight: Array, bias: Array, shape: tuple[int, ...]
) -> Value:
    """Add a product of matrices and return its value; `steps`: between rows, between columns, and number of rows."""
    result = fresh(draft, shape, len(shape) == 2)
    product = Product(spot, steps[0], steps[1], steps[2], np.ascontiguousarray(weight), bias, result.spot)
    draft.multiply(product)
    return replace(result, made=product)


def conv(step: Conv, value: Value, draft: Draft, tensors: Tensors) -> Value:
    """Add a convolution; its windows are overlapping rows of places, without copies."""
    weight, bias = _reals(tensors, step.weight), _reals(tensors, step.bias)
    filters, channels, width = weight.shape
    length = sides(value)[1] + 2 * step.pad - width + 1
    if width == 1 and not step.pad:
        return projected(draft, value, weight[:, :, 0].T, bias)
    rows = tight(draft, by_length(draft, value))
    if step.pad:
        # Places without gaps, zeros before and after.
        room = draft.room((sides(rows)[1] + 2 * step.pad) * channels, fixed=True)
        draft.say("copy", *at(rows), room.beyond(step.pad * channels), channels, sides(rows)[1], channels, 1)
        rows = Value((channels, sides(rows)[1] + 2 * step.pad), room, channels, length_first=True)
    matrix = weight.transpose(2, 1, 0).reshape(width * channels, filters)
    return multiplied(draft, rows.spot, (channels, 1, length), matrix, bias[None], (filters, length))


def projected(draft: Draft, value: Value, weight: Array, bias: Array) -> Value:
    """Return every place times a matrix (in, out); merged with the product before it if that one's input is far
    narrower.
    """
    before, length = value.made, sides(value)[1]
    if before is not None and not before.relu and before.more is None and len(before.weight) * NARROW <= len(weight):
        steps = (before.row_step, before.col_step, before.m)
        joined = before.bias @ weight + bias
        return multiplied(draft, before.a, steps, before.weight @ weight, joined, (len(bias), length))
    value = settled(draft, value)
    if value.length_first or value.shape[0] == 1:
        value = by_length(draft, value)
        return multiplied(draft, value.spot, (value.step, 1, length), weight, bias[None], (len(bias), length))
    return multiplied(draft, value.spot, (1, value.step, length), weight, bias[None], (len(bias), length))


def attention(step: Attention, value: Value, draft: Draft, tensors: Tensors) -> Value:
    """Add attention: queries, keys and values are one product, with 1 / sqrt(depth) in the queries' weights."""
    width, length = sides(value)
    memory = draft.kept[step.memory] if step.memory is not None else value
    depth, known = width // step.heads, sides(memory)[1]
    weight, bias = _reals(tensors, step.weight).copy(), _reals(tensors, step.bias).copy()
    weight[:width] *= depth**-0.5
    bias[:width] *= depth**-0.5
    if step.memory is None:
        queries = projected(draft, value, weight.T, bias)
        places = [(queries.spot.beyond(part * width), 3 * width) for part in range(3)]
    else:
        queries = projected(draft, value, weight[:width].T, bias[:width])
        rest = projected(draft, memory, weight[width:].T, bias[width:])
        places = [at(queries), at(rest), (rest.spot.beyond(width), 2 * width)]
    result = fresh(draft, (width, length), True)
    lanes = draft.instructions.lanes
    one, wide = -(-length // lanes) * lanes, -(-step.heads * length // lanes) * lanes
    work = draft.room(depth * one + known * wide + 2 * step.heads * one)
    most = 0 if step.sparse is None or step.sparse >= length else step.sparse
    three = [field for place in places for field in place]
    draft.say("attention", *three, *at(result), step.heads, depth, length, known, int(step.causal), work, most)
    return projected(draft, result, _reals(tensors, step.out).T, _reals(tensors, step.out_bias))


def lstm(step: Lstm, value: Value, draft: Draft, tensors: Tensors) -> Value:
    """Add a long short-term memory; the gates' inputs of all places are one product."""
    state, length = _reals(tensors, step.state), sides(value)[1]
    hidden, lanes = state.shape[1], draft.instructions.lanes
    drive = projected(draft, value, _reals(tensors, step.weight).T, _reals(tensors, step.bias))
    result = fresh(draft, (hidden, length), True)
    room = draft.room(2 * -(-hidden // lanes) * lanes + 4 * hidden + 2 * lanes)
    draft.say("lstm", *at(drive), *at(result), length, hidden, draft.panels(state.T), int(step.reverse), room)
    return result


def _reals(tensors: Tensors, name: str) -> Array:
    return np.asarray(tensors[name], dtype=np.float64)
