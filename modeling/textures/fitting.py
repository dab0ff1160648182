"""Networks that predict the next acceleration from a window: their rows, their training, their predictions.

A network's input is (batch, 3, window), normalised by the training part; its output is the mean, (batch, 1), or mean
and log SD, (batch, 2).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.random import PCG64, Generator, SeedSequence
from torch import Tensor, nn

from palpate.modeling.files.model_files import Exported
from palpate.modeling.textures.methods import Learning
from palpate.modeling.textures.recording import Scale, TextureDataError
from palpate.modeling.textures.windows import scale_of, windows
from palpate.modeling.training.loop import Optimise, Trained, adam
from palpate.modeling.training.loop import train as train_network
from palpate.modeling.training.optimisers import cosine
from palpate.modeling.training.seeding import seeded
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import GeneratedRows, Given, Pairs, Source, pairs
from palpate.modeling.training.steps import Loss, answers_of
from palpate.signals.arrays import Array

AT_ONCE = 512
"""Windows per batch of a prediction."""
QUICK_EPOCHS, QUICK_BATCH = 2, 128
SAMPLES = 14_000
"""The length of the training part of 20 s (thesis 4.3.3), for which a method's epochs are set."""
MOST_TIMES = 10.0
"""The most that epochs are multiplied by for a short recording."""
LEVEL = 0.006
"""The SD of the acceleration after rest, in SDs of the acceleration: -44 dB.

A smaller one would outweigh all other rows.
"""
_REST = 71
"""Distinguishes this use of a seed from the trainer's own."""
Make = Callable[[int], nn.Module]
"""A function from the window's length to a network with initial weights."""


@dataclass(frozen=True)
class TrainingWindows:
    """Normalised windows (n, 3, window) to train on and to validate with, the next acceleration (n, 1), the scale."""

    train: Pairs
    held: Pairs
    scale: Scale


@dataclass(frozen=True)
class Augmentation:
    """Changes of the rows during training, and the schedule of the learning rate.

    `noise` is the SD of white noise on the past acceleration, in its SDs (Bishop 1995). `hand` is the SD, in theirs, of
    offsets of a whole window's speed and force, which would otherwise identify a moment of the recording. `mirrored`
    changes the sign of the acceleration of a random half of the rows, since the sign only depends on how a sensor was
    mounted. `rest` is the share of rows at rest that are added to the training and validation rows: no speed, no force,
    followed by silence. With `cosine` the rate falls along a cosine over all epochs, otherwise as in the settings.
    """

    noise: float = 0.0
    hand: float = 0.0
    mirrored: bool = False
    rest: float = 0.0
    cosine: bool = False


@dataclass(frozen=True)
class FittedWindows:
    """A trained network with the scale of its inputs and outputs."""

    network: nn.Module
    scale: Scale
    window: int
    trained: Trained
    missed: tuple[str, ...] = ()

    def predict(self, given: Array) -> Array:
        """Return the mean of the next acceleration (n,) in m/s^2 for windows (n, 3, window) in units.

        Raises TextureDataError for another shape and for inputs or outputs that are not finite.
        """
        answer = answers(self.network, self.scale.down(checked(given, self.window)))
        mean: Array = answer[:, 0] * self.scale.sd[0] + self.scale.mean[0]
        return mean

    def exported(self) -> Exported:
        """Return the network as steps from a texture window to one number (mean), or two (mean, log SD)."""
        from palpate.modeling.textures.exporting import exported_windows

        return exported_windows(self.network, self.scale, self.window)


def fit_windows(
    make: Make,
    learning: Learning,
    loss: Loss,
    settings: Settings,
    *,
    window: int,
    augmentation: Augmentation = Augmentation(),
    optimiser: Optimise | None = None,
) -> FittedWindows:
    """Train the network that `make` returns on a recording's training part, stopped early by its validation part.

    `window` and `settings` are the method's own; those of `learning` override them. The optimiser is Adam, with
    `Augmentation.cosine` with a rate that falls along a cosine over all epochs. Raises TextureDataError for a recording
    that nothing can be learned from, TrainingError for a training that fails.
    """
    length = learning.window or window
    chosen = settings_for(learning, settings)
    rows = rows_of(learning, length)
    network = seeded(lambda: make(length), chosen.seed)
    held = add_rest(rows.held, augmentation.rest, rows.scale, chosen.seed + 1)
    data = augmented(rows, augmentation, chosen.seed)
    steps = chosen.epochs * math.ceil(len(data) / chosen.batch)
    how = optimiser or (cosine(steps) if augmentation.cosine else adam)
    trained = train_network(network, data, held, loss, chosen, optimiser=how, report=learning.report)
    return FittedWindows(network, rows.scale, length, trained)


