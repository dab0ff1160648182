"""Training of the visuo-tactile network, or one of its branches, and its predictions (thesis 3.5.3)."""

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
"""The thesis has at most 200 epochs, which take ten to twenty minutes per fold. Here the rate falls along a cosine to
nearly 0 in 30 epochs, so that ending there is not arbitrary (22 are too few: docs/reference/attribute-models.md).
Adam, and a patience of 10 where textures are watched, are the thesis'; batch and rate are our choice."""
LITERAL_SETTINGS = replace(SETTINGS, epochs=200, learning_rate=1e-3)
"""Thesis 3.5.3: at most 200 epochs, ended after more than 10 without a better one, Adam. The constant rate is Keras'
default; the batch, which the thesis does not give, is our choice."""
QUICK_EPOCHS = 2
SEGMENTS = 2
"""Segments per picture in a training row: HV-Net takes nine times as long as HT-Net."""
HELD_PICTURES, HELD_SEGMENTS = 2, 8
"""Pictures, and segments with each, of a held texture."""
PICTURES_AT_ONCE, SEGMENTS_AT_ONCE = 8, 64
STEPS, PLACES = 10, 4
"""The layout of a segment's 40 frames: ten steps of 50 ms with four frames side by side."""
REPEATED = "hand"
"""Features of a whole segment, repeated at every frame."""
LIMIT = 6.0
"""The SDs to which standardised features are clipped."""
CONSTANT = 1e-6
"""The share of its greatest value below which a column's SD counts as rounding."""
NETWORK = "network."
Arrays = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class FittedNetwork:
    """A trained network with the standardisation of its features, the scale of its ratings, and its training."""

    network: VisuoTactile
    sight: Look | None
    touch: Look | None
    target: Target
    trained: Trained | None = None

    def predict(self, texture: Texture) -> Array:
        """Return predictions (n, attributes) on 0..100, not clipped; n is the greater number of segments or pictures.

        Segment i goes with picture i; the shorter of the two is repeated. Raises MaterialError for features that it was
        not fitted to.
        """
        (result,) = self.predict_all([texture])
        if isinstance(result, MaterialError):
            raise result
        return result

    def predict_all(self, textures: Sequence[Texture]) -> list[Array | MaterialError]:
        """Return the prediction of each texture, or its error; computed at once, which is several times as fast."""
        inputs: list[TextureTensors | MaterialError] = []
        for texture in textures:
            try:
                inputs.append(texture_tensors(texture, self.sight, self.touch))
            except MaterialError as refusal:
                inputs.append(refusal)
        usable = [tensors for tensors in inputs if isinstance(tensors, TextureTensors)]
        with training_state(0, 1), torch.no_grad():
            self.network.eval()
            scaled = iter(_answers(self.network, usable) if usable else [])
        answers: list[Array | MaterialError] = []
        for texture, tensors in zip(textures, inputs, strict=True):
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
        """Return arrays (weights, standardisation, scale of the ratings) and plain values, for `restore_network`."""
        looks = [look for look in (self.sight, self.touch) if look is not None]
        literal = {"literal": True} if self.network.literal else {}
        return arrays_of(self.network, looks, self.target), {"looks": looks_metadata(looks), **literal}


def fit_network(learning: Learning, sees: frozenset[Modality], literal: bool = False) -> FittedNetwork:
    """Train a network on the features of the modalities `sees`.

    An epoch shows each texture once, with a random picture (or variant of one) and random segments. The result has the
    weights of the last epoch, or with held textures of the epoch with the lowest RMSE on them. `literal` is as for
    `VisuoTactile`, with a constant rate (`LITERAL_SETTINGS`). Raises MaterialError for textures that cannot be learned
    from, TrainingError for a loss that is not finite.
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
        inputs = [texture_tensors(texture, sight, touch) for texture in watched]
        held = even_rows(inputs, target.down(ratings_of(watched)), HELD_PICTURES, HELD_SEGMENTS)
    chosen = replace(chosen, keep_last=held is None)
    steps = chosen.epochs * math.ceil(len(data) / chosen.batch)
    optimiser = adam if literal else cosine(steps)
    trained = train(network, data, held, rmse, chosen, optimiser=optimiser, report=learning.report)
    return FittedNetwork(network, sight, touch, target, trained)


def restore_network(arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> FittedNetwork:
    """Return the fitted network from the arrays and plain values of its `saved`; its predictions are bit-identical.

    Raises MaterialError for other arrays.
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
    """Return a network with initial weights, computed on one thread, since orthogonal ones depend on sums' order."""
    length = None if sight is None else len(sight.mean)
    channels = None if touch is None else touch.channels
    with training_state(seed, 1):
        return seeded(lambda: VisuoTactile(length, channels, len(target.mean), literal), seed)


