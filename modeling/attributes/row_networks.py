"""Training a baseline network on rows of textures, and asking it about one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.attributes.baseline_networks import NETWORKS
from palpate.modeling.attributes.learnable import textures_of
from palpate.modeling.attributes.material import MaterialError, Modality, Texture, ratings_of
from palpate.modeling.attributes.methods import Learning
from palpate.modeling.attributes.network_fit import (
    Look,
    Target,
    arrays_of,
    load_into,
    look_of,
    looks_in,
    target_in,
    target_of,
    told_of,
)
from palpate.modeling.attributes.row_plans import Plan
from palpate.modeling.training.loop import Trained, train
from palpate.modeling.training.seeding import seeded, training_state
from palpate.modeling.training.sources import Given, Made, answer_of, digest_of
from palpate.signals.arrays import Array

QUICK_EPOCHS = 5
AT_ONCE = 64
"""Rows that a network answers at a time."""


@dataclass(frozen=True)
class FittedRows:
    """A trained baseline: its network, what it looks at, the scale of its answers, and how the training went."""

    plan: Plan
    network: nn.Module
    looks: tuple[Look, ...]
    target: Target
    trained: Trained | None = None

    def predict(self, texture: Texture) -> Array:
        """(n, attributes) on 0..100: a row for each picture, each segment or run of segments, or each pair of them
        where both are taken in turn. Raises MaterialError for features that it was not fitted to."""
        stacks = stacks_of([texture], self.looks)
        places, starts = examples(stacks, self.plan.steps)
        with training_state(0, 1), torch.no_grad():
            self.network.eval()
            parts = zip(torch.split(places, AT_ONCE), torch.split(starts, AT_ONCE), strict=True)
            found = [
                answer_of(self.network, tuple(each.at(*part, self.plan.steps) for each in stacks)) for part in parts
            ]
        answers = self.target.up(torch.cat(found).numpy().astype(np.float64))
        if not np.isfinite(answers).all():
            raise MaterialError(
                f"{texture.id}: the network's answer is not finite: its features are far beyond what it learned from."
            )
        return answers

    def saved(self) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Arrays and what is told of them, for `restored_rows`."""
        arrays = arrays_of(self.network, self.looks, self.target)
        return arrays, {"method": self.plan.name, "looks": told_of(self.looks)}


def fit_rows(learning: Learning, plan: Plan) -> FittedRows:
    """Train the plan's network to answer with a texture's ratings, each texture shown as often as another.

    The loss is the mean square error, in SDs of the ratings. Raises MaterialError for textures that cannot be learned
    from, TrainingError for a training that does not converge.
    """
    textures, ratings = textures_of(learning)
    kinds: dict[Modality, tuple[str, ...]] = {"touch": learning.touch, "sight": learning.sight}
    looks = tuple(look_of(textures, modality, kinds[modality]) for modality in plan.sees)
    target = target_of(textures)
    asked = learning.training_settings(plan.settings, QUICK_EPOCHS)
    network = seeded(lambda: _network(plan, looks, ratings.shape[1]), asked.seed)
    data = drawn(stacks_of(textures, looks, variants=True), target.down(ratings), plan.shows, plan.steps)
    trained = train(network, data, _watched(learning, looks, target, plan), _loss, asked, report=learning.report)
    return FittedRows(plan, network, looks, target, trained)


def restored_rows(plan: Plan, arrays: Mapping[str, NDArray[Any]], told: Mapping[str, Any]) -> FittedRows:
    """What `FittedRows.saved` gave, fitted again. Raises MaterialError where it is of another method."""
    if told["method"] != plan.name:
        raise MaterialError(f"a model of {told['method']!r} was given to {plan.name!r}.")
    looks, target = looks_in(arrays, told["looks"]), target_in(arrays)
    network = seeded(lambda: _network(plan, looks, len(target.mean)), 0)
    load_into(network, arrays)
    return FittedRows(plan, network.eval(), looks, target)


