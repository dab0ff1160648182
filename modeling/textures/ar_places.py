"""Where models lie over speed and force, and how much of each a speed and a force between them is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, QhullError

from palpate.signals.arrays import Array

PER = (100.0, 1.0)
"""mm/s and N that count as equally far."""
NARROW = 1e-6
"""Points that differ less than this share of the wider side, or of `PER`, lie on a line."""
EDGE = -1e-9
"""A place so little outside a triangle is on its edge."""
Rows = NDArray[np.int64]


@dataclass(frozen=True)
class Mesh:
    """Points (k, 2), speed and force divided by `PER`; triangles (t, 3) of them; the outer edges (s, 2).

    Points on a line, two or one have triangles without area: [i, j, j], [i, i, i]. What plays the model has
    `signals.models.triangles.Triangles`, whose shares differ in the last digits.
    """

    points: Array
    triangles: Rows
    rim: Rows

    def shares(self, hand: Array) -> Array:
        """(n, 2) speed in mm/s and force in N to the share (n, k) of each point, together 1.

        Outside the triangles the nearest place on the rim counts.
        """
        places = np.asarray(hand, dtype=np.float64) / PER
        found = np.zeros((len(places), len(self.points)))
        inside = self._within(places, found)
        if not inside.all():
            self._nearest(places, np.flatnonzero(~inside), found)
        return found

    def _within(self, places: Array, found: Array) -> NDArray[np.bool_]:
        corners = self.points[self.triangles]
        sides = np.stack([corners[:, 0] - corners[:, 2], corners[:, 1] - corners[:, 2]], axis=2)
        full = np.abs(np.linalg.det(sides)) > NARROW * np.finfo(float).eps ** 0.5
        if not full.any():
            return np.zeros(len(places), dtype=bool)
        away = places[:, None] - corners[full, 2]
        two = np.einsum("tij,ntj->nti", np.linalg.inv(sides[full]), away)
        of_each = np.concatenate([two, 1 - two.sum(axis=2, keepdims=True)], axis=2)
        best = of_each.min(axis=2).argmax(axis=1)
        rows = np.arange(len(places))
        inside = of_each[rows, best].min(axis=1) >= EDGE
        share = np.maximum(of_each[rows, best], 0)[inside]
        places_of = self.triangles[full][best[inside]]
        found[np.flatnonzero(inside)[:, None], places_of] = share / share.sum(axis=1, keepdims=True)
        return np.asarray(inside)

    def _nearest(self, places: Array, rows: Rows, found: Array) -> None:
        start = self.points[self.rim[:, 0]]
        along = self.points[self.rim[:, 1]] - start
        away = places[rows][:, None] - start
        share = (away * along).sum(axis=2) / np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
        share = np.clip(share, 0, 1)
        edge = ((away - share[..., None] * along) ** 2).sum(axis=2).argmin(axis=1)
        of_edge = share[np.arange(len(rows)), edge]
        np.add.at(found, (rows, self.rim[edge, 0]), 1 - of_edge)
        np.add.at(found, (rows, self.rim[edge, 1]), of_edge)


def meshed(points: Array) -> Mesh:
    """Points (k, 2) and their Delaunay triangles; on a line, its pieces."""
    spread = np.ptp(points, axis=0)
    if (spread < NARROW * max(1.0, float(spread.max()))).any():
        return _line(points)
    try:
        found = Delaunay(points)
    except (QhullError, ValueError):
        return _line(points)
    return Mesh(points, found.simplices.astype(np.int64), found.convex_hull.astype(np.int64))


def _line(points: Array) -> Mesh:
    """Neighbours along the longer side."""
    order = np.argsort(points[:, np.ptp(points, axis=0).argmax()], kind="stable")
    first, second = (order[:-1], order[1:]) if len(order) > 1 else (order, order)
    edges = np.stack([first, second], axis=1).astype(np.int64)
    return Mesh(points, np.column_stack([edges, edges[:, 1]]), edges)
