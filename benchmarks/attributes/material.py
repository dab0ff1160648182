"""Synthetic textures for the bench, with known shares of each attribute in touch, in sight, and in neither."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from palpate.modeling.attributes.material import FeatureRows, Material, Pair, Rated, Texture
from palpate.signals.arrays import Array

PAIRS = (Pair("Rough", "Smooth"), Pair("Flat", "Bumpy"), Pair("Sticky", "Slippery"), Pair("Hard", "Soft"))
SIZES: Mapping[str, int] = {"mfcc": 520, "hand": 6, "dft": 250, "dwt": 24, "resnet": 2048, "glcm": 256}
IN_TOUCH, IN_SIGHT = np.array([1.0, 0.0, 1.0, 1.0]), np.array([0.4, 1.0, 0.0, 0.0])
"""How much of roughness, bumps, slipperiness and softness is in touch, and in sight."""
CLASSES = ("wood", "foam", "mesh", "paper")
RATING_SD, PEOPLE_SD, PEOPLE = 18.0, 8.0, 20
WHOLE, WHOLE_SEGMENTS, WHOLE_PICTURES = 50, 110, 10
"""A whole study: its textures, and the segments (60 s less 5 s of ends) and pictures of each."""


def random_material(textures: int, segments: int, pictures: int, seed: int = 0, noise: float = 1.0) -> Material:
    """Return random projections of four latent numbers with noise as features, and noisy latents as mean ratings."""
    chance = np.random.Generator(np.random.PCG64(seed))
    directions = {kind: chance.standard_normal((4, size)) for kind, size in SIZES.items()}
    built = []
    for place, own in enumerate(chance.standard_normal((textures, 4))):

        def rows(kinds: Sequence[str], count: int, latent: Array) -> dict[str, FeatureRows]:
            noises = {kind: noise * chance.standard_normal((count, SIZES[kind])) for kind in kinds}
            return {kind: (latent @ directions[kind] + noises[kind]).astype(np.float32) for kind in kinds}

        off = PEOPLE_SD / np.sqrt(PEOPLE) * chance.standard_normal(4)
        built.append(
            Texture(
                f"M{place + 1:02d}", f"made up {place + 1}", CLASSES[place % len(CLASSES)],
                touch=rows(("mfcc", "hand", "dft", "dwt"), segments, own * IN_TOUCH),
                sight=rows(("resnet", "glcm"), pictures, own * IN_SIGHT),
                variants=rows(("resnet", "glcm"), pictures, own * IN_SIGHT),
                rated=Rated(np.clip(50 + RATING_SD * own + off, 0, 100), np.full(4, PEOPLE_SD), PEOPLE),
                made_from=frozenset({f"made up {seed} {place}"}),
            )
        )  # fmt: skip
    return Material(tuple(built), PAIRS, weights="made up: no network looked at anything", simulated=True)
