"""Confidence regions of points in a map, from maps of resampled participants that are fitted to their mean."""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd
from scipy.spatial.distance import squareform

from palpate.analysis.spaces.classical import torgerson
from palpate.analysis.spaces.dissimilarities import Dissimilarities
from palpate.analysis.spaces.matrices import matrix_of
from palpate.analysis.spaces.procrustes import align
from palpate.analysis.spaces.resampling import resample
from palpate.analysis.spaces.stress import Ties, minimise_stress, order_of, refine_map
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.draws import check_draws, check_share, stream
from palpate.analysis.statistics.refusals import BadOption, TooFew, refuse_idle

Method: TypeAlias = Literal["classical", "nonmetric"]
ROUNDS = 10
MAJORISED, POLISHED, SETTLING = 10, 30, 100  # from the map itself, which is near


def confidence_ellipses(
    between: Dissimilarities,
    points: pd.DataFrame,
    method: Method = "classical",
    ties: Ties = "primary",
    draws: int = 200,
    confidence: float = 0.95,
    seed: int = 0,
) -> pd.DataFrame:
    """Return an ellipse around each point of a map's first two dimensions, from resampled participants.

    Each draw's map is rotated, reflected and scaled onto the mean of all of them (generalized Procrustes), and the mean
    onto `points`. Columns: `label`, the point's own `x`, `y` (the ellipse's centre), `var_x`, `var_y`, `cov_xy` over
    the draws, `major` and `minor` half-axes, `angle_deg` of the major axis from x (counter-clockwise, -90 to 90),
    `shift` (how far the mean of the draws lies from the point), `confidence`, `draws`. Normal theory with the draws'
    covariance: chi squared with two degrees of freedom. Raises TooFew for one participant or one dimension. Sources:
    Gower 1975; Weinberg, Carroll & Cohen 1984.
    """
    check_draws(draws)
    check_share(confidence, "confidence")
    if method == "classical":
        refuse_idle("ties", ties, "primary", "with method='classical', which looks at no order")
    matrix = matrix_of(points)
    if matrix.values.shape[1] < 2:
        raise TooFew("a map of one dimension has no ellipses; ask for two dimensions or none")
    maps = replications(between, matrix.values, method, ties, draws, seed)
    return pd.DataFrame(
        [_ellipse(name, matrix.values[i], maps[:, i], confidence) for i, name in enumerate(matrix.rows)]
    )


def replications(between: Dissimilarities, points: Floats, method: Method, ties: Ties, draws: int, seed: int) -> Floats:
    """Return the maps of resampled participants, (draws, objects, dimensions), on `points`."""
    if between.ratings is None or between.remade is None:
        raise BadOption("nothing is known of participants in these dissimilarities; name the column of participants")
    counts = resample(between.ratings, draws, stream(seed, "replications"))
    tables = [between.remade(means) for means in between.ratings.means(counts)]
    mapped = []
    for table in tables:
        if method == "nonmetric":
            order = order_of(squareform(table, checks=False), ties)
            mapped.append(refine_map(minimise_stress(points, order, MAJORISED, POLISHED)[0], order, SETTLING))
            continue
        points_of_map, _, exponent = torgerson(table)
        width = points.shape[1]
        flat = points_of_map[:, :width] * float(np.ldexp(1.0, exponent))
        mapped.append(np.pad(flat, ((0, 0), (0, width - flat.shape[1]))))
    maps = np.array(mapped)
    return on_their_mean(maps, points)


def on_their_mean(maps: Floats, points: Floats) -> Floats:
    """Return each map fitted to the mean of all (iteratively), and that mean to `points` by one similarity
    transformation.
    """
    mean = points
    for _ in range(ROUNDS):
        mean = align(points, align(mean, maps).points.mean(axis=0)).points
    return align(mean, maps).points


def _ellipse(label: Hashable, place: Floats, drawn: Floats, confidence: float) -> dict[str, object]:
    plane = drawn[:, :2]
    mean = plane.mean(axis=0)
    covariance = np.cov(plane, rowvar=False)
    sizes, directions = np.linalg.eigh(covariance)
    radius = math.sqrt(-2 * math.log1p(-confidence))
    minor, major = (radius * math.sqrt(max(float(size), 0.0)) for size in sizes)
    x, y = directions[:, 1].tolist()
    angle = math.degrees(math.atan2(y, x))
    angle -= 180 * round(angle / 180)
    return {
        "label": label,
        "x": float(place[0]),
        "y": float(place[1]),
        "var_x": float(covariance[0, 0]),
        "var_y": float(covariance[1, 1]),
        "cov_xy": float(covariance[0, 1]),
        "major": major,
        "minor": minor,
        "angle_deg": angle,
        "shift": float(np.hypot(*(mean - place[:2]))),
        "confidence": confidence,
        "draws": len(drawn),
    }
