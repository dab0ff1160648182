"""Figures of training FoTEN: the straightforward way against Palpate's, each with one thread and by CPU time.

All learn from the same windows of one simulated texture. A row has the CPU seconds of an epoch beside the validation
MAE (in SDs of the acceleration) after it, and the MAE after the CPU time of the straightforward way's epochs.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch

from benchmarks.precomputed import precomputed_case
from benchmarks.synthesis.stock_foten import DELTA, train_plainly
from palpate.modeling.textures.fitting import TrainingWindows, answers, rows_of
from palpate.modeling.textures.foten import SETTINGS
from palpate.modeling.textures.foten_network import WINDOW, Foten, huber
from palpate.modeling.textures.methods import Learning
from palpate.modeling.textures.recording import Recording
from palpate.modeling.textures.simulated import captured
from palpate.modeling.textures.simulator import TextureSimulator
from palpate.modeling.textures.splitting import split
from palpate.modeling.training.loop import Optimise, adam, train
from palpate.modeling.training.optimisers import cosine
from palpate.modeling.training.seeding import seeded, training_state
from palpate.modeling.training.settings import Settings
from palpate.protocols.bench import Case
from palpate.protocols.progress import Clock

AREA = "training textures"
TEXTURE = "textured_rubber"
SECONDS, QUICK_SECONDS = 20.0, 3.0
EPOCHS, QUICK_EPOCHS = 3, 1
"""Epochs of the straightforward way; all get the time that these take."""
ONE_EPOCH = "validation MAE after one epoch, SDs; CPU s of one epoch"
EQUAL_TIME = "validation MAE after equal CPU time, SDs; CPU s of all epochs"


@dataclass(frozen=True)
class Way:
    """A way of training: its batch size, whether it uses Palpate's layers, and its learning rates."""

    name: str
    batch: int
    stock: bool = False
    falling: bool = False
    rate: float = SETTINGS.learning_rate


WAYS = (
    Way("stock modules, DataLoader, batch 16", 16, stock=True),
    Way("palpate, batch 16", 16),
    Way("palpate, batch 128", 128),
    Way("palpate, batch 128, rate along a cosine", 128, falling=True, rate=2e-3),
)


@dataclass(frozen=True)
class Outcome:
    """The outcome of a way of training: epochs, their total CPU seconds, and the validation MAE."""

    epochs: int
    seconds: float
    mae: float


def cases(
    quick: bool, simulator: TextureSimulator, recording: Recording | None = None, clock: Clock = time.process_time
) -> Iterator[Case]:
    """Yield every figure of this area; `quick` learns from 3 s of texture, and compares after one epoch."""
    recorded = recording or captured(simulator, TEXTURE, QUICK_SECONDS if quick else SECONDS)
    rows = rows_of(Learning(recorded, split(recorded)), WINDOW)
    input_name = f"{len(rows.train)} windows of {WINDOW}, one thread"
    one = {way.name: train_one_way(way, rows, 1, clock) for way in WAYS}
    budget = (QUICK_EPOCHS if quick else EPOCHS) * one[WAYS[0].name].seconds
    for way in WAYS:
        yield _case("one epoch", way, input_name, len(rows.train), ONE_EPOCH, one[way.name])
    for way in WAYS:
        epochs = max(1, math.floor(budget / one[way.name].seconds + 0.5))
        outcome = train_one_way(way, rows, epochs, clock)
        yield _case("equal CPU time", way, input_name, len(rows.train), EQUAL_TIME, outcome)


def train_one_way(way: Way, rows: TrainingWindows, epochs: int, clock: Clock, seed: int = 0) -> Outcome:
    """Train in one way for `epochs` epochs, with validation after each."""
    if way.stock:
        with training_state(seed, 1):
            course = train_plainly(rows.train, rows.held, WINDOW, epochs, seed, clock)
        return Outcome(epochs, course.seconds[-1], course.mae[-1])
    steps = epochs * math.ceil(len(rows.train) / way.batch)
    optimiser: Optimise = cosine(steps) if way.falling else adam
    how = Settings(epochs=epochs, batch=way.batch, learning_rate=way.rate, plateau_patience=None, seed=seed)
    network = seeded(lambda: Foten(WINDOW), seed)
    began = clock()
    train(network, rows.train, rows.held, huber(DELTA), how, optimiser=optimiser)
    seconds = clock() - began
    return Outcome(epochs, seconds, _mae(network, rows))


def _mae(network: Foten, rows: TrainingWindows) -> float:
    predicted = answers(network, torch.as_tensor(rows.held.inputs).numpy())
    return float(np.abs(predicted - torch.as_tensor(rows.held.targets).numpy()).mean())


def _case(what: str, way: Way, input_name: str, n: int, kind: str, outcome: Outcome) -> Case:
    case = f"training FoTEN, {what}"
    name = way.name if outcome.epochs == 1 else f"{way.name}, {outcome.epochs} epochs"
    return precomputed_case(AREA, case, name, input_name, n, kind, outcome.mae, outcome.seconds)
