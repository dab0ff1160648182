"""Element-wise steps, and steps that keep, join and take parts of values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array
from palpate.signals.models.card import Activation, Affine, Clip, MaxPool, Reshape, Upsample
from palpate.signals.models.card_steps import Add, Join, Keep, Part, Recall, Turn
from palpate.signals.models.native.draft import Draft
from palpate.signals.models.native.shapes import (
    as_wanted,
    at,
    by_channel,
    by_length,
    fresh,
    is_list,
    settled,
    sides,
    spread,
    tight,
)
from palpate.signals.models.native.values import Linear, Product, Value

Tensors = Mapping[str, NDArray[np.generic]]
FUNCTIONS = ("relu", "tanh", "sigmoid", "gelu", "elu", "leaky", "softplus", "exp", "log", "square", "abs")


def affine(step: Affine, value: Value, draft: Draft, tensors: Tensors) -> Value:
    """Add an affine step as a formula before any other step, or merge it into the last product."""
    gain, offset = (
        np.asarray(tensors[given] if isinstance(given, str) else given, dtype=np.float64)
        for given in (step.gain, step.offset)
    )
    if value.linear is not None:
        gains, offsets = (np.broadcast_to(factor, value.shape).reshape(-1) for factor in (gain, offset))
        linear = Linear(value.linear.matrix * gains[:, None], value.linear.offset * gains + offsets)
        return replace(value, linear=linear)
    if value.sides is not None:
        value = settled(draft, value)
    gains, offsets = spread(gain, value), spread(offset, value)
    if value.free and _into_product(value.made, gains, offsets):
        return value
    result = fresh(draft, value.shape, value.length_first)
    rows, cols = value.matrix
    steps = [0 if len(factor) == 1 else cols for factor in (gains, offsets)]
    draft.say(
        "affine", *at(value), *at(result), rows, cols, draft.weight(gains), steps[0], draft.weight(offsets), steps[1]
    )
    return result


def _into_product(product: Product | None, gains: Array, offsets: Array) -> bool:
    """Merge a factor and an offset per column into a product without a relu; return whether that was possible."""
    if product is None or product.relu or product.more is not None or len(gains) > 1:
        return False
    product.weight, product.bias = product.weight * gains, product.bias * gains + offsets
    return True


def activation(step: Activation, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Add the function; a relu becomes part of the product before it."""
    if step.function == "softmax":
        value = settled(draft, value) if is_list(value) else by_channel(draft, value)
        result = fresh(draft, value.shape, False)
        draft.say("softmax", *at(value), *at(result), *value.matrix)
        return result
    value = settled(draft, value)
    if step.function == "relu" and value.free and value.made is not None:
        value.made.relu = True
        return replace(value, made=None)
    result = value if value.free else fresh(draft, value.shape, value.length_first)
    draft.say("function", *at(value), *at(result), *value.matrix, FUNCTIONS.index(step.function))
    return replace(result, made=None)


