"""Piecewise autoregression over speed and force (Culbertson et al. 2014), segmented and placed automatically."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, ward
from scipy.signal.windows import hann
from scipy.spatial import Delaunay, QhullError

from palpate.modeling.files.model_files import Exported
from palpate.modeling.textures.methods import Learning, Method
from palpate.modeling.textures.recording import CHANNELS, TextureDataError
from palpate.protocols.wording import count
from palpate.signals.arrays import Array
from palpate.signals.linear_prediction import burg, damped_within, expanded, filters_of, frequencies_of, power_gain
from palpate.signals.models.card import Affine, Reshape
from palpate.signals.models.card_steps import Autoregression

WINDOW = 30
RADIUS = 0.998
"""The radius of all poles of the exported filters, at every speed and force: see `FittedAr.exported`."""
OWN_RADIUS = 0.997
"""The radius of the poles of each point's predictor."""
GAP = 0.004
"""The least distance of line spectral frequencies in radians, so that they rise in half precision too."""
POINTS = 24
SAMPLES = 400
"""The least number of samples of a point, where there are several."""
PER_COEFFICIENT = 20
"""The least number of samples for each coefficient."""
MOST = 200
"""The most samples of a piece: longer stretches are cut, since speed and force change along them."""
SILENT = 1e-8
"""Share of the training part's power that is added to every error, so that no log SD is infinite."""
AT_ONCE = 4096
STEP = 25
"""Samples between the places where a border may lie."""
SHORTEST, LONGEST = 4, 80
"""Least and greatest number of steps of a stretch: 0.1 s to 2 s."""
HIGHEST = 20
"""The highest order that the cost of a stretch is computed for."""
LEAST = 1e-20
"""Power, relative to the whole recording's, below which a stretch is silent."""
PRIOR = 4.0
"""The weight, in samples, of the level that a point's own stretches have."""
NEWTON_STEPS, SMALLEST_STEP = 50, 1e-9
LARGEST_STEP = 1.0
"""The most that a Newton step changes a log SD."""
PER = (100.0, 1.0)
"""The units of distance: this many mm/s count as much as this many N."""
NARROW = 1e-6
"""Points that differ less than this share of the wider side, or of `PER`, lie on a line."""
EDGE = -1e-9
"""Barycentric shares down to this count as inside a triangle."""
RowIndices = NDArray[np.int64]


@dataclass(frozen=True)
class Stretch:
    """A stretch of samples [start, stop) whose spectrum hardly changes."""

    start: int
    stop: int


@dataclass(frozen=True)
class FittedAr:
    """Predictors at points over speed and force.

    `frequencies` (k, order): of the filters whose poles are those of the predictors divided by `RADIUS`; `log_sd` (k,)
    of the innovations in m/s^2; `stretches`: the segments of the recording.
    """

    window: int
    mesh: Mesh
    frequencies: Array
    log_sd: Array
    stretches: tuple[Stretch, ...]

    def predict(self, given: Array) -> Array:
        """Return the mean of the next acceleration (n,) in m/s^2 for windows (n, 3, window) in units.

        Raises TextureDataError for another shape and for numbers that are not finite.
        """
        given = np.asarray(given, dtype=np.float64)
        if given.ndim != 3 or given.shape[1:] != (CHANNELS, self.window):
            raise TextureDataError(f"windows of shape {given.shape}; (n, 3, {self.window}) are expected")
        if not np.isfinite(given).all():
            raise TextureDataError("a window holds a number that is not finite; correct or leave out its stretch")
        parts: list[Array] = [np.empty(0)]
        for at in range(0, len(given), AT_ONCE):
            past, speed, force = given[at : at + AT_ONCE].swapaxes(0, 1)
            filters = self.filters(speed[:, -1], force[:, -1])
            parts.append(-(filters[:, 1:] * past[:, : -filters.shape[1] : -1]).sum(axis=1))
        return np.concatenate(parts)

    def filters(self, speed_mm_s: Array, force_N: Array) -> Array:
        """Return the error filters (n, order + 1) at speeds and forces (n,)."""
        hand = np.stack([speed_mm_s, force_N], axis=1)
        return expanded(filters_of(self.mesh.shares(hand) @ self.frequencies), 1 / RADIUS)

    def exported(self) -> Exported:
        """Return the steps: the window with acceleration k samples ago times RADIUS**k, then predictors without that.

        Rising line spectral frequencies give a filter whose poles lie within 1, and a mixture of rising ones rises; so
        the poles of the exported filters lie within RADIUS at every speed and force.
        """
        damping = np.ones((CHANNELS, self.window))
        damping[0] = RADIUS ** np.arange(self.window, 0, -1)
        tensors = {
            "damping": damping, "points": self.mesh.points, "frequencies": self.frequencies, "log_sd": self.log_sd,
            "triangles": self.mesh.triangles,
        }  # fmt: skip
        step = Autoregression(
            points="points", frequencies="frequencies", log_sd="log_sd", triangles="triangles", per=PER
        )
        return Exported((Reshape(shape=(CHANNELS, self.window)), Affine(gain="damping"), step), tensors)


