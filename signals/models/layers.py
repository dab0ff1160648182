"""Steps of networks in NumPy, and steps that compare an input with the training data.

A convolution is one product of matrices.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import as_strided

from palpate.signals.models.card import Affine, Clip, Conv, Dense, Forest, Kernel, MaxPool, Nearest, Reshape, Upsample
from palpate.signals.models.form import (
    LARGEST,
    At,
    Built,
    Form,
    KeptValues,
    Run,
    Values,
    flattened,
    missing_where_not_finite,
)


def affine(step: Affine, form: Form, at: At) -> Built:
    """Build y = gain * x + offset."""
    gain, offset = _factor(step.gain, form, at), _factor(step.offset, form, at)

    def run(x: Values, _kept: KeptValues) -> Values:
        return np.asarray(gain * x + offset)

    return run, replace(form, owned=True)


def dense(step: Dense, form: Form, at: At, times: int = 1) -> Built:
    """Build y = weight x + bias; each element along the length stands for `times` equal ones."""
    weight = at.reals(step.weight, None, form.size * times)
    bias = at.reals(step.bias, len(weight)).astype(weight.dtype)
    if times > 1:
        weight = weight.reshape(len(weight), *form.shape, times).sum(axis=-1)
    if form.length_first:
        weight = weight.reshape(len(weight), *form.shape).swapaxes(1, 2)
    matrix = np.ascontiguousarray(weight.reshape(len(weight), -1)).T

    def run(x: Values, _kept: KeptValues) -> Values:
        y: Values = x.reshape(len(x), -1).astype(matrix.dtype, copy=False) @ matrix
        y += bias
        return y

    return run, Form((len(bias),), owned=True)


def conv(step: Conv, form: Form, at: At) -> Built:
    """Build the cross-correlation along the length: all windows side by side, times the weights."""
    channels, length = sides(form, at)
    weight = at.reals(step.weight, None, channels, None)
    filters, _, width = weight.shape
    bias = at.reals(step.bias, filters).astype(weight.dtype)
    out_length = length + 2 * step.pad - width + 1
    if out_length < 1 or out_length * width * channels > LARGEST:
        raise at.refuse(f"a width of {width} over a length of {length} and {step.pad} zeros on either side")
    matrix = np.ascontiguousarray(weight.transpose(2, 1, 0).reshape(width * channels, filters))
    if width == 1 and not step.pad:
        return by_place(matrix, bias, form), Form((filters, length), length_first=True, owned=True)

    def run(x: Values, _kept: KeptValues) -> Values:
        padded = np.zeros((len(x), length + 2 * step.pad, channels), dtype=matrix.dtype)
        padded[:, step.pad : step.pad + length] = x if form.length_first else x.swapaxes(1, 2)
        sample, row, item = padded.strides
        windows = as_strided(padded, (len(x), out_length, width * channels), (sample, row, item))
        y: Values = windows.reshape(len(x) * out_length, -1) @ matrix
        y += bias
        return y.reshape(len(x), out_length, filters)

    return run, Form((filters, out_length), length_first=True, owned=True)


def by_place(matrix: Values, bias: Values, form: Form) -> Run:
    """Return a function for x matrix + bias at each place: (n, length, channels) to (n, length, filters)."""
    length = form.shape[1]

    def run(x: Values, _kept: KeptValues) -> Values:
        y: Values = rows_of(x, form).astype(matrix.dtype, copy=False) @ matrix
        y += bias
        return y.reshape(-1, length, len(bias))

    return run


def rows_of(x: Values, form: Form) -> Values:
    """Return rows (n * length, channels): the places of all inputs one below the other."""
    return (x if form.length_first else x.swapaxes(1, 2)).reshape(-1, form.shape[0])


def max_pool(step: MaxPool, form: Form, at: At) -> Built:
    """Build the maximum of every `size` neighbours."""
    channels, length = sides(form, at)
    pooled = length // step.size
    if pooled < 1:
        raise at.refuse(f"a length of {length} has no {step.size} neighbours")

    def run(x: Values, _kept: KeptValues) -> Values:
        covered = (x if form.length_first else x.swapaxes(1, 2))[:, : pooled * step.size]
        most = np.maximum(covered[:, 0 :: step.size], covered[:, 1 :: step.size])
        for place in range(2, step.size):
            np.maximum(most, covered[:, place :: step.size], out=most)
        return most

    return run, Form((channels, pooled), length_first=True, owned=True)


def upsample(step: Upsample, form: Form, at: At) -> Built:
    """Build the repetition of every element, `times` times."""
    channels, length = require_sides(step, form, at)

    def run(x: Values, _kept: KeptValues) -> Values:
        return np.repeat(x, step.times, axis=1 if form.length_first else 2)

    return run, Form((channels, length * step.times), form.length_first, owned=True)


def reshape(step: Reshape, form: Form, at: At) -> Built:
    """Build the same numbers in C order in another shape: a list, or channels and length."""
    if len(step.shape) not in (1, 2) or any(side < 1 for side in step.shape) or Form(step.shape).size != form.size:
        raise at.refuse(f"{form.size} numbers of shape {form.shape} do not fit shape {step.shape}")
    flat = flattened(form)

    def run(x: Values, _kept: KeptValues) -> Values:
        return flat(x).reshape(len(x), *step.shape)

    return run, Form(step.shape, owned=form.owned)


def clip(step: Clip, form: Form, at: At) -> Built:
    """Build the limits low and high; values that are not finite stay so."""
    if step.low > step.high:
        raise at.refuse(f"low {step.low:g} is above high {step.high:g}")

    def run(x: Values, _kept: KeptValues) -> Values:
        return np.where(np.isfinite(x), np.clip(x, step.low, step.high), np.nan)

    return run, replace(form, owned=True)


def require_sides(step: Upsample, form: Form, at: At) -> tuple[int, int]:
    """Return the channels and length. Raises ModelFileError for a list, or where the copies would be too many."""
    channels, length = sides(form, at)
    if form.size * step.times > LARGEST:
        raise at.refuse(f"{form.size} numbers {step.times} times; at most {LARGEST} are run")
    return channels, length


def sides(form: Form, at: At) -> tuple[int, int]:
    """Return the channels and length. Raises ModelFileError for a list."""
    if len(form.shape) != 2:
        raise at.refuse(f"shape {form.shape} comes to it; (channels, length) is expected")
    return form.shape[0], form.shape[1]


def _factor(given: float | str, form: Form, at: At) -> float | Values:
    """Return a number, or a tensor broadcast to the form as it is stored."""
    if not isinstance(given, str):
        return given
    tensor = at.any_reals(given)
    try:
        fits = np.broadcast_shapes(tensor.shape, form.shape) == form.shape
    except ValueError:
        fits = False
    if not fits:
        raise at.refuse(f"{given!r} has shape {tensor.shape}; one that fits {form.shape} is expected")
    if form.length_first:
        return np.ascontiguousarray(np.broadcast_to(tensor, form.shape).T)
    return tensor


def kernel(step: Kernel, form: Form, at: At) -> Built:
    """Build y = weights^T k(x), the mean of a Gaussian process (Rasmussen and Williams 2006, equation 2.25)."""
    points = at.reals(step.points, None, form.size)
    weights = at.reals(step.weights, len(points), None)
    flat, narrow = flattened(form), -0.5 / step.length / step.length
    if not np.isfinite(narrow):
        raise at.refuse(f"a length of {step.length:g} is too short to compute with")

    def run(x: Values, _kept: KeptValues) -> Values:
        given = flat(x).astype(points.dtype, copy=False)
        near = step.variance * np.exp(narrow * _squared_distances(given, points))
        return missing_where_not_finite(given, near @ weights)

    return run, Form((weights.shape[1],), owned=True)


def nearest(step: Nearest, form: Form, at: At) -> Built:
    """Build the look-up of the values of the nearest point."""
    points = at.reals(step.points, None, form.size)
    values = at.reals(step.values, len(points), None)
    flat = flattened(form)

    def run(x: Values, _kept: KeptValues) -> Values:
        given = flat(x).astype(points.dtype, copy=False)
        return missing_where_not_finite(given, values[_squared_distances(given, points).argmin(axis=1)])

    return run, Form((values.shape[1],), owned=True)


def forest(step: Forest, form: Form, at: At) -> Built:
    """Build the mean over regression trees; all inputs descend all trees together, one level at a time."""
    feature = at.wholes(step.feature, None)
    count = len(feature)
    threshold = at.reals(step.threshold, count)
    left, right = at.wholes(step.left, count), at.wholes(step.right, count)
    if feature.min() < -1 or feature.max() >= form.size:
        raise at.refuse(f"{step.feature!r} asks for an input that is not there; there are {form.size}")
    inner = np.flatnonzero(feature >= 0)
    for name, child in ((step.left, left), (step.right, right)):
        if ((child[inner] <= inner) | (child[inner] >= count)).any():
            raise at.refuse(f"{name!r} leads back, or to a node that does not exist; a child comes after its parent")
    value = at.reals(step.value, count, None)
    roots = at.wholes(step.roots, None)
    if roots.min() < 0 or roots.max() >= len(feature):
        raise at.refuse(f"{step.roots!r} names a node that is not there; there are {len(feature)}")
    if len(roots) * value.shape[1] > LARGEST:
        raise at.refuse(f"{len(roots)} trees of {value.shape[1]} numbers; at most {LARGEST} together are run")
    flat = flattened(form)

    def run(x: Values, _kept: KeptValues) -> Values:
        given = flat(x).astype(threshold.dtype, copy=False)
        rows = np.arange(len(given))[:, None]
        node = np.broadcast_to(roots, (len(given), len(roots)))
        while (inside := feature[node] >= 0).any():
            goes_left = given[rows, feature[node]] <= threshold[node]
            node = np.where(inside, np.where(goes_left, left[node], right[node]), node)
        return missing_where_not_finite(given, value[node].mean(axis=1, dtype=np.float64))

    return run, Form((value.shape[1],), owned=True)


def _squared_distances(x: Values, points: Values) -> Values:
    """Return the squared distances (n, m) of x (n, in) from points (m, in), by differences: exact far from 0."""
    return np.stack([((row - points) ** 2).sum(axis=1) for row in x])
