"""The baseline networks of the thesis (3.6.6), on rows of features, and their training.

All take the widths of their input rows. The sizes of the ANN are the thesis'; of the others the thesis gives the kind
of network, and the sizes are our choice."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.attributes.learnable import textures_of
from palpate.modeling.attributes.material import MaterialError, Modality, Texture, ratings_of
from palpate.modeling.attributes.methods import Learning, RowPlan
from palpate.modeling.attributes.network_training import (
    Look,
    Target,
    arrays_of,
    load_into,
    look_of,
    looks_in,
    looks_metadata,
    target_in,
    target_of,
)
from palpate.modeling.training.loop import Trained, train
from palpate.modeling.training.seeding import seeded, training_state
from palpate.modeling.training.sources import GeneratedRows, Given, answer_of, digest_of
from palpate.signals.arrays import Array

BRANCH, FUSED = (128, 256, 256, 128), (64, 64)
VISION, HAPTIC, TACTILE = (16, 32), (16, 32, 64), (32, 64)
"""Filters of the convolutions, each followed by ReLU and max pooling of 4."""
POOL = 4
VISION_DENSE, HAPTIC_DENSE = (64,), (64, 64)
SEGMENT, LSTM, TACTILE_DENSE = 64, 64, (32,)
DROPOUT = 0.3
QUICK_EPOCHS = 5
AT_ONCE = 64
"""Rows per batch of a prediction."""


class Ann(nn.Module):
    """A dense network: branches of 128, 256, 256, 128 for touch and sight, fused; 64, 64; one unit per attribute."""

    def __init__(self, widths: Sequence[int], attributes: int) -> None:
        super().__init__()
        self.touch, self.sight = (dense(width, BRANCH) for width in widths)
        self.fused = nn.Sequential(dense(2 * BRANCH[-1], FUSED), nn.Linear(FUSED[-1], attributes))

    def forward(self, touch: Tensor, sight: Tensor) -> Tensor:
        """Return attributes (batch, attributes) of touch and sight, (batch, features) each."""
        result: Tensor = self.fused(torch.cat([self.touch(touch), self.sight(sight)], dim=1))
        return result


class Cnn(nn.Module):
    """Convolutions along a row of features, dense layers, and one unit per attribute."""

    def __init__(
        self, widths: Sequence[int], attributes: int, filters: Sequence[int], kernel: int, hidden: Sequence[int]
    ) -> None:
        super().__init__()
        self.along = convolutions(filters, kernel)
        flat = filters[-1] * pooled(widths[0], len(filters))
        self.head = nn.Sequential(nn.Dropout(DROPOUT), dense(flat, hidden), nn.Linear(hidden[-1], attributes))

    def forward(self, rows: Tensor) -> Tensor:
        """Return attributes (batch, attributes) of rows (batch, features)."""
        result: Tensor = self.head(self.along(rows[:, None]).flatten(1))
        return result


class CnnLstm(nn.Module):
    """Convolutions along each segment's row, an LSTM over successive segments, and dense layers on its last state."""

    def __init__(self, widths: Sequence[int], attributes: int) -> None:
        super().__init__()
        self.along = convolutions(TACTILE, 5)
        self.segment = dense(TACTILE[-1] * pooled(widths[0], len(TACTILE)), (SEGMENT,))
        self.lstm = nn.LSTM(SEGMENT, LSTM, batch_first=True)
        self.head = nn.Sequential(
            nn.Dropout(DROPOUT), dense(LSTM, TACTILE_DENSE), nn.Linear(TACTILE_DENSE[-1], attributes)
        )

    def forward(self, rows: Tensor) -> Tensor:
        """Return attributes (batch, attributes) of segments (batch, segments, features)."""
        segments = self.segment(self.along(rows.flatten(0, 1)[:, None]).flatten(1))
        _, (last, _) = self.lstm(segments.unflatten(0, rows.shape[:2]))
        result: Tensor = self.head(last[0])
        return result


def dense(width: int, sizes: Sequence[int]) -> nn.Sequential:
    """Return dense layers of these sizes, each with ReLU."""
    layers = ((nn.Linear(inputs, outputs), nn.ReLU()) for inputs, outputs in pairwise((width, *sizes)))
    return nn.Sequential(*(layer for pair in layers for layer in pair))


