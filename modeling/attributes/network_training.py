"""Fitting the visuo-tactile network, or one of its halves, to textures, and asking it about one (thesis 3.5.3)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from palpate.modeling.attributes.learnable import textures_of
from palpate.modeling.attributes.material import MaterialError, Modality, Texture, ratings_of
from palpate.modeling.attributes.methods import Learning
from palpate.modeling.attributes.visuo_tactile import VisuoTactile, rmse
from palpate.modeling.training.loop import Trained, adam, train
from palpate.modeling.training.optimisers import cosine
from palpate.modeling.training.seeding import seeded, training_state
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import GeneratedRows, Given, digest_of
from palpate.signals.arrays import Array

SETTINGS = Settings(epochs=30, batch=2, learning_rate=5e-4, plateau_patience=None, stop_patience=10, every_epochs=5)
"""The thesis has at most 200 epochs, which would take a fold ten to twenty minutes; in 30 the rate falls along a cosine
to nearly nothing, so that stopping there is no accident (22 are too few: docs/reference/attribute-models.md). Adam, and
a patience of 10 where textures are watched, are the thesis', batch and rate ours."""
LITERAL_SETTINGS = replace(SETTINGS, epochs=200, learning_rate=1e-3)
"""Thesis 3.5.3: 200 epochs at most, ended after more than 10 without a better one, Adam. The rate is Keras' own and
stays as it is; the batch, which the thesis does not give, is ours."""
QUICK_EPOCHS = 2
SEGMENTS = 2
"""Segments that a picture is shown with each time: HV-Net costs nine times what HT-Net does."""
HELD_PICTURES, HELD_SEGMENTS = 2, 8
"""What is looked at of each texture that is watched."""
PICTURES_AT_ONCE, SEGMENTS_AT_ONCE = 8, 64
STEPS, PLACES = 10, 4
"""How a segment's 40 frames are laid out: ten steps of 50 ms, four frames side by side in each."""
REPEATED = "hand"
"""The features that hold for a whole segment: they stand beside every frame."""
LIMIT = 6.0
"""Standardised features are clipped to so many SDs."""
CONSTANT = 1e-6
"""The share of its greatest value below which a column's SD is rounding."""
NETWORK = "network."
Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class FittedNetwork:
    """A trained network, how it sees features and scales ratings, and how its training went."""

    network: VisuoTactile
    sight: Look | None
    touch: Look | None
    target: Target
    trained: Trained | None = None

    def predict(self, texture: Texture) -> Array:
        """(n, attributes) on 0..100, not clipped; n is the greater of its segments and pictures.

        Every segment and every picture is looked at once: segment i goes with picture i, and where one of them ends
        before the other it begins anew. Raises MaterialError for features that it was not fitted to.
        """
        (result,) = self.predict_all([texture])
        if isinstance(result, MaterialError):
            raise result
        return result

    def predict_all(self, textures: Sequence[Texture]) -> list[Array | MaterialError]:
        """Return the prediction of each texture, or the error that refuses it; together it is several times as fast."""
        given: list[TextureTensors | MaterialError] = []
        for texture in textures:
            try:
                given.append(texture_tensors(texture, self.sight, self.touch))
            except MaterialError as refusal:
                given.append(refusal)
        whole = [tensors for tensors in given if isinstance(tensors, TextureTensors)]
        with training_state(0, 1), torch.no_grad():
            self.network.eval()
            scaled = iter(_answers(self.network, whole) if whole else [])
        answers: list[Array | MaterialError] = []
        for texture, tensors in zip(textures, given, strict=True):
            if isinstance(tensors, MaterialError):
                answers.append(tensors)
                continue
            ratings = self.target.up(next(scaled).numpy().astype(np.float64))
            if np.isfinite(ratings).all():
                answers.append(ratings)
            else:
                answers.append(MaterialError(f"{texture.id}: the network's answer is not finite."))
        return answers

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Arrays (weights, standardisation, scale of the ratings) and plain values, for `restore_network`."""
        looks = [look for look in (self.sight, self.touch) if look is not None]
        literal = {"literal": True} if self.network.literal else {}
        return arrays_of(self.network, looks, self.target), {"looks": looks_metadata(looks), **literal}


def fit_network(learning: Learning, sees: frozenset[Modality], literal: bool = False) -> FittedNetwork:
    """Train a network that looks at the learning's features of `sees`.

    An epoch shows each texture once, with one of its pictures (or of their variants) and some of its segments; others
    every time. The last epoch is kept; where textures are held, that with the lowest RMSE on them. `literal` as for
    `VisuoTactile`, trained at a rate that stays as it is (`LITERAL_SETTINGS`). Raises MaterialError for textures that
    cannot be learned from, TrainingError for a training that does not converge.
    """
    textures, ratings = textures_of(learning)
    sight = look_of(textures, "sight", learning.sight) if "sight" in sees else None
    touch = look_of(textures, "touch", learning.touch) if "touch" in sees else None
    target = target_of(textures)
    settings = LITERAL_SETTINGS if literal else SETTINGS
    chosen = learning.training_settings(settings, QUICK_EPOCHS)
    network = _network(sight, touch, target, chosen.seed, literal)
    data = random_rows(
        [texture_tensors(texture, sight, touch, variants=True) for texture in textures], target.down(ratings), SEGMENTS
    )
    held = None
    if learning.held:
        watched = sorted(learning.held, key=lambda texture: texture.id)
        seen = [texture_tensors(texture, sight, touch) for texture in watched]
        held = even_rows(seen, target.down(ratings_of(watched)), HELD_PICTURES, HELD_SEGMENTS)
    chosen = replace(chosen, keep_last=held is None)
    steps = chosen.epochs * math.ceil(len(data) / chosen.batch)
    optimiser = adam if literal else cosine(steps)
    trained = train(network, data, held, rmse, chosen, optimiser=optimiser, report=learning.report)
    return FittedNetwork(network, sight, touch, target, trained)


def restore_network(arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> FittedNetwork:
    """Return the fitted network from what its `saved` gave; it answers to the bit as before.

    Raises MaterialError where the arrays are not those of such a network.
    """
    try:
        looks = {look.modality: look for look in looks_in(arrays, metadata["looks"])}
        target = target_in(arrays)
        literal = bool(metadata.get("literal", False))
        network = _network(looks.get("sight"), looks.get("touch"), target, 0, literal)
        load_into(network, arrays)
    except (KeyError, RuntimeError, TypeError, ValueError) as error:
        raise MaterialError(f"these are not the numbers of a visuo-tactile network: {error}") from error
    return FittedNetwork(network.eval(), looks.get("sight"), looks.get("touch"), target)


def _network(sight: Look | None, touch: Look | None, target: Target, seed: int, literal: bool = False) -> VisuoTactile:
    """With fresh weights; on one thread, since orthogonal ones are a product of sums."""
    length = None if sight is None else len(sight.mean)
    channels = None if touch is None else touch.channels
    with training_state(seed, 1):
        return seeded(lambda: VisuoTactile(length, channels, len(target.mean), literal), seed)


def _answers(network: VisuoTactile, textures: Sequence[TextureTensors]) -> list[Tensor]:
    """Return scaled attributes (n, attributes) of each texture; pictures and segments go through their branch once."""
    branches = []
    if network.sight is not None:
        seen = [texture.sight for texture in textures if texture.sight is not None]
        branches.append(_through(network.sight.embed_rows, seen, PICTURES_AT_ONCE))
    if network.touch is not None:
        felt = [texture.touch for texture in textures if texture.touch is not None]
        branches.append(_through(network.touch, felt, SEGMENTS_AT_ONCE))
    answers = []
    for parts in zip(*branches, strict=True):  # the shorter of pictures and segments begins anew where it ends
        rows = torch.arange(max(len(part) for part in parts))
        answers.append(network.head([part[rows % len(part)][:, None] for part in parts])[:, 0])
    return answers


def _through(branch: Callable[[Tensor], Tensor], rows: Sequence[Tensor], at_once: int) -> tuple[Tensor, ...]:
    """Return what a branch says of the rows of each texture, so many at once."""
    answers = torch.cat([branch(part) for part in torch.split(torch.cat(list(rows)), at_once)])
    parts: tuple[Tensor, ...] = torch.split(answers, [len(row) for row in rows])
    return parts


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
        """Return a texture's rows, standardised (rows, features). Raises MaterialError where it has none of these."""
        return self.down(_checked(texture.rows(self.modality, self.kinds), texture.id, self.modality), texture.id)

    def down(self, rows: NDArray[np.float32], name: str) -> Tensor:
        """Return rows (n, features), standardised. Raises MaterialError for another number of features."""
        if rows.shape[1] != len(self.mean):
            text = f"{name}: {rows.shape[1]} features of {self.modality} ({', '.join(self.kinds)})"
            raise MaterialError(f"{text}; the network was fitted to {len(self.mean)}.")
        scaled = np.clip((rows - self.mean) * self.gain, -LIMIT, LIMIT)
        return torch.from_numpy(np.ascontiguousarray(scaled, dtype=np.float32))


