"""Barycentric weights of a place among triangles in the plane: between which corners it lies, and their shares."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from palpate.signals.models.form import Values

FLAT = 1e-12
"""A triangle whose area is at most this share of the square around all points counts as without an area."""
EDGE = -1e-9
"""A place outside a triangle by no more than this weight counts as on its edge."""


@dataclass(frozen=True)
class Triangles:
    """Triangles (t, 3) over points (k, 2). A triangle without an area stands for its edges, so lines and points work.

    `corners` accepts any finite place: outside all triangles, the nearest place on their rim counts. Shares come from a
    matrix that is computed once, for steps in real time; those of `modeling.textures.ar.Mesh`, which also makes the
    triangles, are solved for each place and differ in the last digits (1e-15), so trained models keep their own.
    """

    points: Values
    triangles: Values
    _shares: Values = field(init=False, repr=False)
    _full: Values = field(init=False, repr=False)
    _rim: Values = field(init=False, repr=False)

    def __post_init__(self) -> None:
        corners = self.points[self.triangles]
        one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
        full = np.abs(area) > FLAT * max(np.ptp(self.points, axis=0).max() ** 2, np.finfo(float).tiny)
        object.__setattr__(self, "_full", self.triangles[full])
        # The matrix (3 t, 3) turns (x, y, 1) into the shares of all first corners, all second and all third ones.
        first, one, two, area = corners[full][:, 0], one[full], two[full], area[full]
        second_slope = np.stack([two[:, 1], -two[:, 0]], axis=1) / area[:, None]
        third_slope = np.stack([-one[:, 1], one[:, 0]], axis=1) / area[:, None]
        others = [np.column_stack([slope, -(slope * first).sum(axis=1)]) for slope in (second_slope, third_slope)]
        shares = [np.array([0.0, 0.0, 1.0]) - others[0] - others[1], *others]
        object.__setattr__(self, "_shares", np.ascontiguousarray(np.concatenate(shares)))
        object.__setattr__(self, "_rim", _rim(self.triangles, full))

    def corners(self, places: Values) -> tuple[Values, Values]:
        """Return, for places (n, 2), indices of points (n, 3) and their weights (n, 3), never negative, with sum 1."""
        rows, shares, inside = self._within(places)
        if not inside.all():
            out = ~inside
            rows[out], shares[out] = self._nearest(places[out])
        return rows, shares

    def _within(self, places: Values) -> tuple[Values, Values, Values]:
        """Return points and weights of the triangle that each place lies deepest in, and whether it lies inside."""
        n = len(places)
        if not len(self._full):
            return np.zeros((n, 3), dtype=np.int64), np.zeros((n, 3)), np.zeros(n, dtype=bool)
        given = np.empty((3, n))
        given[:2], given[2] = places.T, 1
        shares = (self._shares @ given).reshape(3, -1, n)
        depth = np.minimum(np.minimum(shares[0], shares[1]), shares[2])
        best = depth.argmax(axis=0)
        rows = np.arange(n)
        of_best = np.maximum(shares[:, best, rows].T, 0)
        return self._full[best], of_best / of_best.sum(axis=1, keepdims=True), depth[best, rows] >= EDGE

    def _nearest(self, places: Values) -> tuple[Values, Values]:
        """Return the two points, and their weights, of the nearest place on the rim."""
        start = self.points[self._rim[:, 0]]
        along = self.points[self._rim[:, 1]] - start
        squares = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
        away = places[:, None] - start
        share = np.clip((away * along).sum(axis=2) / squares, 0, 1)
        distances = ((away - share[..., None] * along) ** 2).sum(axis=2)
        edge, place = distances.argmin(axis=1), np.arange(len(places))
        of_edge = np.where(
            np.isfinite(distances[place, edge]), share[place, edge], np.nan
        )  # too far to tell the nearest
        rows = self._rim[edge]
        return rows[:, [0, 1, 1]], np.stack([1 - of_edge, of_edge, np.zeros_like(of_edge)], axis=1)


def _rim(triangles: Values, full: Values) -> Values:
    """Return the edges (s, 2) that belong to one triangle only, and all edges of triangles without an area."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    kinds, counts = np.unique(edges[full].reshape(-1, 2), axis=0, return_counts=True)
    return np.unique(np.concatenate([kinds[counts == 1], edges[~full].reshape(-1, 2)]), axis=0)
