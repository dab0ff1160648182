"""Steps over the places of a value: layer normalisation, attention, long short-term memory, linear prediction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.signals.linear_prediction import predictor_of
from palpate.signals.models.activations import soft
from palpate.signals.models.card import Conv
from palpate.signals.models.card_steps import Attention, Autoregression, Lstm, Norm
from palpate.signals.models.form import LARGEST, At, Built, Form, KeptValues, Run, Values
from palpate.signals.models.layers import rows_of, sides
from palpate.signals.models.triangles import Triangles


def norm(step: Norm, form: Form, at: At) -> Built:
    """Build (x - mean) / sqrt(variance + tiny) * weight + bias, over the channels of each place (Ba et al. 2016)."""
    weight, bias = _factors(step, form, at)
    standard = _standard(step, form, weight.dtype.type)

    def run(x: Values, kept: KeptValues) -> Values:
        y = standard(x, kept)
        y *= weight
        y += bias
        return y

    return run, replace(form, length_first=len(form.shape) == 2, owned=True)


def norm_before(
    step: Norm, other: Attention | Conv, make: Callable[[Any, Form, At], Built], form: Form, at: At
) -> Built:
    """Build a norm and a step that multiplies each place by a matrix, with the norm's weight and bias in the matrix."""
    gain, shift = _factors(step, form, at)
    sides(form, at)
    weight = at.reals(other.weight, None, len(gain), *([1] if isinstance(other, Conv) else []))
    flat = weight.reshape(len(weight), -1).astype(np.float64)
    bias = at.reals(other.bias, len(weight)) + flat @ shift
    changed = {
        other.weight: (flat * gain).reshape(weight.shape).astype(weight.dtype), other.bias: bias.astype(weight.dtype)
    }  # fmt: skip
    standard, between = _standard(step, form, weight.dtype.type), replace(form, length_first=True, owned=True)
    then, out = make(other, between, replace(at, tensors={**at.tensors, **changed}))

    def run(x: Values, kept: KeptValues) -> Values:
        return then(standard(x, kept), kept)

    return run, out


def _standard(step: Norm, form: Form, kind: Callable[[float], Any]) -> Run:
    """Return a function that scales the channels of each place, or a list, to mean 0 and variance 1."""
    size = form.shape[0]
    share, least = np.full(size, kind(1 / size)), kind(size * step.tiny)
    root, turned = kind(size**0.5), len(form.shape) == 2 and not form.length_first

    def run(x: Values, _kept: KeptValues) -> Values:
        given = (x.swapaxes(1, 2) if turned else x).astype(share.dtype, copy=False)
        y: Values = given - (given @ share)[..., None]
        squares = np.vecdot(y, y)
        squares += least
        y *= (np.sqrt(squares) / squares * root)[..., None]  # an overflow becomes NaN and is refused, 1 / sqrt hides it
        return y

    return run


def _factors(step: Norm, form: Form, at: At) -> tuple[Values, Values]:
    weight = at.reals(step.weight, form.shape[0])
    return weight, at.reals(step.bias, form.shape[0]).astype(weight.dtype)