def rows_of(learning: Learning, window: int) -> TrainingWindows:
    """Return the rows of a recording's training and validation part.

    Raises TextureDataError where either has no window of that length, and where the acceleration of the training part
    does not vary.
    """
    scale = scale_of(learning.recording, learning.parts)
    train_part = windows(learning.recording, learning.parts.train, window)
    held_part = windows(learning.recording, learning.parts.validation, window)
    if not np.ptp(train_part.target) > 0:
        raise TextureDataError(f"{learning.recording.texture}: its acceleration does not vary: nothing to learn from.")
    train, held = (
        pairs(scale.down(part.given), ((part.target - scale.mean[0]) / scale.sd[0])[:, None])
        for part in (train_part, held_part)
    )
    return TrainingWindows(train, held, scale)


def augmented(rows: TrainingWindows, augmentation: Augmentation, seed: int) -> Source:
    """Return the training rows with rows at rest; noise, offsets and signs are drawn anew for every batch."""
    whole = add_rest(rows.train, augmentation.rest, rows.scale, seed)
    if not (augmentation.noise or augmentation.hand or augmentation.mirrored):
        return whole

    def make(chosen: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        given, expected = whole.batch(chosen, chance)
        inputs, targets = torch.as_tensor(given).clone(), torch.as_tensor(expected)
        if augmentation.noise:
            inputs[:, 0] += augmentation.noise * torch.randn(inputs[:, 0].shape, generator=chance)
        if augmentation.hand:
            inputs[:, 1:] += augmentation.hand * torch.randn((len(inputs), 2, 1), generator=chance)
        if augmentation.mirrored:
            sign = torch.randint(0, 2, (len(inputs), 1), generator=chance, dtype=inputs.dtype).mul_(2).sub_(1)
            inputs[:, 0] *= sign
            targets = targets * sign
        return inputs, targets

    return GeneratedRows(len(whole), make, f"{whole.digest} by {augmentation!r}")


def settings_for(learning: Learning, default: Settings) -> Settings:
    """Return a method's settings, overridden by the caller's; `quick` trains few epochs with large batches.

    Raises TrainingError for a value out of range.
    """
    if learning.settings.get("quick"):
        default = replace(default, batch=max(default.batch, QUICK_BATCH))
    return learning.training_settings(default, QUICK_EPOCHS)


def checked(given: Array, window: int) -> Array:
    """Return windows (n, 3, window) unchanged. Raises TextureDataError for another shape, or for numbers not finite."""
    if given.ndim != 3 or given.shape[1:] != (3, window):
        raise TextureDataError(f"windows of shape {given.shape}: (n, 3, {window}) is expected.")
    if not np.isfinite(given).all():
        raise TextureDataError("a window holds a number that is not finite: correct the recording, or leave it out.")
    return given


def answers(network: nn.Module, given: Array) -> Array:
    """Return a network's float64 outputs (n, k) for normalised windows (n, 3, window), without dropout.

    Raises TextureDataError where an output is not finite, as for values that 32 bits cannot hold.
    """
    result = answers_of(network, given, AT_ONCE)
    if not np.isfinite(result).all():
        raise TextureDataError("the network's answer is not finite: it was given what is far beyond what it learned.")
    return result


def for_length(settings: Settings, learning: Learning) -> Settings:
    """Return the settings with more epochs and patience for a training part below 20 s."""
    samples = sum(stop - start for start, stop in learning.parts.train)
    times = min(MOST_TIMES, max(1.0, SAMPLES / max(1, samples)))
    patience = {
        name: round(times * value)
        for name in ("plateau_patience", "stop_patience")
        if (value := getattr(settings, name)) is not None
    }
    return replace(settings, epochs=round(times * settings.epochs), **patience)


def add_rest(rows: Pairs, share: float, scale: Scale, seed: int) -> Pairs:
    """Return the rows with `share` times as many rows at rest added, drawn by the seed.

    Their past acceleration is that of other rows, scaled to a random level down to silence: a model that runs on its
    own output passes through all of these levels while it decays.
    """
    count = round(share * len(rows))
    if not count:
        return rows
    chance = Generator(PCG64(SeedSequence([seed, _REST])))
    inputs, targets = torch.as_tensor(rows.inputs), torch.as_tensor(rows.targets)
    resting = inputs[torch.from_numpy(chance.integers(0, len(rows), count))].clone()
    still = -scale.mean / scale.sd
    fade = chance.uniform(0, 1, (count, 1)) ** 3
    resting[:, 0] = _float32(still[0]) + _float32(fade) * (resting[:, 0] - _float32(still[0]))
    resting[:, 1:] = _float32(still[1:, None])
    silence = _float32(still[0] + LEVEL * chance.standard_normal((count, 1)))
    return Pairs(torch.cat([inputs, resting]), torch.cat([targets, silence]))


def _float32(values: object) -> Tensor:
    return torch.from_numpy(np.asarray(values, dtype=np.float32))


def shaped(x: Tensor, *sides: int) -> Tensor:
    """Return (batch, *sides) unchanged. Raises TextureDataError for another shape."""
    if x.shape[1:] != sides:
        expected = ", ".join(map(str, ("batch", *sides)))
        raise TextureDataError(f"a network came to shape {tuple(x.shape)}: ({expected}) is expected.")
    return x
