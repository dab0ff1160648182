"""How long the features of one texture take on this machine, by kind: taken on noise, since kept ones cost nothing."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator

import numpy as np

Clock = Callable[[], float]
SEGMENTS, PICTURES = 110, 10
"""Of a texture: 60 s less 5 s of ends, in segments of half a second; pictures of 1568 x 1568."""


def feature_seconds(kinds: Collection[str], clock: Clock = time.perf_counter) -> dict[str, float]:
    """Seconds that each of these kinds takes for one texture, on one core; each is made twice and the second counts.

    ResNet-50 is asked about one batch of patches, and the others of the ten pictures are taken to be like it.
    """
    from modeling.training.threads import limited

    found: dict[str, float] = {}
    with limited(1):
        for name, make, times in _makers(kinds):
            if name in kinds:
                make()
                start = clock()
                make()
                found[name] = (clock() - start) * times
    return found


def _makers(kinds: Collection[str]) -> Iterator[tuple[str, Callable[[], object], float]]:
    """A kind, what makes it, and how often that is needed for one texture."""
    from analysis.features.glcm import glcm
    from analysis.features.hand import hand
    from analysis.features.mfcc import mfcc
    from analysis.features.pictures import Looking, patches
    from analysis.features.segments import SEGMENT
    from analysis.features.spectra import spectrum
    from analysis.features.wavelets import wavelets

    chance = np.random.Generator(np.random.PCG64(0))
    vibration = chance.standard_normal((SEGMENTS, SEGMENT))
    moved = 1.0 + chance.random((SEGMENTS, SEGMENT))
    picture = chance.random((1568, 1568)).astype(np.float32)
    yield "mfcc", lambda: mfcc(vibration), 1.0
    yield "hand", lambda: hand(moved, moved), 1.0
    yield "dft", lambda: spectrum(vibration), 1.0
    yield "dwt", lambda: wavelets(vibration), 1.0
    yield "glcm", lambda: glcm(picture), float(PICTURES)
    if "resnet" in kinds:
        from modeling.attributes.resnet import BATCH, folded, loaded, pool_of_patches, random_state

        network, cut = folded(loaded(random_state(0))), patches(picture, Looking())
        yield "resnet", lambda: pool_of_patches(network, cut[:BATCH]), PICTURES * len(cut) / BATCH