def _answers(network: VisuoTactile, textures: Sequence[TextureTensors]) -> list[Tensor]:
    """Return scaled attributes (n, attributes) of each texture; each picture and segment is computed once."""
    branches = []
    if network.sight is not None:
        pictures = [texture.sight for texture in textures if texture.sight is not None]
        branches.append(_embeddings(network.sight.embed_rows, pictures, PICTURES_AT_ONCE))
    if network.touch is not None:
        segments = [texture.touch for texture in textures if texture.touch is not None]
        branches.append(_embeddings(network.touch, segments, SEGMENTS_AT_ONCE))
    answers = []
    for parts in zip(*branches, strict=True):  # the shorter of pictures and segments is repeated
        rows = torch.arange(max(len(part) for part in parts))
        answers.append(network.head([part[rows % len(part)][:, None] for part in parts])[:, 0])
    return answers


def _embeddings(branch: Callable[[Tensor], Tensor], rows: Sequence[Tensor], at_once: int) -> tuple[Tensor, ...]:
    """Return a branch's output for the rows of each texture, computed `at_once` rows at a time."""
    answers = torch.cat([branch(part) for part in torch.split(torch.cat(list(rows)), at_once)])
    parts: tuple[Tensor, ...] = torch.split(answers, [len(row) for row in rows])
    return parts


@dataclass(frozen=True)
class Look:
    """The standardisation of one modality's features: kinds, sizes, mean (features,) and 1 / SD (features,).

    The 1 / SD of a column that is constant in the training rows is 0, so the column is always 0.
    """

    modality: Modality
    kinds: tuple[str, ...]
    sizes: tuple[int, ...]
    mean: Array
    gain: Array

    @property
    def channels(self) -> int:
        """The number of HT-Net's input channels."""
        return sum(_width(kind, size) for kind, size in zip(self.kinds, self.sizes, strict=True))

    def rows(self, texture: Texture) -> Tensor:
        """Return a texture's standardised rows (n, features). Raises MaterialError where it has none of these kinds."""
        return self.down(_checked(texture.rows(self.modality, self.kinds), texture.id, self.modality), texture.id)

    def down(self, rows: NDArray[np.float32], name: str) -> Tensor:
        """Return rows (n, features) standardised. Raises MaterialError for another number of features."""
        if rows.shape[1] != len(self.mean):
            text = f"{name}: {rows.shape[1]} features of {self.modality} ({', '.join(self.kinds)})"
            raise MaterialError(f"{text}; the network was fitted to {len(self.mean)}.")
        scaled = np.clip((rows - self.mean) * self.gain, -LIMIT, LIMIT)
        return torch.from_numpy(np.ascontiguousarray(scaled, dtype=np.float32))


def look_of(textures: Sequence[Texture], modality: Modality, kinds: Sequence[str]) -> Look:
    """Return the standardisation by these textures' rows, with equal weight for each texture.

    Raises MaterialError for a texture without such rows, or with rows of another length.
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
    """Return rows of touch (n, features) as (n, steps, channels, places), HT-Net's input.

    The numbers of a kind are divided among 40 frames in their order: 520 cepstral coefficients are 13 per frame, in
    time; a step of a spectrum is a band. Numbers that do not divide by 40 are padded with zeros at the end.
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
    """Return the number of channels of a kind with `size` numbers."""
    return size if kind == REPEATED else math.ceil(size / (STEPS * PLACES))


@dataclass(frozen=True)
class Target:
    """The scale of ratings on 0..100: each attribute's mean, (attributes,), and one SD for all attributes."""

    mean: Array
    sd: float

    def down(self, ratings: Array) -> Tensor:
        """Return ratings (n, attributes) scaled."""
        return torch.from_numpy(np.asarray((ratings - self.mean) / self.sd, dtype=np.float32))

    def up(self, scaled: Array) -> Array:
        """Return scaled ratings (n, attributes) on 0..100."""
        result: Array = scaled * self.sd + self.mean
        return result


def target_of(textures: Sequence[Texture]) -> Target:
    """Return the scale of these textures' ratings; the SD is 1 where all ratings are equal.

    Raises MaterialError for a texture without ratings, or a rating that is not finite.
    """
    ratings = ratings_of(textures)
    if not np.isfinite(ratings).all():
        raise MaterialError(f"{textures[int(np.argwhere(~np.isfinite(ratings))[0][0])].id}: a rating is not finite.")
    mean = ratings.mean(axis=0)
    sd = float(np.sqrt(np.mean((ratings - mean) ** 2)))
    return Target(mean, sd if sd > CONSTANT else 1.0)