def stacks_of(textures: Sequence[Texture], looks: Sequence[Look], variants: bool = False) -> tuple[Stack, ...]:
    """All textures' standardised rows, a stack for each look; with `variants` further versions of pictures too."""
    return tuple(stack_of([_rows(each, look, variants) for each in textures]) for look in looks)


def _rows(texture: Texture, look: Look, variants: bool) -> Tensor:
    own = look.rows(texture)
    if not variants or look.modality != "sight" or not all(kind in texture.variants for kind in look.kinds):
        return own
    further = np.concatenate([texture.variants[kind] for kind in look.kinds], axis=1)
    return torch.cat([own, look.down(further, texture.id)])


def _network(plan: Plan, looks: Sequence[Look], attributes: int) -> nn.Module:
    return NETWORKS[plan.name]([len(look.mean) for look in looks], attributes)


def _watched(learning: Learning, looks: Sequence[Look], target: Target, plan: Plan) -> Made | None:
    if not learning.held:
        return None
    return everything(stacks_of(learning.held, looks), target.down(ratings_of(learning.held)), plan.steps)


def _loss(answer: Tensor, target: Tensor) -> Tensor:
    return functional.mse_loss(answer, target)


@dataclass(frozen=True)
class Stack:
    """`rows` (all, numbers) of all textures; `first` (textures,) is where each begins, `count` how many it has."""

    rows: Tensor
    first: Tensor
    count: Tensor

    def at(self, places: Tensor, starts: Tensor, steps: int) -> Tensor:
        """(n, numbers): a row of each of these textures; or (n, steps, numbers): rows that follow each other.

        A texture with fewer rows begins anew.
        """
        wanted = starts[:, None] + torch.arange(steps)
        rows = self.rows[self.first[places, None] + wanted % self.count[places, None]]
        return rows if steps > 1 else rows[:, 0]


def stack_of(textures: Sequence[Tensor]) -> Stack:
    """One after the other."""
    count = torch.tensor([len(each) for each in textures])
    return Stack(torch.cat(list(textures)), count.cumsum(0) - count, count)


def drawn(stacks: Sequence[Stack], targets: Tensor, shows: int, steps: int) -> Made:
    """`shows` rows of each texture an epoch, drawn anew each time and for each stack by itself."""
    textures = len(targets)

    def make(rows: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        places = rows % textures
        return tuple(each.at(places, _anywhere(each, places, steps, chance), steps) for each in stacks), targets[places]

    return Made(textures * shows, make, f"{_digest(stacks, targets)} drawn {shows} x {steps}")


def _anywhere(stack: Stack, places: Tensor, steps: int, chance: torch.Generator) -> Tensor:
    """Where to begin in each texture, so that the rows follow each other where there are enough."""
    share = torch.rand(len(places), generator=chance, dtype=torch.float64)
    return (share * (stack.count[places] - steps + 1).clamp(min=1)).long()


def examples(stacks: Sequence[Stack], steps: int) -> tuple[Tensor, Tensor]:
    """Each texture's rows in turn, or runs of `steps` that do not overlap: its place, and where to begin.

    Of two stacks the one with fewer rows begins anew.
    """
    most = torch.stack([(each.count // steps).clamp(min=1) for each in stacks]).amax(dim=0)
    places = torch.repeat_interleave(torch.arange(len(most)), most)
    starts = torch.cat([torch.arange(int(number)) * steps for number in most])
    return places, starts


def everything(stacks: Sequence[Stack], targets: Tensor, steps: int) -> Made:
    """All `examples` of all textures, to be watched."""
    places, starts = examples(stacks, steps)

    def make(rows: Tensor, _chance: torch.Generator) -> tuple[Given, Given]:
        return tuple(each.at(places[rows], starts[rows], steps) for each in stacks), targets[places[rows]]

    return Made(len(places), make, f"{_digest(stacks, targets)} all by {steps}")


def _digest(stacks: Sequence[Stack], targets: Tensor) -> str:
    return digest_of(iter([*(tensor for each in stacks for tensor in (each.rows, each.count)), targets]))