def look_of(textures: Sequence[Texture], modality: Modality, kinds: Sequence[str]) -> Look:
    """Return mean and SD of these textures' rows, each texture counting as much as another.

    Raises MaterialError where one has no such rows, or rows of another length.
    """
    every = [_checked(texture.rows(modality, kinds), texture.id, modality) for texture in textures]
    if len({rows.shape[1] for rows in every}) != 1:
        raise MaterialError(
            f"{modality}: rows of {sorted({rows.shape[1] for rows in every})} features; one is expected."
        )
    own = textures[0].touch if modality == "touch" else textures[0].sight
    mean = np.mean([rows.mean(axis=0, dtype=np.float64) for rows in every], axis=0)
    spread = np.sqrt(np.mean([np.mean((rows - mean) ** 2, axis=0) for rows in every], axis=0))
    most = np.max([np.abs(rows).max(axis=0) for rows in every], axis=0)
    varies = spread > CONSTANT * most
    gain = np.divide(1.0, spread, out=np.zeros_like(spread), where=varies)
    return Look(modality, tuple(kinds), tuple(own[kind].shape[1] for kind in kinds), mean, gain)


def arrange_frames(rows: Tensor, look: Look) -> Tensor:
    """Lay out rows of touch (n, features) as (n, steps, channels, places), as HT-Net takes them.

    The numbers of a kind are dealt out to 40 frames in their order: 520 cepstral coefficients are 13 a frame, in time;
    of a spectrum a step is a band. Where they do not divide by 40, zeros fill up the end.
    """
    parts, count, by_frame = torch.split(rows, list(look.sizes), dim=1), STEPS * PLACES, []
    for part, kind in zip(parts, look.kinds, strict=True):
        width = _width(kind, part.shape[1])
        if kind == REPEATED:
            by_frame.append(part[:, None].expand(-1, count, -1))
        else:
            padded = torch.nn.functional.pad(part, (0, count * width - part.shape[1]))
            by_frame.append(padded.view(-1, count, width))
    frames = torch.cat(by_frame, dim=2)
    return frames.view(len(rows), STEPS, PLACES, -1).transpose(2, 3).contiguous()


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
        """Return the way back."""
        result: Array = scaled * self.sd + self.mean
        return result