def clip(step: Clip, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Add the clipping; values that are not finite stay so."""
    value = settled(draft, value)
    result = fresh(draft, value.shape, value.length_first)
    draft.say("clip", *at(value), *at(result), *value.matrix, draft.doubles.put(np.array([step.low, step.high])))
    return result


def max_pool(step: MaxPool, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Add the maximum of neighbouring places; rows are places."""
    value = by_length(draft, value)
    channels, length = sides(value)
    result = fresh(draft, (channels, length // step.size), True)
    draft.say("pool", *at(value), *at(result), length // step.size, channels, step.size)
    return result


def upsample(step: Upsample, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Add the repetition of every place; rows are places."""
    value = by_length(draft, value)
    channels, length = sides(value)
    result = fresh(draft, (channels, length * step.times), True)
    draft.say("repeat", *at(value), *at(result), length, channels, step.times)
    return result


def reshape(step: Reshape, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Add a reshape; a list stays in length-first order where the next step can read it, else numbers are moved."""
    if value.linear is not None:
        return replace(value, shape=step.shape)
    if len(step.shape) == 1 and not is_list(value) and value.length_first and 1 not in value.shape:
        value = tight(draft, value)
        return Value(step.shape, value.at, value.size, sides=sides(value))
    if value.sides == step.shape:
        return Value(step.shape, value.at, step.shape[0], length_first=True)
    value = settled(draft, value) if is_list(value) else tight(draft, by_channel(draft, value))
    return Value(step.shape, value.at, step.shape[-1])


def keep(step: Keep, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Keep the value for later, and mark it as not to be changed."""
    draft.kept[step.kept] = replace(value, free=False)
    return draft.kept[step.kept]


def recall(step: Recall, _value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Return the kept value."""
    return draft.kept[step.kept]


def add(step: Add, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Add a kept value, as part of the product before it if there is one."""
    return added(settled(draft, value), draft.kept[step.kept], draft, False)


def added(value: Value, other: Value, draft: Draft, relu: bool) -> Value:
    """Return value + other, followed by a relu if `relu`."""
    other = settled(draft, other)
    if not is_list(value):
        other = as_wanted(draft, other, value.length_first)
    product = value.made
    if value.free and product is not None and not product.relu and product.more is None:
        product.more, product.more_step, product.relu = other.spot, other.step, relu
        # What is added may have been brought into order after the product was written down: the product then waits.
        draft.lines.remove(product)
        draft.lines.append(product)
        return replace(value, made=None if relu else product)
    into = fresh(draft, value.shape, value.length_first)
    draft.say("add", *at(value), *at(other), *at(into), *value.matrix, int(relu))
    return into


def join(step: Join, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Join channels one below the other, or lists one after the other."""
    values = [value, *(draft.kept[name] for name in step.kept)]
    linears = [item.linear for item in values if item.linear is not None]
    if len(linears) == len(values):
        matrix = np.concatenate([linear.matrix for linear in linears])
        offset = np.concatenate([linear.offset for linear in linears])
        first = sum(item.shape[0] for item in values)
        return Value((first, *values[0].shape[1:]), linear=Linear(matrix, offset))
    values = [settled(draft, item) for item in values]
    if is_list(value):
        result = fresh(draft, (sum(item.size for item in values),), False)
        _copy_all(draft, [(item, 1, item.size) for item in values], result)
        return result
    length = sides(value)[1]
    result = fresh(draft, (sum(sides(item)[0] for item in values), length), True)
    _copy_all(draft, [(item, length, sides(item)[0]) for item in values], result)
    return result


def _copy_all(draft: Draft, values: list[tuple[Value, int, int]], result: Value) -> None:
    start = result.spot
    for value, rows, cols in values:
        across = not is_list(value) and not value.length_first
        steps = (1, value.step) if across else (value.step, 1)
        draft.say("copy", value.spot, steps[0], start, result.step, rows, cols, steps[1])
        start = start.beyond(cols)


def part(step: Part, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Return a view of some channels, numbers or places."""
    count = step.stop - step.start
    shape = (value.shape[0], count) if step.along == "length" else (count, *value.shape[1:])
    if value.linear is not None:
        places = np.arange(value.size).reshape(value.shape)
        taken = places[:, step.start : step.stop] if step.along == "length" else places[step.start : step.stop]
        linear = Linear(value.linear.matrix[taken.reshape(-1)], value.linear.offset[taken.reshape(-1)])
        return Value(shape, linear=linear)
    value = settled(draft, value)
    along_rows = not is_list(value) and (step.along == "length") == value.length_first
    past = step.start * (value.step if along_rows else 1)
    return Value(shape, value.spot.beyond(past), value.step, value.length_first)


def turn(_step: Turn, value: Value, _draft: Draft, _tensors: Tensors) -> Value:
    """Read channels as places; no number is moved."""
    channels, length = sides(value)
    if value.linear is not None:
        order = np.arange(value.size).reshape(channels, length).T.reshape(-1)
        return Value((length, channels), linear=Linear(value.linear.matrix[order], value.linear.offset[order]))
    return replace(value, shape=(length, channels), length_first=not value.length_first, made=None)
