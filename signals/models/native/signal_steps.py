"""Steps of signals: layer normalisation, spectra, and linear prediction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.models.card_steps import Autoregression, Cartesian, Norm, Polar
from palpate.signals.models.native.draft import Draft
from palpate.signals.models.native.plain_steps import Tensors
from palpate.signals.models.native.shapes import at, by_channel, by_length, fresh, is_list, settled
from palpate.signals.models.native.values import Linear, NotCompiled, Value
from palpate.signals.models.triangles import Triangles


def norm(step: Norm, value: Value, draft: Draft, tensors: Tensors) -> Value:
    """Add a normalisation of each row."""
    value = settled(draft, value) if is_list(value) else by_length(draft, value)
    result = value if value.free else fresh(draft, value.shape, value.length_first)
    rows, cols = value.matrix
    room = -cols % draft.instructions.lanes
    factors = [
        draft.weight(np.pad(np.asarray(tensors[name], np.float64), (0, room))) for name in (step.weight, step.bias)
    ]
    tiny = draft.doubles.put(np.array([step.tiny]))
    draft.say("norm", *at(value), *at(result), rows, cols, *factors, tiny)
    return Value(result.shape, result.at, result.step, result.length_first, free=True)


def polar(_step: Polar, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Add the conversion to magnitude and phase, in double precision because a phase needs its smaller part exactly."""
    length = value.shape[1]
    result = fresh(draft, (2, length), False)
    if value.linear is None:
        given = by_channel(draft, value)
        draft.say("polar", 0, *at(given), *at(result), length, 0)
        return result
    draft.say("polar", _spectrum(draft, value.linear), 0, 0, *at(result), length, 1)
    return result


def _spectrum(draft: Draft, linear: Linear) -> int:
    """Add the computation of the formula's values in double precision, and return where they lie."""
    used = np.flatnonzero(linear.matrix.any(axis=0))
    first, past = (int(used[0]), int(used[-1]) + 1) if len(used) else (0, 1)
    matrix, rows = linear.matrix[:, first:past], len(linear.matrix)
    place, put = draft.wide_room(rows), draft.doubles.put
    columns, offset = put(np.ascontiguousarray(matrix.T)), put(linear.offset)
    draft.say("linear", place, rows, first, past - first, columns, offset)
    return place


def cartesian(_step: Cartesian, value: Value, draft: Draft, _tensors: Tensors) -> Value:
    """Add the conversion to real and imaginary parts."""
    value = by_channel(draft, value)
    result = fresh(draft, value.shape, False)
    draft.say("cartesian", *at(value), *at(result), value.shape[1])
    return result


def autoregression(step: Autoregression, value: Value, draft: Draft, tensors: Tensors) -> Value:
    """Add an autoregression in double precision, computed from the input itself."""
    gains = _gains(value.linear)
    points, frequencies, log_sd = (
        np.asarray(tensors[name], dtype=np.float64) for name in (step.points, step.frequencies, step.log_sd)
    )
    among = Triangles(points, np.asarray(tensors[step.triangles], dtype=np.int64))
    put, result = draft.doubles.put, fresh(draft, (2,), False)
    start = points[among._rim[:, 0]]
    edges = np.column_stack([start, points[among._rim[:, 1]] - start]) if len(among._rim) else np.zeros((0, 4))
    order, length, wide = frequencies.shape[1], value.shape[1], draft.wide_room(2)
    per = np.array(step.per) / gains[2 * length - 1 :: length]
    draft.say(
        "autoregression", result.spot, wide, length, order, len(among._full), len(among._rim),
        put(among._shares), put(among._full.astype(np.float64)), put(edges), put(among._rim.astype(np.float64)),
        put(frequencies), put(log_sd), put(per), put(gains[:length]), draft.wide_room(3 * order + 16),
    )  # fmt: skip
    return replace(result, free=False, wide=wide)


def _gains(linear: Linear | None) -> Array:
    """Return the factors of the input's numbers. Raises NotCompiled if the value is anything but the scaled input."""
    if linear is None or linear.matrix.shape[0] != linear.matrix.shape[1] or linear.offset.any():
        raise NotCompiled("a predictor of anything but the input, each number by a factor")
    gains: Array = np.diagonal(linear.matrix).copy()
    if not gains.all() or (linear.matrix != np.diag(gains)).any():
        raise NotCompiled("a predictor of anything but the input, each number by a factor")
    return gains
