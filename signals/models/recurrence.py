"""A long short-term memory along the length (Hochreiter and Schmidhuber 1997, with forget gates)."""

from __future__ import annotations

import numpy as np

from palpate.signals.models.card_steps import Lstm
from palpate.signals.models.form import LARGEST, At, Built, Form, Kept, Values
from palpate.signals.models.layers import rows_of, sides


def lstm(step: Lstm, form: Form, at: At) -> Built:
    """Return all gates are one tanh: sigmoid(x) = (1 + tanh(x / 2)) / 2, its halves being in the weights."""
    channels, length = sides(form, at)
    weight = at.reals(step.weight, None, channels)
    if len(weight) % 4:
        raise at.refuse(f"{step.weight!r} has {len(weight)} rows; four gates share them evenly")
    hidden = len(weight) // 4
    if len(weight) * length > LARGEST:
        raise at.refuse(f"{len(weight)} gates at {length} places; at most {LARGEST} numbers are run")
    matrix, state, bias = _turned(step, weight, hidden, at)
    order = range(length - 1, -1, -1) if step.reverse else range(length)

    def run(x: Values, _kept: Kept) -> Values:
        drive = rows_of(x, form).astype(matrix.dtype, copy=False) @ matrix
        drive += bias
        # (length, n, gates), so that each place is one block
        places = np.ascontiguousarray(drive.reshape(-1, length, 4 * hidden).swapaxes(0, 1))
        return _through(places, state, order, hidden).swapaxes(0, 1)

    return run, Form((hidden, length), length_first=True, owned=True)


def _turned(step: Lstm, weight: Values, hidden: int, at: At) -> tuple[Values, Values, Values]:
    """Return the weights for rows, gates in the order input, forget, output, cell; the first three halved."""
    state = at.reals(step.state, 4 * hidden, hidden).astype(weight.dtype)
    bias = at.reals(step.bias, 4 * hidden).astype(weight.dtype)
    place = np.arange(hidden)
    order = np.concatenate([place, place + hidden, place + 3 * hidden, place + 2 * hidden])
    half = np.ones(4 * hidden, dtype=weight.dtype)
    half[: 3 * hidden] = 0.5
    turned = [np.ascontiguousarray(matrix[order].T * half) for matrix in (weight, state, bias)]
    return turned[0], turned[1], turned[2]


def _through(places: Values, state: Values, order: range, hidden: int) -> Values:
    """(length, n, hidden): what is given at each place."""
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
