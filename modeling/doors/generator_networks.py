"""The two small networks of the generator: the student rates a code, the generator turns a wish into a code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from palpate.modeling.doors.data import TOP
from palpate.modeling.training.loop import train
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import GeneratedRows, Given, digest_of, pairs
from palpate.signals.arrays import Array

MIDDLE, SPREAD = TOP / 2, TOP / 5
"""Scaling of the student's ratings, in units of SPREAD around MIDDLE: about mean 0 and SD 1."""
STUDENT_HUBER = 3.0
"""Points of 100 beyond which the student's errors count linearly, so that single odd doors do not dominate."""
WISH_HUBER = 5.0
"""The same for the generator's errors, since most wishes of the whole range are not attainable."""
JITTER = 6.0
"""SD of the noise on ratings of measured profiles, in points of 100."""
Felt = tuple[Tensor, Tensor, Tensor]


@dataclass(frozen=True)
class Size:
    """The sizes of the networks, and the lengths of their trainings."""

    student: int = 128
    generator: int = 64
    student_epochs: int = 50
    generator_epochs: int = 40
    wishes: int = 8192
    batch: int = 256
    learning_rate: float = 3e-3


@dataclass(frozen=True)
class TrainingOptions:
    """Seed, threads, checkpoint and progress report of a generator's training."""

    seed: int
    threads: int = 1
    checkpoint: Path | None = None
    report: Callable[[str], None] = lambda _line: None

    def settings(self, stage: str, number: int, epochs: int, size: Size) -> Settings:
        """Return the settings of one stage of a round, with its own seed and checkpoint."""
        folder = None if self.checkpoint is None else self.checkpoint / f"{stage}-{number}"
        return Settings(
            epochs=epochs, batch=size.batch, learning_rate=size.learning_rate, plateau_patience=3, plateau_factor=0.5,
            seed=self.stage_seed(stage, number), threads=self.threads, checkpoint=folder, every_epochs=10,
        )  # fmt: skip

    def stage_seed(self, stage: str, number: int) -> int:
        """Return the seed of one stage of a round."""
        return int(np.random.SeedSequence([self.seed, number, *stage.encode()]).generate_state(1)[0])


@dataclass(frozen=True)
class Layers:
    """A generator as arrays: (weight, bias) of each layer, each followed by tanh; the code is `span` times that."""

    numbers: tuple[tuple[Array, Array], ...]
    span: float

    def code(self, wish: Array) -> Array:
        """Return codes (n, components) of wishes (n, attributes), which are clipped to 0..100."""
        x = np.clip(wish, 0, TOP) / MIDDLE - 1
        for weight, bias in self.numbers:
            x = np.tanh(x @ weight.T + bias)
        return self.span * x


class Generator(nn.Module):
    """A smooth network from wishes (n, attributes) on 0..100 to codes (n, components) within +-`span`."""

    def __init__(self, attributes: int, components: int, width: int, span: float) -> None:
        super().__init__()
        sizes = (attributes, width, width, components)
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(sizes))
        self.span = span

    def forward(self, wish: Tensor) -> Tensor:
        """Return codes (n, components) of wishes (n, attributes)."""
        x = wish / MIDDLE - 1
        for layer in self.layers:
            x = torch.tanh(layer(x))
        return self.span * x

    def numbers(self) -> Layers:
        """Return the generator as arrays, without torch."""
        weights = [array.detach().double().numpy().copy() for array in self.parameters()]
        return Layers(tuple(zip(weights[::2], weights[1::2], strict=True)), self.span)


class InLoop(nn.Module):
    """A generator followed by a student whose weights are fixed."""

    def __init__(self, generator: Generator, student: nn.Sequential) -> None:
        super().__init__()
        self.generator = generator
        self.student = student

    def forward(self, wish: Tensor) -> Felt:
        """Return ratings (n, attributes), the profiles' foreignness (n,), and codes (n, components) for wishes."""
        code = self.generator(wish)
        ratings = self.student(code)
        return ratings[:, :-1] * SPREAD + MIDDLE, ratings[:, -1], code


def student_network(components: int, attributes: int, width: int) -> nn.Sequential:
    """Return a network from codes to ratings and foreignness, which replaces a teacher without gradient."""
    sizes = (components, width, width)
    hidden = [part for a, b in pairwise(sizes) for part in (nn.Linear(a, b), nn.SiLU())]
    return nn.Sequential(*hidden, nn.Linear(width, attributes + 1))


def train_student(student: nn.Sequential, code: Array, ratings: Array, settings: Settings) -> float:
    """Train the student on a teacher's ratings of codes (n, components); return the loss of its best epoch."""
    student.requires_grad_(True)
    target = np.c_[(ratings[:, :-1] - MIDDLE) / SPREAD, ratings[:, -1]]
    return train(student, pairs(code, target), None, nn.HuberLoss(delta=STUDENT_HUBER / SPREAD), settings).best_loss


def train_generator(
    generator: Generator, student: nn.Sequential, attained: Array, weights: tuple[float, float], size: Size,
    settings: Settings,
) -> float:  # fmt: skip
    """Train the generator so that the student rates its codes as wished; return the loss of its best epoch.

    `attained` (n, attributes) are ratings of measured profiles. `weights` are the penalties, in points of 100, of a
    code one SD from the mean of the plausible ones (squared), and of a profile that is 1 more foreign than usual.
    """
    student.requires_grad_(False)
    known = _known(attained)
    wishes = GeneratedRows(
        size.wishes, lambda rows, chance: _wishes(known, len(rows), chance), digest_of(iter([known]))
    )
    missed = nn.HuberLoss(delta=WISH_HUBER)

    def loss(answer: Felt, wish: Tensor) -> Tensor:
        felt, foreign, code = answer
        price = weights[0] * code.square().mean() + weights[1] * torch.relu(foreign - 1).mean()
        result: Tensor = missed(felt, wish) / WISH_HUBER + price
        return result

    return train(InLoop(generator, student), wishes, None, loss, settings).best_loss


def random_wishes(attained: Array, count: int, seed: int) -> Array:
    """Return random wishes (count, attributes) as `train_generator` draws them."""
    wishes, _ = _wishes(_known(attained), count, torch.Generator().manual_seed(seed))
    return np.asarray(wishes, dtype=np.float64)


def _known(attained: Array) -> Tensor:
    return torch.from_numpy(np.clip(attained, 0, TOP).astype(np.float32))


def _wishes(known: Tensor, count: int, chance: torch.Generator) -> tuple[Given, Given]:
    """Return random wishes: half near those of measured profiles, half anywhere, 30 % of these with sliders at ends."""

    def random(columns: int) -> Tensor:
        return torch.rand((count, columns), generator=chance)

    columns = known.shape[1]
    first, second = torch.randint(len(known), (2, count), generator=chance)
    share = random(1)
    spread = JITTER * torch.randn((count, columns), generator=chance)
    near = known[first] * share + known[second] * (1 - share) + spread
    ends = (random(columns) < 0.5).float() * TOP
    far = torch.where((random(columns) < 0.5) & (random(1) < 0.3), ends, random(columns) * TOP)
    wish = torch.where(random(1) < 0.5, near, far).clamp(0, TOP)
    return wish, wish
