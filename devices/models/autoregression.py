"""A linear predictor whose line spectral frequencies follow speed and force."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from palpate.devices.models.form import LARGEST, At, Built, Form, Kept, Values
from palpate.devices.models.layers import sides
from palpate.devices.models.triangles import Triangles
from palpate.protocols.signal_steps import Autoregression


def autoregression(step: Autoregression, form: Form, at: At) -> Built:
    """Mean and log SD of the next acceleration; computed in double precision whatever the numbers are stored in."""
    if len(form.shape) != 2 or form.shape[0] != 3:
        raise at.refuse(f"shape {form.shape} comes to it; (3, length) is expected: acceleration, speed, force")
    _, length = sides(form, at)
    points = at.reals(step.points, None, 2).astype(np.float64)
    log_sd = at.reals(step.log_sd, len(points)).astype(np.float64)
    frequencies = _rising(step, len(points), length, at)
    order = frequencies.shape[1]
    among = Triangles(points, _rows(step, len(points), at))
    per, predictor = np.array(step.per), predictor_of(order)

    def run(x: Values, _kept: Kept) -> Values:
        signals = (x.swapaxes(1, 2) if form.length_first else x).astype(np.float64, copy=False)
        corners, shares = among.corners(signals[:, 1:, -1] / per)
        mixed = np.matmul(shares[:, None], frequencies[corners])[:, 0]
        past = signals[:, 0, : -order - 1 : -1]
        answers = np.empty((len(x), 2))
        answers[:, 0] = (predictor(mixed) * past).sum(axis=1)
        answers[:, 1] = (log_sd[corners] * shares).sum(axis=1)
        return answers

    return run, Form((2,), owned=True)


def predictor_of(order: int) -> Callable[[Values], Values]:
    """From line spectral frequencies (n, order) to the weights (n, order) of the past, newest first.

    With P and Q, the symmetric and the antisymmetric polynomial whose roots are e^(+-j f) of every second frequency,
    A = (P + Q) / 2 is the prediction error filter (Itakura 1975; Soong and Juang 1984). Both are products that are
    real but for a turn on the unit circle, so they are multiplied there and brought back by two matrices.
    """
    half = (order + 2) // 2 + 1
    count = 2 * (half - 1)
    angle = 2 * np.pi * np.arange(half) / count
    at_places = np.exp(-1j * angle)
    turned = at_places ** np.array(order // 2 if order % 2 == 0 else (order + 1) // 2)
    symmetric = turned * (1 + at_places if order % 2 == 0 else 1)
    other = (turned * (1 - at_places)) if order % 2 == 0 else turned / at_places * (1 - at_places**2)
    twice = np.where((np.arange(half) == 0) | (np.arange(half) == half - 1), 1.0, 2.0) / count
    back = np.exp(1j * np.outer(angle, np.arange(1, order + 1))) * twice[:, None]
    of_symmetric, of_other = (-(factor[:, None] * back).real / 2 for factor in (symmetric, other))
    cosines = 2 * np.cos(angle)

    def weights(frequencies: Values) -> Values:
        apart = cosines - 2 * np.cos(frequencies)[..., None]
        first = np.multiply.reduce(apart[:, 0::2], axis=1)
        second = np.multiply.reduce(apart[:, 1::2], axis=1)
        found: Values = first @ of_symmetric + second @ of_other
        return found

    return weights


def _rising(step: Autoregression, count: int, length: int, at: At) -> Values:
    """The frequencies, if they make stable predictors: those between them do so too."""
    frequencies = at.reals(step.frequencies, count, None).astype(np.float64)
    order = frequencies.shape[1]
    if order > length or order * count > LARGEST:
        raise at.refuse(f"{step.frequencies!r} looks {order} samples back at {count} points; {length} samples come")
    ends = np.zeros((count, 1)), np.full((count, 1), np.pi)
    if not (np.diff(np.concatenate([ends[0], frequencies, ends[1]], axis=1)) > 0).all():
        raise at.refuse(f"{step.frequencies!r} does not rise from above 0 to below pi at every point: not stable")
    return frequencies


def _rows(step: Autoregression, count: int, at: At) -> Values:
    rows = at.wholes(step.triangles, None, 3)
    if rows.min() < 0 or rows.max() >= count:
        raise at.refuse(f"{step.triangles!r} names a point that is not there; there are {count}")
    return rows.astype(np.int64)
