"""Bring values into the layout that an operation needs, mostly by reading them another way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.models.native.draft import Draft
from palpate.signals.models.native.values import Linear, NotCompiled, Spot, Value


def is_list(value: Value) -> bool:
    """Return whether the shape is (size,) rather than (channels, length)."""
    return len(value.shape) == 1


def sides(value: Value) -> tuple[int, int]:
    """Return the channels and the length. Raises NotCompiled for a list."""
    if is_list(value):
        raise NotCompiled("a list comes where channels and length are needed")
    return value.shape[0], value.shape[1]


def fresh(draft: Draft, shape: tuple[int, ...], length_first: bool) -> Value:
    """Reserve room for a new value."""
    value = Value(shape, length_first=length_first, free=True)
    rows, cols = value.matrix
    return replace(value, at=draft.room(rows * cols), step=cols)


def settled(draft: Draft, value: Value) -> Value:
    """Return the value as numbers in the workspace, computed if it was still a formula; a list in its own order."""
    if value.linear is not None:
        return _computed(draft, value, value.linear)
    if value.sides is None:
        return value
    lies = replace(value, shape=value.sides, sides=None, length_first=True, step=value.sides[0])
    moved = by_channel(draft, lies)
    packed_value = tight(draft, moved)
    return Value(value.shape, packed_value.at, value.size)


def _computed(draft: Draft, value: Value, linear: Linear) -> Value:
    if (np.count_nonzero(linear.matrix, axis=1) > 1).any():
        raise NotCompiled("a sum of the input's numbers that is no spectrum")
    result = fresh(draft, value.shape, False)
    one = np.abs(linear.matrix).argmax(axis=1)
    gains = np.take_along_axis(linear.matrix, one[:, None], axis=1)[:, 0]
    put = draft.doubles.put
    draft.say("normalise", result.spot, value.size, put(gains), put(linear.offset), put(one.astype(np.float64)))
    return replace(result, free=False)


def by_length(draft: Draft, value: Value) -> Value:
    """Return the value with one row for each place."""
    value = settled(draft, value)
    channels, length = sides(value)
    if value.length_first:
        return value
    if channels == 1:
        return replace(value, length_first=True, step=1, made=None, free=False)
    if length == 1 and value.step == 1:
        return replace(value, length_first=True, step=channels, made=None, free=False)
    return _turned(draft, value)


def by_channel(draft: Draft, value: Value) -> Value:
    """Return the value with one row for each channel."""
    value = settled(draft, value)
    channels, length = sides(value)
    if not value.length_first:
        return value
    if channels == 1 and value.step == 1:
        return replace(value, length_first=False, step=length, made=None, free=False)
    if length == 1:
        return replace(value, length_first=False, step=1, made=None, free=False)
    return _turned(draft, value)


def as_wanted(draft: Draft, value: Value, length_first: bool) -> Value:
    """Return the value in the requested order, length first or channels first."""
    return by_length(draft, value) if length_first else by_channel(draft, value)


def tight(draft: Draft, value: Value) -> Value:
    """Return the value without gaps between its rows."""
    if value.packed:
        return value
    result = fresh(draft, value.shape, value.length_first)
    rows, cols = value.matrix
    draft.say("copy", value.spot, value.step, result.spot, result.step, rows, cols, 1)
    return result


def _turned(draft: Draft, value: Value) -> Value:
    result = fresh(draft, value.shape, not value.length_first)
    rows, cols = result.matrix
    # the row of the new is the column of the old: one number further on each
    draft.say("copy", value.spot, 1, result.spot, result.step, rows, cols, value.step)
    return result


def spread(numbers: Array, value: Value) -> Array:
    """Return numbers broadcast to a value's shape, as a matrix in the value's layout; one row if all rows are equal."""
    full = np.broadcast_to(numbers, value.shape).astype(np.float64)
    matrix = full[None] if is_list(value) else full.T if value.length_first else full
    alike = bool((matrix == matrix[:1]).all())
    return np.ascontiguousarray(matrix[:1] if alike else matrix)


def at(value: Value) -> tuple[Spot, int]:
    """Return where the value lies and how far apart its rows are."""
    return value.spot, value.step
