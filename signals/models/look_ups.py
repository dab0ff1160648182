"""The steps that compare an input with what was learned from: a kernel, a forest, the nearest example."""

from __future__ import annotations

import numpy as np

from palpate.signals.models.card import Forest, Kernel, Nearest
from palpate.signals.models.form import LARGEST, At, Built, Form, Kept, Values, flattened, missing_where_not_finite


def kernel(step: Kernel, form: Form, at: At) -> Built:
    """Return y = weights^T k(x), the mean of a Gaussian process (Rasmussen and Williams 2006, equation 2.25)."""
    points = at.reals(step.points, None, form.size)
    weights = at.reals(step.weights, len(points), None)
    flat, narrow = flattened(form), -0.5 / step.length / step.length
    if not np.isfinite(narrow):
        raise at.refuse(f"a length of {step.length:g} is too short to compute with")

    def run(x: Values, _kept: Kept) -> Values:
        given = flat(x).astype(points.dtype, copy=False)
        near = step.variance * np.exp(narrow * _squared_distances(given, points))
        return missing_where_not_finite(given, near @ weights)

    return run, Form((weights.shape[1],), owned=True)


def nearest(step: Nearest, form: Form, at: At) -> Built:
    """Return the values of the nearest point."""
    points = at.reals(step.points, None, form.size)
    values = at.reals(step.values, len(points), None)
    flat = flattened(form)

    def run(x: Values, _kept: Kept) -> Values:
        given = flat(x).astype(points.dtype, copy=False)
        return missing_where_not_finite(given, values[_squared_distances(given, points).argmin(axis=1)])

    return run, Form((values.shape[1],), owned=True)


def forest(step: Forest, form: Form, at: At) -> Built:
    """Return the mean over trees; all inputs go down all trees together, a level at a time."""
    feature, threshold, left, right, value = _nodes(step, form, at)
    roots = at.wholes(step.roots, None)
    if roots.min() < 0 or roots.max() >= len(feature):
        raise at.refuse(f"{step.roots!r} names a node that is not there; there are {len(feature)}")
    if len(roots) * value.shape[1] > LARGEST:
        raise at.refuse(f"{len(roots)} trees of {value.shape[1]} numbers; at most {LARGEST} together are run")
    flat = flattened(form)

    def run(x: Values, _kept: Kept) -> Values:
        given = flat(x).astype(threshold.dtype, copy=False)
        rows = np.arange(len(given))[:, None]
        node = np.broadcast_to(roots, (len(given), len(roots)))
        while (inner := feature[node] >= 0).any():
            goes_left = given[rows, feature[node]] <= threshold[node]
            node = np.where(inner, np.where(goes_left, left[node], right[node]), node)
        return missing_where_not_finite(given, value[node].mean(axis=1, dtype=np.float64))

    return run, Form((value.shape[1],), owned=True)


def _nodes(step: Forest, form: Form, at: At) -> tuple[Values, ...]:
    """Return the nodes, if every way through them ends: a child always stands after its parent."""
    feature = at.wholes(step.feature, None)
    count = len(feature)
    threshold = at.reals(step.threshold, count)
    left, right = at.wholes(step.left, count), at.wholes(step.right, count)
    if feature.min() < -1 or feature.max() >= form.size:
        raise at.refuse(f"{step.feature!r} asks for an input that is not there; there are {form.size}")
    inner = np.flatnonzero(feature >= 0)
    for name, child in ((step.left, left), (step.right, right)):
        if ((child[inner] <= inner) | (child[inner] >= count)).any():
            raise at.refuse(f"{name!r} leads back, or to a node that is not there; a child stands after its parent")
    return feature, threshold, left, right, at.reals(step.value, count, None)


def _squared_distances(x: Values, points: Values) -> Values:
    """Return (n, in) and (m, in) to (n, m), by differences: exact also where both lie far from 0."""
    return np.stack([((row - points) ** 2).sum(axis=1) for row in x])