def target_of(textures: Sequence[Texture]) -> Target:
    """The scale of these textures' ratings; equal ratings are left as they are. Raises MaterialError for none."""
    ratings = ratings_of(textures)
    if not np.isfinite(ratings).all():
        raise MaterialError(f"{textures[int(np.argwhere(~np.isfinite(ratings))[0][0])].id}: a rating is not finite.")
    mean = ratings.mean(axis=0)
    sd = float(np.sqrt(np.mean((ratings - mean) ** 2)))
    return Target(mean, sd if sd > CONSTANT else 1.0)


@dataclass(frozen=True)
class TextureTensors:
    """A texture as tensors: rows of pictures and of arranged segments, of those that the network looks at."""

    sight: Tensor | None
    touch: Tensor | None

    @property
    def given(self) -> tuple[Tensor, ...]:
        """Those that are there, pictures first."""
        return tuple(look for look in (self.sight, self.touch) if look is not None)


def texture_tensors(texture: Texture, sight: Look | None, touch: Look | None, variants: bool = False) -> TextureTensors:
    """Return a texture as the network sees it; with `variants` the further versions of its pictures too.

    Raises MaterialError where it lacks what is looked at.
    """
    seen = None if sight is None else sight.rows(texture)
    if seen is not None and sight is not None and variants and all(kind in texture.variants for kind in sight.kinds):
        further = np.concatenate([texture.variants[kind] for kind in sight.kinds], axis=1)
        seen = torch.cat([seen, sight.down(further, texture.id)])
    felt = None if touch is None else arrange_frames(touch.rows(texture), touch)
    return TextureTensors(seen, felt)