def fit(learning: Learning) -> FittedAr:
    """Fit predictors to groups of stretches of the training part with similar speed and force.

    The training part is divided where its spectrum or level changes. Each group gets Burg's predictor, at the group's
    mean speed and force. The order is `Learning.window`, else 30, or less where the training part has fewer than 20
    samples a coefficient. Raises TextureDataError where the acceleration is silent or constant, or too short.
    """
    window = learning.window or WINDOW
    samples = learning.recording.acceleration_m_s2
    order = _order(learning, window)
    stretches = segmented(samples, learning.parts.train)
    pieces: list[tuple[int, int]] = []
    for stretch in stretches:  # in equal pieces of at most `MOST` samples
        number = -(-(stretch.stop - stretch.start) // MOST)
        pieces += pairwise(np.linspace(stretch.start, stretch.stop, number + 1).round().astype(int).tolist())
    groups = _groups(learning, pieces)
    learning.report(f"{len(stretches)} stretches, {len(groups)} points, order {order}")
    hand = learning.recording.signals[1:].T
    floor = SILENT * float(np.mean([np.mean(samples[a:b] ** 2) for a, b in pieces]))
    predictors = [_predictor([samples[a:b] for a, b in group], order) for group in groups]
    places = [np.concatenate([hand[a:b] for a, b in group]).mean(axis=0) / PER for group in groups]
    mesh = mesh_of(np.array(places))
    frequencies = np.array([frequencies_of(weights) for weights, _ in predictors])
    log_sd = np.array([0.5 * np.log(error + floor) for _, error in predictors])
    plain = FittedAr(window, mesh, frequencies, log_sd, stretches)
    at = np.concatenate([np.arange(a, b) for a, b in learning.parts.train])
    acceleration, speed, force = learning.recording.signals[:, at]
    shares = plain.mesh.shares(np.stack([speed, force], axis=1))
    levels = match_levels(plain.log_sd, shares, acceleration**2 + floor, power_gain(plain.filters(speed, force)))
    return replace(plain, log_sd=levels)


def _order(learning: Learning, window: int) -> int:
    """Return the order of the predictors. Raises TextureDataError for too few samples, or constant ones."""
    name = learning.recording.texture
    parts = learning.parts.train
    total = sum(b - a for a, b in parts)
    order = min(window, total // PER_COEFFICIENT, max((b - a for a, b in parts), default=0) // 2)
    if order < 1:
        raise TextureDataError(
            f"{name}: {count(total, 'sample')} to learn from; {PER_COEFFICIENT} at least are expected"
        )
    samples = np.concatenate([learning.recording.acceleration_m_s2[a:b] for a, b in parts])
    if np.ptp(samples) <= 1e-9 * max(float(np.abs(samples).max()), 1e-300):
        raise TextureDataError(
            f"{name}: the acceleration to learn from is {samples[0]:g} m/s^2 throughout; was the sensor connected?"
        )
    return order


def _groups(learning: Learning, pieces: Sequence[tuple[int, int]]) -> list[list[tuple[int, int]]]:
    """Group pieces of similar speed and force (Ward 1963), with about `SAMPLES` samples or more in each."""
    hand = learning.recording.signals[1:].T / PER
    places = np.array([hand[a:b].mean(axis=0) for a, b in pieces])
    total = sum(b - a for a, b in pieces)
    points = min(POINTS, total // SAMPLES, len(pieces))
    if points < 2 or np.ptp(places, axis=0).max() < 1e-6:
        return [list(pieces)]
    labels = fcluster(ward(places), points, "maxclust")
    return [[pieces[row] for row in np.flatnonzero(labels == label)] for label in np.unique(labels)]


def _predictor(stretches: Sequence[Array], order: int) -> tuple[Array, float]:
    """Return Burg's filter with its poles divided by RADIUS, and its error."""
    weights, error = burg(stretches, order)
    inner = damped_within(weights, OWN_RADIUS)
    while np.diff(frequencies_of(expanded(inner, RADIUS)), prepend=0.0, append=np.pi).min() < GAP:
        inner = damped_within(inner, OWN_RADIUS * float(np.abs(np.roots(inner)).max()))
    return expanded(inner, RADIUS), error


def match_levels(log_sd: Array, shares: Array, squares: Array, gains: Array) -> Array:
    """Return the log SD of the innovations at each point (k,), starting from the stretches' own.

    Sample n has the square `squares` (n,), the shares (n, k) of the points, and a predictor that amplifies white noise
    by `gains` (n,), so its variance is gains exp(2 shares log_sd). The negative log likelihood of that, with a prior
    around the given log SDs, is convex in log_sd, so Newton's method finds its one minimum.
    """
    powers = squares / gains
    result = log_sd.copy()
    for _ in range(NEWTON_STEPS):
        excess = powers * np.exp(-2 * np.clip(shares @ result, -300, 300))
        slope = shares.T @ (1 - excess) + PRIOR * (result - log_sd)
        bend = (shares * (2 * excess)[:, None]).T @ shares + PRIOR * np.eye(len(result))
        step = np.linalg.solve(bend, -slope)
        step *= min(1.0, LARGEST_STEP / max(float(np.abs(step).max()), SMALLEST_STEP))
        result += step
        if np.abs(step).max() < SMALLEST_STEP:
            break
    return result


def segmented(acceleration: Array, parts: Sequence[tuple[int, int]]) -> tuple[Stretch, ...]:
    """Return the stretches of least description length within each part [start, stop); all of it where it is short.

    The cost of a cut is that of AutoPARM (Davis et al. 2006): the code length of the borders, of each stretch's order
    and coefficients, and of the samples that they leave unexplained. AutoPARM searches with a genetic algorithm; here
    borders lie on a grid, so the best segmentation is found by dynamic programming.
    """
    floor = LEAST * float(np.mean([np.mean(acceleration[a:b] ** 2) for a, b in parts])) + np.finfo(float).tiny
    result: list[Stretch] = []
    total = sum(b - a for a, b in parts)
    for start, stop in parts:
        borders = _borders(acceleration[start:stop], floor, total)
        edges = [start, *(start + STEP * border for border in borders), stop]
        result += [Stretch(a, b) for a, b in pairwise(edges)]
    return tuple(result)


def _borders(samples: Array, floor: float, total: int) -> list[int]:
    """Return the inner borders of one part, in steps."""
    lags = _lags(samples)
    count = len(lags)
    if count < 2 * SHORTEST:
        return []
    costs = _costs(lags, floor, total)
    best, last = np.full(count + 1, np.inf), np.zeros(count + 1, dtype=int)
    best[0] = 0
    for stop in range(SHORTEST, count + 1):
        starts = np.arange(max(0, stop - LONGEST), stop - SHORTEST + 1)
        all_costs = best[starts] + costs[stop - starts, starts]
        last[stop] = starts[all_costs.argmin()]
        best[stop] = all_costs.min()
    borders: list[int] = []
    place = int(last[count])
    while place:
        borders.insert(0, place)
        place = int(last[place])
    return borders


def _lags(samples: Array) -> Array:
    """Return the tapered autocorrelation about each step, (steps, HIGHEST + 1); their sums are autocorrelations too."""
    width = 2 * STEP
    padded = np.pad(samples, (STEP // 2, STEP // 2 + width))
    count = len(samples) // STEP
    frames = sliding_window_view(padded, width)[: count * STEP : STEP] * hann(width, sym=False)
    return np.stack([(frames[:, lag:] * frames[:, : width - lag]).sum(axis=1) for lag in range(HIGHEST + 1)], axis=1)


def _costs(lags: Array, floor: float, total: int) -> Array:
    """Return description lengths in nats by a stretch's number of steps and first step, (LONGEST + 1, steps)."""
    count = len(lags)
    sums = np.concatenate([np.zeros((1, lags.shape[1])), np.cumsum(lags, axis=0)])
    costs = np.full((LONGEST + 1, count), np.inf)
    taper = float((hann(2 * STEP, sym=False) ** 2).sum())
    for steps in range(SHORTEST, min(LONGEST, count) + 1):
        errors = _prediction_errors((sums[steps:] - sums[:-steps]) / (steps * taper), floor)
        size = steps * STEP
        orders = np.arange(1, HIGHEST + 1)
        code_length = np.log(total) + np.log(orders) + (orders + 2) / 2 * np.log(size)
        costs[steps, : count - steps + 1] = (size / 2 * np.log(2 * np.pi * errors) + code_length).min(axis=1)
    return costs


def _prediction_errors(lags: Array, floor: float) -> Array:
    """Return the error of the best predictor of each order, (n, HIGHEST), by the Levinson-Durbin recursion."""
    error = lags[:, 0] + floor
    result = np.empty((len(lags), HIGHEST))
    filters = np.zeros((len(lags), HIGHEST + 1))
    filters[:, 0] = 1
    for order in range(1, HIGHEST + 1):
        across = (filters[:, :order] * lags[:, order:0:-1]).sum(axis=1)
        reflection = -across / error
        filters[:, : order + 1] += reflection[:, None] * filters[:, order::-1]
        error = np.maximum(error * (1 - reflection**2), floor)
        result[:, order - 1] = error
    return result


AR = Method(
    name="ar", title="Piecewise autoregression", fit=fit, window=WINDOW, sampled=True,
    source="Culbertson, Unwin and Kuchenbecker 2014; segmentation after Davis, Lee and Rodriguez-Yam 2006",
)  # fmt: skip


@dataclass(frozen=True)
class Mesh:
    """Points (k, 2), speed and force divided by `PER`; triangles (t, 3) of them; the outer edges (s, 2).

    Points on a line, two or one have triangles without area: [i, j, j], [i, i, i]. The player uses
    `signals.models.triangles.Triangles`, whose shares differ in the last digits.
    """

    points: Array
    triangles: RowIndices
    rim: RowIndices

    def shares(self, hand: Array) -> Array:
        """Return the share (n, k) of each point, 1 in sum, for speeds in mm/s and forces in N (n, 2).

        Outside the triangles it is that of the nearest point on the border.
        """
        places = np.asarray(hand, dtype=np.float64) / PER
        result = np.zeros((len(places), len(self.points)))
        inside = self._within(places, result)
        if not inside.all():
            self._nearest(places, np.flatnonzero(~inside), result)
        return result

    def _within(self, places: Array, shares: Array) -> NDArray[np.bool_]:
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
        shares[np.flatnonzero(inside)[:, None], places_of] = share / share.sum(axis=1, keepdims=True)
        return np.asarray(inside)

    def _nearest(self, places: Array, rows: RowIndices, shares: Array) -> None:
        start = self.points[self.rim[:, 0]]
        along = self.points[self.rim[:, 1]] - start
        away = places[rows][:, None] - start
        share = (away * along).sum(axis=2) / np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
        share = np.clip(share, 0, 1)
        edge = ((away - share[..., None] * along) ** 2).sum(axis=2).argmin(axis=1)
        of_edge = share[np.arange(len(rows)), edge]
        np.add.at(shares, (rows, self.rim[edge, 0]), 1 - of_edge)
        np.add.at(shares, (rows, self.rim[edge, 1]), of_edge)


def mesh_of(points: Array) -> Mesh:
    """Return points (k, 2) with their Delaunay triangles; for points on a line, with its segments."""
    spread = np.ptp(points, axis=0)
    if (spread < NARROW * max(1.0, float(spread.max()))).any():
        return _line(points)
    try:
        mesh = Delaunay(points)
    except (QhullError, ValueError):
        return _line(points)
    return Mesh(points, mesh.simplices.astype(np.int64), mesh.convex_hull.astype(np.int64))


def _line(points: Array) -> Mesh:
    """Return the mesh of points on a line: edges between neighbours along the longer side."""
    order = np.argsort(points[:, np.ptp(points, axis=0).argmax()], kind="stable")
    first, second = (order[:-1], order[1:]) if len(order) > 1 else (order, order)
    edges = np.stack([first, second], axis=1).astype(np.int64)
    return Mesh(points, np.column_stack([edges, edges[:, 1]]), edges)