def convolutions(filters: Sequence[int], kernel: int) -> nn.Sequential:
    """Return convolutions that keep the length of the row, each with ReLU and a pooling that rounds the length up."""
    layers = (
        (
            nn.Conv1d(inputs, outputs, kernel, padding=kernel // 2),
            nn.BatchNorm1d(outputs),
            nn.ReLU(),
            nn.MaxPool1d(POOL, ceil_mode=True),
        )
        for inputs, outputs in pairwise((1, *filters))
    )
    return nn.Sequential(*(layer for block in layers for layer in block))


def pooled(length: int, times: int) -> int:
    """Return the length of a row after `times` poolings."""
    for _ in range(times):
        length = -(-length // POOL)
    return length


NETWORKS: Mapping[str, Callable[[Sequence[int], int], nn.Module]] = {
    "ann": Ann,
    "vision_cnn": lambda widths, attributes: Cnn(widths, attributes, VISION, 5, VISION_DENSE),
    "haptic_cnn": lambda widths, attributes: Cnn(widths, attributes, HAPTIC, 3, HAPTIC_DENSE),
    "tactile_cnn_lstm": CnnLstm,
}


@dataclass(frozen=True)
class FittedRows:
    """A trained baseline network with its standardisation of features, scale of ratings, and training."""

    plan: RowPlan
    network: nn.Module
    looks: tuple[Look, ...]
    target: Target
    trained: Trained | None = None

    def predict(self, texture: Texture) -> Array:
        """Return predictions (n, attributes) on 0..100, a row for each of `examples`: a picture, a segment, a run of
        segments, or a pair of picture and segment. Raises MaterialError for features that it was not fitted to."""
        stacks = stacks_of([texture], self.looks)
        places, starts = examples(stacks, self.plan.steps)
        with training_state(0, 1), torch.no_grad():
            self.network.eval()
            parts = zip(torch.split(places, AT_ONCE), torch.split(starts, AT_ONCE), strict=True)
            answered = [
                answer_of(self.network, tuple(stack.at(*part, self.plan.steps) for stack in stacks)) for part in parts
            ]
        answers = self.target.up(torch.cat(answered).numpy().astype(np.float64))
        if not np.isfinite(answers).all():
            raise MaterialError(
                f"{texture.id}: the network's answer is not finite: its features are far beyond what it learned from."
            )
        return answers

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Return arrays and plain values, for `restore_rows`."""
        arrays = arrays_of(self.network, self.looks, self.target)
        return arrays, {"method": self.plan.name, "looks": looks_metadata(self.looks)}


def fit_rows(learning: Learning, plan: RowPlan) -> FittedRows:
    """Train the plan's network to predict textures' ratings, with equally many rows of each texture.

    The loss is the mean square error, in SDs of the ratings. Raises MaterialError for textures that cannot be learned
    from, TrainingError for a loss that is not finite.
    """
    textures, ratings = textures_of(learning)
    kinds: dict[Modality, tuple[str, ...]] = {"touch": learning.touch, "sight": learning.sight}
    looks = tuple(look_of(textures, modality, kinds[modality]) for modality in plan.sees)
    target = target_of(textures)
    chosen = learning.training_settings(plan.settings, QUICK_EPOCHS)
    network = seeded(lambda: _network(plan, looks, ratings.shape[1]), chosen.seed)
    data = random_rows(stacks_of(textures, looks, variants=True), target.down(ratings), plan.shows, plan.steps)
    held = None
    if learning.held:
        held = all_rows(stacks_of(learning.held, looks), target.down(ratings_of(learning.held)), plan.steps)
    trained = train(network, data, held, functional.mse_loss, chosen, report=learning.report)
    return FittedRows(plan, network, looks, target, trained)


def restore_rows(plan: RowPlan, arrays: Mapping[str, NDArray[Any]], metadata: Mapping[str, Any]) -> FittedRows:
    """Return the fitted network from the values of `FittedRows.saved`. Raises MaterialError for another method's."""
    if metadata["method"] != plan.name:
        raise MaterialError(f"a model of {metadata['method']!r} was given to {plan.name!r}.")
    looks, target = looks_in(arrays, metadata["looks"]), target_in(arrays)
    network = seeded(lambda: _network(plan, looks, len(target.mean)), 0)
    load_into(network, arrays)
    return FittedRows(plan, network.eval(), looks, target)


def stacks_of(textures: Sequence[Texture], looks: Sequence[Look], variants: bool = False) -> tuple[Stack, ...]:
    """Return all textures' standardised rows, a stack for each modality; with `variants` pictures' variants too."""
    return tuple(stack_of([_rows(texture, look, variants) for texture in textures]) for look in looks)


def _rows(texture: Texture, look: Look, variants: bool) -> Tensor:
    own = look.rows(texture)
    if not variants or look.modality != "sight" or not all(kind in texture.variants for kind in look.kinds):
        return own
    further = np.concatenate([texture.variants[kind] for kind in look.kinds], axis=1)
    return torch.cat([own, look.down(further, texture.id)])


def _network(plan: RowPlan, looks: Sequence[Look], attributes: int) -> nn.Module:
    return NETWORKS[plan.name]([len(look.mean) for look in looks], attributes)


@dataclass(frozen=True)
class Stack:
    """The rows of all textures, (rows, features); each texture's first row and number of rows, (textures,) each."""

    rows: Tensor
    first: Tensor
    count: Tensor

    def at(self, places: Tensor, starts: Tensor, steps: int) -> Tensor:
        """Return rows (n, features) of textures at `places` from `starts`, (n,) each; for `steps` > 1 successive rows
        (n, steps, features). The rows of a texture are repeated where it has fewer."""
        offsets = starts[:, None] + torch.arange(steps)
        rows = self.rows[self.first[places, None] + offsets % self.count[places, None]]
        return rows if steps > 1 else rows[:, 0]


def stack_of(textures: Sequence[Tensor]) -> Stack:
    """Return the stack of textures' rows, (rows, features) each."""
    count = torch.tensor([len(texture) for texture in textures])
    return Stack(torch.cat(list(textures)), count.cumsum(0) - count, count)


def random_rows(stacks: Sequence[Stack], targets: Tensor, shows: int, steps: int) -> GeneratedRows:
    """Return `shows` random rows of each texture per epoch, drawn independently for each stack."""
    textures = len(targets)

    def make(rows: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        places = rows % textures
        inputs = tuple(stack.at(places, _random_starts(stack, places, steps, chance), steps) for stack in stacks)
        return inputs, targets[places]

    return GeneratedRows(textures * shows, make, f"{_digest(stacks, targets)} drawn {shows} x {steps}")


def _random_starts(stack: Stack, places: Tensor, steps: int, chance: torch.Generator) -> Tensor:
    """Return a random first row in each texture, (n,), so that `steps` rows follow where there are enough."""
    share = torch.rand(len(places), generator=chance, dtype=torch.float64)
    return (share * (stack.count[places] - steps + 1).clamp(min=1)).long()


def examples(stacks: Sequence[Stack], steps: int) -> tuple[Tensor, Tensor]:
    """Return the texture and the first row, (n,) each, of all rows, or of all runs of `steps` that do not overlap.

    The rows of the shorter of two stacks are repeated.
    """
    most = torch.stack([(stack.count // steps).clamp(min=1) for stack in stacks]).amax(dim=0)
    places = torch.repeat_interleave(torch.arange(len(most)), most)
    starts = torch.cat([torch.arange(int(number)) * steps for number in most])
    return places, starts


def all_rows(stacks: Sequence[Stack], targets: Tensor, steps: int) -> GeneratedRows:
    """Return all `examples` of all textures, for the held-out loss."""
    places, starts = examples(stacks, steps)

    def make(rows: Tensor, _chance: torch.Generator) -> tuple[Given, Given]:
        return tuple(stack.at(places[rows], starts[rows], steps) for stack in stacks), targets[places[rows]]

    return GeneratedRows(len(places), make, f"{_digest(stacks, targets)} all by {steps}")


def _digest(stacks: Sequence[Stack], targets: Tensor) -> str:
    return digest_of(iter([*(tensor for stack in stacks for tensor in (stack.rows, stack.count)), targets]))
