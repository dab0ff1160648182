"""Rows of many textures in one tensor, and which of them a network is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from palpate.modeling.training.sources import Given, Made, digest_of


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