@dataclass(frozen=True)
class _Heads:
    """The projection matrices of an attention, transposed to multiply rows; the scale is in those of the queries."""

    asking: Values
    asking_bias: Values
    answering: Values
    answering_bias: Values
    out: Values
    out_bias: Values
    heads: int

    def split(self, rows: Values, length: int, parts: int) -> tuple[Values, ...]:
        """Return rows (n * length, parts * width) as `parts` views of (n, heads, length, width / heads)."""
        shaped = rows.reshape(-1, length, parts, self.heads, len(self.out) // self.heads)
        return tuple(shaped[:, :, part].swapaxes(1, 2) for part in range(parts))


def attention(step: Attention, form: Form, at: At) -> Built:
    """Build multi-head scaled dot-product attention; `sparse` as in Zhou et al. 2021, with all keys looked at."""
    width, length = sides(form, at)
    memory = None if step.memory is None else _memory(step, form, at)
    if width % step.heads:
        raise at.refuse(f"{step.heads} heads do not share {width} channels evenly")
    weight = at.reals(step.weight, 3 * width, width)
    bias = at.reals(step.bias, 3 * width).astype(weight.dtype)
    scale = np.ones(3 * width)
    scale[:width] = (width // step.heads) ** -0.5
    weight = np.ascontiguousarray((weight * scale[:, None]).astype(weight.dtype).T)
    bias = (bias * scale).astype(weight.dtype)
    out = np.ascontiguousarray(at.reals(step.out, width, width).astype(weight.dtype).T)
    out_bias = at.reals(step.out_bias, width).astype(weight.dtype)
    apart = 0 if step.memory is None else width
    heads = _Heads(weight[:, :apart], bias[:apart], weight[:, apart:], bias[apart:], out, out_bias, step.heads)
    keys = length if memory is None else memory.shape[1]
    if step.heads * length * keys > LARGEST:
        raise at.refuse(f"{length} places ask {keys} with {step.heads} heads; at most {LARGEST} numbers are run")
    future = np.triu(np.ones((length, keys), dtype=bool), 1).T if step.causal else None
    chosen = length if step.sparse is None else min(step.sparse, length)

    def run(x: Values, kept: KeptValues) -> Values:
        queries, known, values = _projected(x, form, kept.get(step.memory or ""), memory, heads)
        scores = known @ queries.swapaxes(2, 3)  # (n, heads, keys, queries): sums over keys run along whole rows
        lazy = None if chosen == length else _lazy(scores, chosen)
        if future is not None:
            scores[..., future] = -np.inf
        shares = soft(scores, axis=2)
        answers = np.empty((len(x), length, heads.heads, width // heads.heads), dtype=shares.dtype)
        np.matmul(shares.swapaxes(2, 3), values, out=answers.swapaxes(1, 2))
        if lazy is not None:
            # Places that do not ask answer the mean of the values, or where causal their sum up to there.
            by_head = answers.swapaxes(1, 2)
            mean = np.broadcast_to(values.mean(axis=2, keepdims=True), by_head.shape)
            by_head[lazy] = (np.cumsum(values, axis=2) if step.causal else mean)[lazy]
        y: Values = answers.reshape(-1, width) @ heads.out
        y += heads.out_bias
        return y.reshape(-1, length, width)

    return run, Form(form.shape, length_first=True, owned=True)


def _memory(step: Attention, form: Form, at: At) -> Form:
    """Return the form of the kept value that keys and values are computed from."""
    memory = at.form_of_kept(step.memory or "")
    if len(memory.shape) != 2 or memory.shape[0] != form.shape[0]:
        raise at.refuse(f"{step.memory!r} has shape {memory.shape}; ({form.shape[0]}, any) is expected")
    if step.causal and memory.shape[1] != form.shape[1]:
        raise at.refuse(f"it is causal over {form.shape[1]} places and {step.memory!r} has {memory.shape[1]}")
    return memory


def _projected(
    x: Values, form: Form, remembered: Values | None, memory: Form | None, heads: _Heads
) -> tuple[Values, ...]:
    """Return the queries, keys and values."""
    rows = rows_of(x, form).astype(heads.out.dtype, copy=False)
    if remembered is None or memory is None:
        return heads.split(_linear(rows, heads.answering, heads.answering_bias), form.shape[1], 3)
    known = rows_of(remembered, memory).astype(heads.out.dtype, copy=False)
    queries = heads.split(_linear(rows, heads.asking, heads.asking_bias), form.shape[1], 1)
    return queries + heads.split(_linear(known, heads.answering, heads.answering_bias), memory.shape[1], 2)


def _linear(rows: Values, matrix: Values, bias: Values) -> Values:
    y: Values = rows @ matrix
    y += bias
    return y


def _lazy(scores: Values, chosen: int) -> Values:
    """Return a mask (n, heads, queries) of all but the `chosen` places whose greatest score stands out most.

    Of equal places the first are chosen. A place whose scores overflowed is not in the mask, and its scores are set to
    NaN.
    """
    apart = scores.max(axis=2) - scores.mean(axis=2)
    if not (known := np.isfinite(apart)).all():  # nobody knows whether a place whose scores overflowed would ask
        scores += np.where(known, 0.0, np.nan).astype(scores.dtype)[:, :, None]
    lazy = np.ones(apart.shape, dtype=bool)
    np.put_along_axis(lazy, np.argsort(-apart, axis=2, kind="stable")[..., :chosen], False, axis=2)
    return np.asarray(lazy & known)


def lstm(step: Lstm, form: Form, at: At) -> Built:
    """Build the step. All gates are one tanh: sigmoid(x) = (1 + tanh(x / 2)) / 2, with the halves in the weights."""
    channels, length = sides(form, at)
    weight = at.reals(step.weight, None, channels)
    if len(weight) % 4:
        raise at.refuse(f"{step.weight!r} has {len(weight)} rows; four gates share them evenly")
    hidden = len(weight) // 4
    if len(weight) * length > LARGEST:
        raise at.refuse(f"{len(weight)} gates at {length} places; at most {LARGEST} numbers are run")
    state = at.reals(step.state, 4 * hidden, hidden).astype(weight.dtype)
    bias = at.reals(step.bias, 4 * hidden).astype(weight.dtype)
    # Weights for rows, gates in the order input, forget, output, cell; the first three halved.
    place = np.arange(hidden)
    gates = np.concatenate([place, place + hidden, place + 3 * hidden, place + 2 * hidden])
    half = np.ones(4 * hidden, dtype=weight.dtype)
    half[: 3 * hidden] = 0.5
    matrix, state, bias = (np.ascontiguousarray(values[gates].T * half) for values in (weight, state, bias))
    order = range(length - 1, -1, -1) if step.reverse else range(length)

    def run(x: Values, _kept: KeptValues) -> Values:
        drive = rows_of(x, form).astype(matrix.dtype, copy=False) @ matrix
        drive += bias
        # (length, n, gates), so that each place is one block
        places = np.ascontiguousarray(drive.reshape(-1, length, 4 * hidden).swapaxes(0, 1))
        return _through(places, state, order, hidden).swapaxes(0, 1)

    return run, Form((hidden, length), length_first=True, owned=True)


def _through(places: Values, state: Values, order: range, hidden: int) -> Values:
    """Return the output at each place, (length, n, hidden)."""
    given = np.empty((*places.shape[:2], hidden), dtype=places.dtype)
    cell = np.zeros(given.shape[1:], dtype=places.dtype)
    before = cell
    passed = np.empty_like(cell)
    for place in order:
        gates = places[place]
        gates += before @ state
        np.tanh(gates, out=gates)
        three = gates[:, : 3 * hidden]
        three *= 0.5
        three += 0.5
        cell *= three[:, hidden : 2 * hidden]
        np.multiply(three[:, :hidden], gates[:, 3 * hidden :], out=passed)
        cell += passed
        before = given[place]
        np.tanh(cell, out=before)
        before *= three[:, 2 * hidden :]
    return given


def autoregression(step: Autoregression, form: Form, at: At) -> Built:
    """Build the mean and log SD of the next acceleration, in double precision whatever the tensors are stored in."""
    if len(form.shape) != 2 or form.shape[0] != 3:
        raise at.refuse(f"shape {form.shape} comes to it; (3, length) is expected: acceleration, speed, force")
    _, length = sides(form, at)
    points = at.reals(step.points, None, 2).astype(np.float64)
    log_sd = at.reals(step.log_sd, len(points)).astype(np.float64)
    frequencies = _rising(step, len(points), length, at)
    order = frequencies.shape[1]
    rows = at.wholes(step.triangles, None, 3)
    if rows.min() < 0 or rows.max() >= len(points):
        raise at.refuse(f"{step.triangles!r} names a point that is not there; there are {len(points)}")
    among = Triangles(points, rows.astype(np.int64))
    per, predictor = np.array(step.per), predictor_of(order)

    def run(x: Values, _kept: KeptValues) -> Values:
        signals = (x.swapaxes(1, 2) if form.length_first else x).astype(np.float64, copy=False)
        corners, shares = among.corners(signals[:, 1:, -1] / per)
        mixed = np.matmul(shares[:, None], frequencies[corners])[:, 0]
        past = signals[:, 0, : -order - 1 : -1]
        answers = np.empty((len(x), 2))
        answers[:, 0] = (predictor(mixed) * past).sum(axis=1)
        answers[:, 1] = (log_sd[corners] * shares).sum(axis=1)
        return answers

    return run, Form((2,), owned=True)


def _rising(step: Autoregression, count: int, length: int, at: At) -> Values:
    """Return the frequencies. Raises ModelFileError unless they rise, so that interpolated predictors are stable
    too.
    """
    frequencies = at.reals(step.frequencies, count, None).astype(np.float64)
    order = frequencies.shape[1]
    if order > length or order * count > LARGEST:
        raise at.refuse(f"{step.frequencies!r} looks {order} samples back at {count} points; {length} samples come")
    ends = np.zeros((count, 1)), np.full((count, 1), np.pi)
    if not (np.diff(np.concatenate([ends[0], frequencies, ends[1]], axis=1)) > 0).all():
        raise at.refuse(f"{step.frequencies!r} does not rise from above 0 to below pi at every point: not stable")
    return frequencies
