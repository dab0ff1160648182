"""An order in which neighbours are alike: the leaves of a clustering, turned so that they fit best."""

from __future__ import annotations

import numpy as np
from scipy.cluster.hierarchy import leaves_list, linkage
from scipy.spatial.distance import squareform

from palpate.analysis.statistics.doubles import Floats


def similar_order(values: Floats) -> list[int]:
    """The rows of a table so ordered that alike ones stand together; NaN is no value.

    The distance of two rows is the root mean square of their differences where both have a value; rows that share
    nothing are as far apart as the most distant pair. Average linkage with optimal leaf order (Bar-Joseph, Gifford &
    Jaakkola 2001). The end with the lower mean comes first, so that no run turns the order round.
    """
    n = len(values)
    if n < 3:
        return list(range(n))
    distances = np.zeros((n, n))
    for i in range(n):
        gaps = values[i + 1 :] - values[i]
        shared = np.count_nonzero(~np.isnan(gaps), axis=1)
        squares = np.nansum(gaps * gaps, axis=1)
        distances[i, i + 1 :] = np.where(shared > 0, np.sqrt(squares / np.maximum(shared, 1)), np.nan)
    far = np.nanmax(distances) if np.isfinite(distances).any() else 1.0
    distances = np.where(np.isnan(distances), far, distances)
    distances = distances + distances.T
    order: list[int] = leaves_list(
        linkage(squareform(distances, checks=False), "average", optimal_ordering=True)
    ).tolist()
    ends = [_mean(values[order[0]]), _mean(values[order[-1]])]
    return order[::-1] if ends[1] < ends[0] else order


def _mean(row: Floats) -> float:
    known = row[~np.isnan(row)]
    return float(known.mean()) if known.size else 0.0
