"""Made-up textures: roughness is felt, bumps seen, friction and compliance felt only; ratings follow them."""

import numpy as np

from palpate.modeling.attributes.material import Material, Pair, Rated, Texture

PAIRS = (Pair("Rough", "Smooth"), Pair("Flat", "Bumpy"), Pair("Sticky", "Slippery"), Pair("Hard", "Soft"))
SIZES = {"mfcc": 520, "hand": 6, "dft": 250, "dwt": 24, "resnet": 2048, "glcm": 256}
CLASSES = ("wood", "foam", "mesh")


def simulated_material(textures=12, segments=6, pictures=3, seed=0, noise=1.0, variants=1):
    """Features are random directions of four latents plus noise, as many numbers a row as the real ones have."""
    chance = np.random.Generator(np.random.PCG64(seed))
    latent = chance.standard_normal((textures, 4))
    ways = {kind: chance.standard_normal((4, size)) for kind, size in SIZES.items()}
    felt, seen = np.array([1.0, 0.0, 1.0, 1.0]), np.array([0.3, 1.0, 0.0, 0.0])

    def rows(kinds, counted, share, own):
        return {
            kind: ((own * share) @ ways[kind] + noise * chance.standard_normal((counted, SIZES[kind]))).astype("f4")
            for kind in kinds
        }

    textures_of_material = tuple(
        Texture(
            f"T{place + 1:02d}", f"{CLASSES[place % 3]} {place // 3 + 1}", CLASSES[place % 3],
            touch=rows(("mfcc", "hand", "dft", "dwt"), segments, felt, own),
            sight=rows(("resnet", "glcm"), pictures, seen, own),
            variants=rows(("resnet", "glcm"), pictures * variants, seen, own) if variants else {},
            rated=Rated(np.clip(50 + 18 * own, 0, 100), np.full(4, 8.0), 20),
            made_from=frozenset({f"{seed}-{place}"}),
        )
        for place, own in enumerate(latent)
    )  # fmt: skip
    return Material(textures_of_material, PAIRS, weights="made up", simulated=True)
