"""A linear predictor whose line spectral frequencies follow speed and force."""

from __future__ import annotations

import numpy as np

from palpate.signals.linear_prediction import predictor_of
from palpate.signals.models.card_steps import Autoregression
from palpate.signals.models.form import LARGEST, At, Built, Form, Kept, Values
from palpate.signals.models.layers import sides
from palpate.signals.models.triangles import Triangles


def autoregression(step: Autoregression, form: Form, at: At) -> Built:
    """Return the mean and log SD of the next acceleration; computed in double precision whatever the numbers are stored
    in.
    """
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


def _rising(step: Autoregression, count: int, length: int, at: At) -> Values:
    """Return the frequencies, if they make stable predictors: those between them do so too."""
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
