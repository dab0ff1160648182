"""Figures of sight: co-occurrence of gray levels, beside scikit-image's and beside counting of pairs."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from palpate.analysis.features.glcm import ANGLES, DISTANCES, LEVELS, glcm, levels
from palpate.analysis.features.pictures import SIDE, Gray
from palpate.protocols.bench import Case

AREA = "features of pictures"
QUICK_SIDE = 224
ERROR = "largest difference from counted pairs"
NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1))
"""Offsets (rows down, columns right) of the neighbour in each of the four directions."""
Shares = NDArray[np.float64]


def cases(quick: bool) -> Iterator[Case]:
    """Yield the times of a picture at full size (1568 x 1568), or of a patch of it if `quick`."""
    side, repeats = (QUICK_SIDE, 3) if quick else (SIDE, 5)
    values = crossing_threads(side)
    expected = count_pairs(values)
    ways: dict[str, Callable[[], NDArray[np.floating]]] = {
        "palpate": lambda: glcm(values),
        "scikit-image": lambda: by_scikit_image(values),
        "pairs counted by NumPy": lambda: count_pairs(values),
    }
    for name, run in ways.items():
        yield Case(
            AREA, "co-occurrence", name, f"{side} x {side} pixels", side**2, ERROR, run,
            lambda result: float(np.abs(result - expected).max()), repeats,
        )  # fmt: skip


def crossing_threads(side: int, seed: int = 0) -> Gray:
    """Return brightness (side, side) from 0 to 1 of crossing threads with noise."""
    chance = np.random.Generator(np.random.PCG64(seed))
    down, along = np.mgrid[:side, :side]
    threads = np.sin(down / 7) * np.sin(along / 9)
    brightness = 0.5 + 0.3 * threads + 0.1 * chance.standard_normal((side, side))
    return np.asarray(np.clip(brightness, 0, 1), dtype=np.float32)


def by_scikit_image(values: Gray) -> Shares:
    """Return the shares (256,) of the same gray levels by scikit-image."""
    from skimage.feature import graycomatrix

    shares = graycomatrix(levels(values), DISTANCES, ANGLES, levels=LEVELS, symmetric=True, normed=True)
    return np.asarray(shares.mean(axis=(2, 3)).ravel())


def count_pairs(values: Gray) -> Shares:
    """Return the shares (256,) by the definition: all pairs of neighbours, in both orders.

    Source: Haralick, Shanmugam and Dinstein 1973.
    """
    level = levels(values).astype(np.int64)
    shares = np.zeros(LEVELS * LEVELS)
    for down, on in NEIGHBOURS:
        one, other = level[: len(level) - down], level[down:]
        one, other = (one[:, -on:], other[:, :on]) if on < 0 else (one[:, : one.shape[1] - on], other[:, on:])
        pairs = np.concatenate([(one * LEVELS + other).ravel(), (other * LEVELS + one).ravel()])
        shares += np.bincount(pairs, minlength=LEVELS * LEVELS) / len(pairs) / len(NEIGHBOURS)
    return shares
