"""What the networks are shown: features standardised and arranged, one picture and some segments of a texture a row."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from palpate.modeling.attributes.material import MaterialError, Modality, Texture, ratings_of
from palpate.modeling.training.sources import Given, Made, digest_of
from palpate.signals.arrays import Array

STEPS, PLACES = 10, 4
"""How a segment's 40 frames are laid out: ten steps of 50 ms, four frames side by side in each."""
REPEATED = "hand"
"""The features that hold for a whole segment: they stand beside every frame."""
LIMIT = 6.0
"""Standardised features are kept within so many SDs."""
CONSTANT = 1e-6
"""The share of its greatest value below which a column's SD is rounding."""


@dataclass(frozen=True)
class Look:
    """One modality's features as a network sees them: their kinds, sizes, mean (features,) and 1 / SD (features,).

    A column that is equal in all rows learned from tells nothing: its 1 / SD is 0, and it is 0 ever after.
    """

    modality: Modality
    kinds: tuple[str, ...]
    sizes: tuple[int, ...]
    mean: Array
    gain: Array

    @property
    def channels(self) -> int:
        """How many channels HT-Net is given."""
        return sum(_width(kind, size) for kind, size in zip(self.kinds, self.sizes, strict=True))

    def rows(self, texture: Texture) -> Tensor:
        """A texture's rows, standardised (rows, features). Raises MaterialError where it has none of these."""
        return self.down(_checked(texture.rows(self.modality, self.kinds), texture.id, self.modality), texture.id)

    def down(self, rows: NDArray[np.float32], name: str) -> Tensor:
        """Rows (n, features), standardised. Raises MaterialError for another number of features."""
        if rows.shape[1] != len(self.mean):
            told = f"{name}: {rows.shape[1]} features of {self.modality} ({', '.join(self.kinds)})"
            raise MaterialError(f"{told}; the network was fitted to {len(self.mean)}.")
        scaled = np.clip((rows - self.mean) * self.gain, -LIMIT, LIMIT)
        return torch.from_numpy(np.ascontiguousarray(scaled, dtype=np.float32))


def look_of(textures: Sequence[Texture], modality: Modality, kinds: Sequence[str]) -> Look:
    """Mean and SD of these textures' rows, each texture counting as much as another.

    Raises MaterialError where one has no such rows, or rows of another length.
    """
    found = [_checked(texture.rows(modality, kinds), texture.id, modality) for texture in textures]
    if len({rows.shape[1] for rows in found}) != 1:
        raise MaterialError(
            f"{modality}: rows of {sorted({rows.shape[1] for rows in found})} features; one is expected."
        )
    own = textures[0].touch if modality == "touch" else textures[0].sight
    mean = np.mean([rows.mean(axis=0, dtype=np.float64) for rows in found], axis=0)
    spread = np.sqrt(np.mean([np.mean((rows - mean) ** 2, axis=0) for rows in found], axis=0))
    most = np.max([np.abs(rows).max(axis=0) for rows in found], axis=0)
    varies = spread > CONSTANT * most
    gain = np.divide(1.0, spread, out=np.zeros_like(spread), where=varies)
    return Look(modality, tuple(kinds), tuple(own[kind].shape[1] for kind in kinds), mean, gain)


def arranged(rows: Tensor, look: Look) -> Tensor:
    """Rows of touch (n, features) to (n, steps, channels, places), as HT-Net takes them.

    The numbers of a kind are dealt out to 40 frames in their order: 520 cepstral coefficients are 13 a frame, in time;
    of a spectrum a step is a band. Where they do not divide by 40, zeros fill up the end.
    """
    parts = torch.split(rows, list(look.sizes), dim=1)
    dealt = [_dealt(part, kind) for part, kind in zip(parts, look.kinds, strict=True)]
    frames = torch.cat(dealt, dim=2)
    return frames.view(len(rows), STEPS, PLACES, -1).transpose(2, 3).contiguous()


def _dealt(part: Tensor, kind: str) -> Tensor:
    """(n, numbers) to (n, frames, channels)."""
    frames, width = STEPS * PLACES, _width(kind, part.shape[1])
    if kind == REPEATED:
        return part[:, None].expand(-1, frames, -1)
    return torch.nn.functional.pad(part, (0, frames * width - part.shape[1])).view(-1, frames, width)


def _width(kind: str, size: int) -> int:
    return size if kind == REPEATED else math.ceil(size / (STEPS * PLACES))