@dataclass(frozen=True)
class TextureTensors:
    """A texture as tensors: rows of pictures and arranged segments, None for a modality that the network lacks."""

    sight: Tensor | None
    touch: Tensor | None

    @property
    def given(self) -> tuple[Tensor, ...]:
        """The tensors of the network's modalities, pictures first."""
        return tuple(look for look in (self.sight, self.touch) if look is not None)


def texture_tensors(texture: Texture, sight: Look | None, touch: Look | None, variants: bool = False) -> TextureTensors:
    """Return a texture's standardised tensors; with `variants` the pictures' variants too.

    Raises MaterialError where a modality of the network is missing.
    """
    pictures = None if sight is None else sight.rows(texture)
    has_variants = sight is not None and all(kind in texture.variants for kind in sight.kinds)
    if pictures is not None and sight is not None and variants and has_variants:
        further = np.concatenate([texture.variants[kind] for kind in sight.kinds], axis=1)
        pictures = torch.cat([pictures, sight.down(further, texture.id)])
    segments = None if touch is None else arrange_frames(touch.rows(texture), touch)
    return TextureTensors(pictures, segments)


def random_rows(textures: Sequence[TextureTensors], targets: Tensor, segments: int) -> GeneratedRows:
    """Return a row for each texture, every time with a random picture and random segments, drawn with replacement."""

    def make(rows: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        picked = [_random_row(textures[row], segments, chance) for row in rows.tolist()]
        return tuple(torch.stack(tensors) for tensors in zip(*picked, strict=True)), targets[rows]

    return GeneratedRows(len(textures), make, f"{_digest(textures, targets)} by {segments}")


def _random_row(texture: TextureTensors, segments: int, chance: torch.Generator) -> list[Tensor]:
    """Return a random picture (features,) and random segments (segments, ...) of a texture."""
    result = []
    if texture.sight is not None:
        result.append(texture.sight[int(torch.randint(len(texture.sight), (1,), generator=chance))])
    if texture.touch is not None:
        result.append(texture.touch[torch.randint(len(texture.touch), (segments,), generator=chance)])
    return result


def even_rows(textures: Sequence[TextureTensors], targets: Tensor, pictures: int, segments: int) -> GeneratedRows:
    """Return `pictures` rows for each texture, with evenly spaced pictures and segments, for the held-out loss."""

    def make(rows: Tensor, _chance: torch.Generator) -> tuple[Given, Given]:
        picked = [_evenly(textures[row // pictures], row % pictures, pictures, segments) for row in rows.tolist()]
        return tuple(torch.stack(tensors) for tensors in zip(*picked, strict=True)), targets[rows // pictures]

    return GeneratedRows(len(textures) * pictures, make, f"{_digest(textures, targets)} evenly {pictures}, {segments}")


def _evenly(texture: TextureTensors, turn: int, turns: int, segments: int) -> list[Tensor]:
    """Return the picture and the segments of row `turn` of `turns` rows of a texture."""
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
    """Return the rows. Raises MaterialError where there are none."""
    if not len(rows):
        raise MaterialError(f"{name}: not one {'segment' if modality == 'touch' else 'picture'} to look at.")
    return rows


def arrays_of(network: nn.Module, looks: Iterable[Look], target: Target) -> dict[str, NDArray[Any]]:
    """Return weights, standardisation, and the scale of the ratings, by name."""
    arrays = {NETWORK + name: tensor.numpy() for name, tensor in network.state_dict().items()}
    for look in looks:
        arrays |= {f"{look.modality}.mean": look.mean, f"{look.modality}.gain": look.gain}
    return arrays | {"target.mean": target.mean, "target.sd": np.array([target.sd])}


def looks_metadata(looks: Iterable[Look]) -> list[list[Any]]:
    """Return the plain values that `looks_in` takes beside the arrays."""
    return [[look.modality, list(look.kinds), list(look.sizes)] for look in looks]


def looks_in(arrays: Arrays, metadata: Iterable[tuple[Any, Iterable[str], Iterable[int]]]) -> tuple[Look, ...]:
    """Return the standardisations from arrays and plain values. Raises KeyError for a missing array."""
    return tuple(
        Look(modality, tuple(kinds), tuple(sizes), arrays[f"{modality}.mean"], arrays[f"{modality}.gain"])
        for modality, kinds, sizes in metadata
    )


def target_in(arrays: Arrays) -> Target:
    """Return the scale of the ratings from arrays. Raises KeyError for a missing array."""
    return Target(arrays["target.mean"], float(arrays["target.sd"][0]))


def load_into(network: nn.Module, arrays: Arrays) -> None:
    """Load the weights of a network from arrays. Raises RuntimeError for weights of another network."""
    own = {name.removeprefix(NETWORK): array for name, array in arrays.items() if name.startswith(NETWORK)}
    network.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in own.items()})
