"""Pictures as the bytes of files, of any size, mode and format."""

import io

import numpy as np
from PIL import Image


def grains(side=256, seed=0, width=None):
    """(side, width) of coarse grains and fine noise, 0 to 255."""
    chance = np.random.default_rng(seed)
    shape = (side, width or side)
    coarse = np.kron(chance.integers(0, 110, (shape[0] // 8 + 1, shape[1] // 8 + 1)), np.ones((8, 8)))
    return (coarse[: shape[0], : shape[1]] + chance.integers(30, 110, shape)).astype("u1")


def file_of(image, kind="PNG", **options):
    """The bytes of a file; an array is gray or colours."""
    out = io.BytesIO()
    (Image.fromarray(image) if isinstance(image, np.ndarray) else image).save(out, kind, **options)
    return out.getvalue()


def write_picture(path, side=256, seed=0, kind=None):
    """A file of grains; its bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(file_of(grains(side, seed), kind or ("PNG" if path.suffix == ".png" else "JPEG")))
    return path.read_bytes()
