"""Shapes that a network promises, checked where they are made."""

from __future__ import annotations

from torch import Tensor

from palpate.modeling.textures.recording import TextureDataError


def shaped(x: Tensor, *sides: int) -> Tensor:
    """(batch, *sides) as it is. Raises TextureDataError for another shape."""
    if x.shape[1:] != sides:
        wanted = ", ".join(map(str, ("batch", *sides)))
        raise TextureDataError(f"a network came to shape {tuple(x.shape)}: ({wanted}) is expected.")
    return x