@dataclass(frozen=True)
class Target:
    """How ratings on 0..100 are scaled: the attributes' own mean (attributes,), and one SD for all of them."""

    mean: Array
    sd: float

    def down(self, ratings: Array) -> Tensor:
        """Ratings to scaled ones."""
        return torch.from_numpy(np.asarray((ratings - self.mean) / self.sd, dtype=np.float32))

    def up(self, scaled: Array) -> Array:
        """The way back."""
        found: Array = scaled * self.sd + self.mean
        return found


def target_of(textures: Sequence[Texture]) -> Target:
    """The scale of these textures' ratings; equal ratings are left as they are. Raises MaterialError for none."""
    ratings = ratings_of(textures)
    if not np.isfinite(ratings).all():
        raise MaterialError(f"{textures[int(np.argwhere(~np.isfinite(ratings))[0][0])].id}: a rating is not finite.")
    mean = ratings.mean(axis=0)
    sd = float(np.sqrt(np.mean((ratings - mean) ** 2)))
    return Target(mean, sd if sd > CONSTANT else 1.0)


@dataclass(frozen=True)
class Shown:
    """A texture as tensors: rows of pictures and of arranged segments, of those that the network looks at."""

    sight: Tensor | None
    touch: Tensor | None

    @property
    def given(self) -> tuple[Tensor, ...]:
        """Those that are there, pictures first."""
        return tuple(each for each in (self.sight, self.touch) if each is not None)


def shown(texture: Texture, sight: Look | None, touch: Look | None, variants: bool = False) -> Shown:
    """A texture as the network sees it; with `variants` the further versions of its pictures too.

    Raises MaterialError where it lacks what is looked at.
    """
    seen = None if sight is None else sight.rows(texture)
    if seen is not None and sight is not None and variants and all(kind in texture.variants for kind in sight.kinds):
        further = np.concatenate([texture.variants[kind] for kind in sight.kinds], axis=1)
        seen = torch.cat([seen, sight.down(further, texture.id)])
    felt = None if touch is None else arranged(touch.rows(texture), touch)
    return Shown(seen, felt)


def drawn(textures: Sequence[Shown], targets: Tensor, segments: int) -> Made:
    """A row a texture: every time another of its pictures and other segments, drawn with replacement."""

    def make(rows: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        picked = [_drawn(textures[row], segments, chance) for row in rows.tolist()]
        return tuple(torch.stack(each) for each in zip(*picked, strict=True)), targets[rows]

    return Made(len(textures), make, f"{_digest(textures, targets)} by {segments}")


def _drawn(texture: Shown, segments: int, chance: torch.Generator) -> list[Tensor]:
    found = []
    if texture.sight is not None:
        found.append(texture.sight[int(torch.randint(len(texture.sight), (1,), generator=chance))])
    if texture.touch is not None:
        found.append(texture.touch[torch.randint(len(texture.touch), (segments,), generator=chance)])
    return found


def spread_out(textures: Sequence[Shown], targets: Tensor, pictures: int, segments: int) -> Made:
    """To be watched: so many rows a texture, each with another picture, and segments from all over the recording."""

    def make(rows: Tensor, _chance: torch.Generator) -> tuple[Given, Given]:
        picked = [_evenly(textures[row // pictures], row % pictures, pictures, segments) for row in rows.tolist()]
        return tuple(torch.stack(each) for each in zip(*picked, strict=True)), targets[rows // pictures]

    return Made(len(textures) * pictures, make, f"{_digest(textures, targets)} evenly {pictures}, {segments}")


def _evenly(texture: Shown, turn: int, turns: int, segments: int) -> list[Tensor]:
    found = []
    if texture.sight is not None:
        found.append(texture.sight[turn * len(texture.sight) // turns])
    if texture.touch is not None:
        places = (torch.arange(segments) * turns + turn) * len(texture.touch) // (segments * turns)
        found.append(texture.touch[places])
    return found


def _digest(textures: Sequence[Shown], targets: Tensor) -> str:
    return digest_of(iter([*(tensor for each in textures for tensor in each.given), targets]))


def _checked(rows: NDArray[np.float32], name: str, modality: Modality) -> NDArray[np.float32]:
    """Raises MaterialError where there are none."""
    if not len(rows):
        raise MaterialError(f"{name}: not one {'segment' if modality == 'touch' else 'picture'} to look at.")
    return rows
