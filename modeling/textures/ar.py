"""Piecewise autoregression over speed and force (Culbertson et al. 2014), cut, placed and levelled without a hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.cluster.hierarchy import fcluster, ward

from palpate.modeling.files.exported import Exported
from palpate.modeling.textures.ar_levels import levelled
from palpate.modeling.textures.ar_places import PER, Mesh, meshed
from palpate.modeling.textures.ar_segments import Stretch, segmented
from palpate.modeling.textures.methods import Learning, Method
from palpate.modeling.textures.recording import CHANNELS, TextureDataError
from palpate.protocols.wording import count
from palpate.signals.arrays import Array
from palpate.signals.linear_prediction import burg, damped_within, expanded, filters_of, frequencies_of, power_gain
from palpate.signals.models.card import Affine, Reshape
from palpate.signals.models.card_steps import Autoregression

WINDOW = 30
RADIUS = 0.998
"""All poles of what runs lie within, at every speed and force: see `FittedAr.exported`."""
OWN_RADIUS = 0.997
"""The poles of each point's predictor lie within."""
GAP = 0.004
"""Radians between line spectral frequencies at least: they rise also where they are kept in half precision."""
POINTS = 24
SAMPLES = 400
"""A point has so many samples at least, where there are more than one."""
PER_COEFFICIENT = 20
"""Samples that a coefficient is told from, at least."""
MOST = 200
"""Samples of a stretch at most: longer ones are cut, since the hand moves on."""
SILENT = 1e-8
"""Share of the training part's power that counts as none: a log SD without end would reach its neighbours."""
AT_ONCE = 4096


@dataclass(frozen=True)
class FittedAr:
    """Predictors at points over speed and force.

    `frequencies` (k, order): of the filters whose poles are those of the predictors divided by `RADIUS`; `log_sd` (k,)
    of the innovations in m/s^2; `stretches`: what the recording was cut into.
    """

    window: int
    mesh: Mesh
    frequencies: Array
    log_sd: Array
    stretches: tuple[Stretch, ...]

    def predict(self, given: Array) -> Array:
        """The mean of the next acceleration (n,) in m/s^2 for windows (n, 3, window) in units.

        Raises TextureDataError for another shape and for numbers that are not finite.
        """
        given = np.asarray(given, dtype=np.float64)
        if given.ndim != 3 or given.shape[1:] != (CHANNELS, self.window):
            raise TextureDataError(f"windows of shape {given.shape}; (n, 3, {self.window}) are expected")
        if not np.isfinite(given).all():
            raise TextureDataError("a window holds a number that is not finite; mend or leave out its stretch")
        parts = [self._answers(given[at : at + AT_ONCE]) for at in range(0, len(given), AT_ONCE)]
        return np.concatenate(parts) if parts else np.empty(0)

    def filters(self, speed_mm_s: Array, force_N: Array) -> Array:
        """The error filters (n, order + 1) at speeds and forces (n,)."""
        hand = np.stack([speed_mm_s, force_N], axis=1)
        return expanded(filters_of(self.mesh.shares(hand) @ self.frequencies), 1 / RADIUS)

    def _answers(self, given: Array) -> Array:
        found = self.filters(given[:, 1, -1], given[:, 2, -1])
        order = found.shape[1] - 1
        return np.asarray(-(found[:, 1:] * given[:, 0, : -order - 1 : -1]).sum(axis=1))

    def exported(self) -> Exported:
        """The window, its past acceleration k samples back times RADIUS**k, and the predictors without that.

        Line spectral frequencies that rise make a filter whose poles lie within 1, and a mixture of rising ones rises;
        so whatever speed and force are, the poles of what runs lie within RADIUS.
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
    """Cut the training part where its spectrum or level changes, gather what is alike in speed and force, fit each.

    Every group's predictor is Burg's; its place is the group's mean speed and force. `Learning.window`, else 30, is the
    order, or less where the training part has fewer than 20 samples a coefficient. Raises TextureDataError where the
    acceleration is silent or constant, or where there is too little of it.
    """
    window = learning.window or WINDOW
    samples = learning.recording.acceleration_m_s2
    order = _order(learning, window)
    stretches = segmented(samples, learning.parts.train)
    pieces = tuple(piece for stretch in stretches for piece in _pieces(stretch))
    groups = _groups(learning, pieces)
    learning.report(f"{len(stretches)} stretches, {len(groups)} points, order {order}")
    hand = learning.recording.signals[1:].T
    floor = SILENT * float(np.mean([np.mean(samples[a:b] ** 2) for a, b in pieces]))
    found = [_predictor([samples[a:b] for a, b in group], order) for group in groups]
    places = [np.concatenate([hand[a:b] for a, b in group]).mean(axis=0) / PER for group in groups]
    mesh = meshed(np.array(places))
    frequencies = np.array([frequencies_of(each) for each, _ in found])
    log_sd = np.array([0.5 * np.log(error + floor) for _, error in found])
    plain = FittedAr(window, mesh, frequencies, log_sd, stretches)
    return replace(plain, log_sd=_levels(plain, learning, floor))


def _order(learning: Learning, window: int) -> int:
    """How far the predictors look back. Raises TextureDataError."""
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


def _pieces(stretch: Stretch) -> list[tuple[int, int]]:
    """A stretch in equal pieces of at most `MOST` samples."""
    count = -(-(stretch.stop - stretch.start) // MOST)
    edges = np.linspace(stretch.start, stretch.stop, count + 1).round().astype(int).tolist()
    return list(pairwise(edges))


def _groups(learning: Learning, pieces: Sequence[tuple[int, int]]) -> list[list[tuple[int, int]]]:
    """Pieces that are alike in speed and force together (Ward 1963), each group with samples enough."""
    hand = learning.recording.signals[1:].T / PER
    places = np.array([hand[a:b].mean(axis=0) for a, b in pieces])
    total = sum(b - a for a, b in pieces)
    wanted = min(POINTS, total // SAMPLES, len(pieces))
    if wanted < 2 or np.ptp(places, axis=0).max() < 1e-6:
        return [list(pieces)]
    labels = fcluster(ward(places), wanted, "maxclust")
    return [[pieces[row] for row in np.flatnonzero(labels == label)] for label in np.unique(labels)]


def _predictor(stretches: Sequence[Array], order: int) -> tuple[Array, float]:
    """The filter whose poles are those of Burg's divided by RADIUS, and the error of Burg's."""
    found, error = burg(stretches, order)
    inner = damped_within(found, OWN_RADIUS)
    while _gap(expanded(inner, RADIUS)) < GAP:
        inner = damped_within(inner, OWN_RADIUS * float(np.abs(np.roots(inner)).max()))
    return expanded(inner, RADIUS), error


def _gap(found: Array) -> float:
    frequencies = frequencies_of(found)
    return float(np.diff(np.concatenate([[0.0], frequencies, [np.pi]])).min())


def _levels(plain: FittedAr, learning: Learning, floor: float) -> Array:
    at = np.concatenate([np.arange(a, b) for a, b in learning.parts.train])
    acceleration, speed, force = learning.recording.signals[:, at]
    shares = plain.mesh.shares(np.stack([speed, force], axis=1))
    return levelled(plain.log_sd, shares, acceleration**2 + floor, power_gain(plain.filters(speed, force)))


AR = Method(
    name="ar", title="Piecewise autoregression", fit=fit, window=WINDOW, sampled=True,
    source="Culbertson, Unwin and Kuchenbecker 2014; segmentation after Davis, Lee and Rodriguez-Yam 2006",
)  # fmt: skip
