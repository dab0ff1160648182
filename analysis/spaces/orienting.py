"""One orientation out of the many that fit equally well: principal axes, and a rule for their signs."""

from __future__ import annotations

import numpy as np

from palpate.analysis.statistics.doubles import Floats

NEAR = 1e-9
"""Sizes closer than this (relative) count as equal where a sign is chosen, so that rounding never chooses it."""


def signs(columns: Floats) -> Floats:
    """+1 or -1 for each column: its value of largest size becomes positive, of equal ones the first in label order."""
    size = np.abs(columns)
    first = np.argmax(size >= size.max(axis=0) * (1 - NEAR), axis=0)
    chosen = columns[first, np.arange(columns.shape[1])]
    return np.where(chosen < 0, -1.0, 1.0)


def principal(points: Floats) -> Floats:
    """The same configuration about its centroid, turned to its principal axes, with the rule's signs."""
    about = points - points.mean(axis=0)
    _, _, directions = np.linalg.svd(about, full_matrices=False)
    turned = about @ directions.T
    result: Floats = turned * signs(turned)
    return result


def unit_size(points: Floats) -> Floats:
    """The configuration with a root mean square distance of 1 from its centroid."""
    size = np.sqrt((points * points).sum() / len(points))
    result: Floats = points / size
    return result
