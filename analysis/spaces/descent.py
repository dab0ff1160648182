"""Downhill to a minimum of stress-1: majorisation, then a quasi-Newton descent of stress itself."""

from __future__ import annotations

import numpy as np

from palpate.analysis.spaces.classical import torgerson
from palpate.analysis.spaces.isotone import Order, disparities, stress_1
from palpate.analysis.spaces.orienting import unit_size
from palpate.analysis.spaces.quasi_newton import descended, settled
from palpate.analysis.statistics.doubles import Floats

MAJORISED, POLISHED = 40, 300


def classical_start(between: Floats, dimensions: int) -> Floats:
    """Torgerson's map; a dimension that the dissimilarities lack is filled with small alternating steps."""
    points, _, _ = torgerson(between)
    kept = points[:, :dimensions]
    lacking = dimensions - kept.shape[1]
    places = np.arange(len(between))[:, None] + np.arange(lacking)
    return np.hstack([kept, 1e-3 * (-1.0) ** places * (1 + places)])


def improved(start: Floats, order: Order, majorised: int = MAJORISED, polished: int = POLISHED) -> tuple[Floats, float]:
    """A start led downhill to a minimum of stress-1, and that stress."""
    points = unit_size(start - start.mean(axis=0))
    for _ in range(majorised):
        points = _guttman(points, order)
    shape = points.shape
    ended, squared = descended(lambda flat: _squared_stress(flat, order, shape), points.ravel(), polished)
    return ended.reshape(shape), float(np.sqrt(squared))


def at_rest(points: Floats, order: Order, steps: int) -> Floats:
    """A map at a minimum of stress-1 moved to where the slope vanishes, so that its places have all their digits."""
    shape = points.shape
    return settled(lambda flat: _squared_stress(flat, order, shape), points.ravel(), steps).reshape(shape)


def _between(points: Floats, order: Order) -> tuple[Floats, Floats]:
    """The difference (dimensions, pairs) and the distance of the objects of each pair."""
    across = np.ascontiguousarray(points.T)
    apart: Floats = across.take(order.first, axis=1) - across.take(order.second, axis=1)
    return apart, np.sqrt((apart * apart).sum(axis=0))


def _gathered(pulls: Floats, apart: Floats, order: Order, objects: int) -> Floats:
    """What pulls along each pair's difference add up to at each object."""
    return np.column_stack(
        [
            np.bincount(order.first, force, objects) - np.bincount(order.second, force, objects)
            for force in pulls * apart
        ]
    )


def _guttman(points: Floats, order: Order) -> Floats:
    """One step of majorisation: points whose distances come nearer to the disparities."""
    apart, distances = _between(points, order)
    fitted = disparities(distances, order)
    size = float(fitted @ fitted)
    if size > 0:
        fitted = fitted * np.sqrt(float(distances @ distances) / size)
    ratio = np.divide(fitted, distances, out=np.zeros_like(fitted), where=distances > 0)
    moved = _gathered(ratio, apart, order, len(points))
    return unit_size(moved) if moved.any() else points


def _squared_stress(flat: Floats, order: Order, shape: tuple[int, ...]) -> tuple[float, Floats]:
    """Stress-1 squared and its slope; the disparities are a projection, so they add nothing to the slope."""
    apart, distances = _between(flat.reshape(shape), order)
    fitted = disparities(distances, order)
    total = float(distances @ distances)
    stress = stress_1(distances, fitted) ** 2
    pull = distances - fitted - stress * distances
    pull = np.divide(pull, distances, out=np.zeros_like(pull), where=distances > 0)
    return stress, (_gathered(pull, apart, order, shape[0]) * (2 / total)).ravel()