def random_rows(textures: Sequence[TextureTensors], targets: Tensor, segments: int) -> GeneratedRows:
    """Return a row a texture: every time another of its pictures and other segments, drawn with replacement."""

    def make(rows: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        picked = [_drawn(textures[row], segments, chance) for row in rows.tolist()]
        return tuple(torch.stack(tensors) for tensors in zip(*picked, strict=True)), targets[rows]

    return GeneratedRows(len(textures), make, f"{_digest(textures, targets)} by {segments}")


def _drawn(texture: TextureTensors, segments: int, chance: torch.Generator) -> list[Tensor]:
    result = []
    if texture.sight is not None:
        result.append(texture.sight[int(torch.randint(len(texture.sight), (1,), generator=chance))])
    if texture.touch is not None:
        result.append(texture.touch[torch.randint(len(texture.touch), (segments,), generator=chance)])
    return result


def even_rows(textures: Sequence[TextureTensors], targets: Tensor, pictures: int, segments: int) -> GeneratedRows:
    """To be watched: so many rows a texture, each with another picture, and segments from all over the recording."""

    def make(rows: Tensor, _chance: torch.Generator) -> tuple[Given, Given]:
        picked = [_evenly(textures[row // pictures], row % pictures, pictures, segments) for row in rows.tolist()]
        return tuple(torch.stack(tensors) for tensors in zip(*picked, strict=True)), targets[rows // pictures]

    return GeneratedRows(len(textures) * pictures, make, f"{_digest(textures, targets)} evenly {pictures}, {segments}")


def _evenly(texture: TextureTensors, turn: int, turns: int, segments: int) -> list[Tensor]:
    result = []
    if texture.sight is not None:
        result.append(texture.sight[turn * len(texture.sight) // turns])
    if texture.touch is not None:
        places = (torch.arange(segments) * turns + turn) * len(texture.touch) // (segments * turns)
        result.append(texture.touch[places])
    return result


def _digest(textures: Sequence[TextureTensors], targets: Tensor) -> str:
    return digest_of(iter([*(tensor for texture in textures for tensor in texture.given), targets]))


def _checked(rows: NDArray[np.float32], name: str, modality: Modality) -> NDArray[np.float32]:
    """Raises MaterialError where there are none."""
    if not len(rows):
        raise MaterialError(f"{name}: not one {'segment' if modality == 'touch' else 'picture'} to look at.")
    return rows


def arrays_of(network: nn.Module, looks: Iterable[Look], target: Target) -> dict[str, NDArray[Any]]:
    """Weights, standardisation, and the scale of the ratings."""
    arrays = {NETWORK + name: tensor.numpy() for name, tensor in network.state_dict().items()}
    for look in looks:
        arrays |= {f"{look.modality}.mean": look.mean, f"{look.modality}.gain": look.gain}
    return arrays | {"target.mean": target.mean, "target.sd": np.array([target.sd])}


def looks_metadata(looks: Iterable[Look]) -> list[list[Any]]:
    """Return what `looks_in` wants beside the arrays."""
    return [[look.modality, list(look.kinds), list(look.sizes)] for look in looks]


def looks_in(arrays: Arrays, metadata: Iterable[tuple[Any, Iterable[str], Iterable[int]]]) -> tuple[Look, ...]:
    """Return how features were seen. Raises KeyError where an array lacks."""
    return tuple(
        Look(modality, tuple(kinds), tuple(sizes), arrays[f"{modality}.mean"], arrays[f"{modality}.gain"])
        for modality, kinds, sizes in metadata
    )


def target_in(arrays: Arrays) -> Target:
    """Return the scale of the ratings. Raises KeyError where an array lacks."""
    return Target(arrays["target.mean"], float(arrays["target.sd"][0]))


def load_into(network: nn.Module, arrays: Arrays) -> None:
    """Give a network its weights. Raises RuntimeError where they are another's."""
    own = {name.removeprefix(NETWORK): array for name, array in arrays.items() if name.startswith(NETWORK)}
    network.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in own.items()})
