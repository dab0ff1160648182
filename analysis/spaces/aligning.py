"""Turning, reflecting, stretching and shifting configurations onto a target, many at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.analysis.statistics.doubles import Floats


class Aligned(NamedTuple):
    """`points` (..., objects, dimensions) on the target; `turn` (..., dimensions, dimensions); `scale` (...)."""

    points: Floats
    turn: Floats
    scale: Floats
    trace: Floats


def aligned(target: Floats, others: Floats, scale: bool = True, reflection: bool = True) -> Aligned:
    """Least squares fit of each configuration to the target (both about their centroids, moved to the target's).

    `trace` is the sum of the (signed) singular values of their cross products: the correlation r for configurations of
    unit size. Sources: Schoenemann 1966; Gower 1975; without reflection Umeyama 1991.
    """
    centre = target.mean(axis=0)
    goal = target - centre
    about = others - others.mean(axis=-2, keepdims=True)
    cross = np.swapaxes(about, -1, -2) @ goal
    left, sizes, right = np.linalg.svd(cross)
    if not reflection:
        flip = np.sign(np.linalg.det(left) * np.linalg.det(right))
        sizes = np.concatenate((sizes[..., :-1], sizes[..., -1:] * flip[..., None]), axis=-1)
        left = np.concatenate((left[..., :, :-1], left[..., :, -1:] * flip[..., None, None]), axis=-1)
    turn = left @ right
    trace = sizes.sum(axis=-1)
    size = (about * about).sum(axis=(-1, -2))
    stretch = np.divide(trace, size, out=np.ones_like(trace), where=size > 0) if scale else np.ones_like(trace)
    return Aligned(stretch[..., None, None] * (about @ turn) + centre, turn, stretch, trace)


def correlations(target: Floats, others: Floats, reflection: bool = True) -> Floats:
    """The Procrustes correlation of each configuration with the target, both centred and of unit size already."""
    cross = np.swapaxes(others, -1, -2) @ target
    if reflection:
        result: Floats = np.linalg.svd(cross, compute_uv=False).sum(axis=-1)
        return result
    sizes = np.linalg.svd(cross, compute_uv=False)
    flip = np.sign(np.linalg.det(cross))
    signed: Floats = sizes[..., :-1].sum(axis=-1) + sizes[..., -1] * np.where(flip < 0, -1.0, 1.0)
    return signed


def normed(points: Floats) -> Floats:
    """A configuration about its centroid with a sum of squares of 1."""
    about = points - points.mean(axis=-2, keepdims=True)
    size = np.sqrt((about * about).sum(axis=(-1, -2), keepdims=True))
    result: Floats = about / size
    return result
