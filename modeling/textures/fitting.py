"""Networks that look at a window and answer the next acceleration: their rows, their training, their answers.

A network takes (batch, 3, window) normalised by the training part and answers (batch, 1): the mean; or (batch, 2): mean
and log SD.
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
"""Windows that a network answers at a time."""
QUICK_EPOCHS, QUICK_BATCH = 2, 128
SAMPLES = 14_000
"""The training part of 20 s (thesis 4.3.3), for which a method's epochs are meant."""
MOST_TIMES = 10.0
"""Times as many epochs at most."""
LEVEL = 0.006
"""The SD of what follows at rest, in SDs of the acceleration: -44 dB. Less would outweigh all other rows."""
_REST = 71
"""Tells this use of a seed from the trainer's own."""
Make = Callable[[int], nn.Module]
"""The window's length to a network with fresh weights."""


@dataclass(frozen=True)
class Rows:
    """Normalised windows (n, 3, window) to train on and to watch, with the next acceleration (n, 1), and the scale."""

    train: Pairs
    held: Pairs
    scale: Scale


@dataclass(frozen=True)
class Diet:
    """What is done to the rows while training, and how the rate falls.

    `noise` is the SD of white noise on the past acceleration, in its SDs (Bishop 1995); `hand` that of what is added to
    a whole window's speed, and to its force, in theirs: within a recording they tell the moment, which is not to be
    learned by heart; `mirrored`: half of the rows, others every time, have the sign of their acceleration turned, since
    it only tells how a sensor was mounted; `rest` is the share of rows at rest, added to the training and validation
    rows: no speed, no force, and silence to follow. `cosine`: the rate falls along a cosine over all epochs; by itself
    it stays as it is, or is lowered as the settings say.
    """

    noise: float = 0.0
    hand: float = 0.0
    mirrored: bool = False
    rest: float = 0.0
    cosine: bool = False


@dataclass(frozen=True)
class FittedWindows:
    """A trained network and the scale that it sees the world by."""

    network: nn.Module
    scale: Scale
    window: int
    trained: Trained
    missed: tuple[str, ...] = ()

    def predict(self, given: Array) -> Array:
        """Return the mean of the next acceleration (n,) in m/s^2 for windows (n, 3, window) in units.

        Raises TextureDataError for another shape and for numbers that are not finite, given or answered.
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
    diet: Diet = Diet(),
    optimiser: Optimise | None = None,
) -> FittedWindows:
    """Train what `make` makes on the training part of a recording, stopped early by its validation part.

    `window` is the method's own; `Learning.window` goes before it, and its settings before `settings`.
    The optimiser is Adam; where `Diet.cosine` says so, its rate falls along a cosine over all epochs.
    Raises TextureDataError for a recording that nothing can be learned from, TrainingError for a training that fails.
    """
    length = learning.window or window
    chosen = settings_for(learning, settings)
    rows = rows_of(learning, length)
    network = seeded(lambda: make(length), chosen.seed)
    held = with_rest(rows.held, diet.rest, rows.scale, chosen.seed + 1)
    data = fed(rows, diet, chosen.seed)
    steps = chosen.epochs * math.ceil(len(data) / chosen.batch)
    how = optimiser or (cosine(steps) if diet.cosine else adam)
    trained = train_network(network, data, held, loss, chosen, optimiser=how, report=learning.report)
    return FittedWindows(network, rows.scale, length, trained)


def rows_of(learning: Learning, window: int) -> Rows:
    """Return the rows of a recording's training and validation part.

    Raises TextureDataError where either has no window of that length, and where the acceleration of the training part
    does not vary.
    """
    scale = scale_of(learning.recording, learning.parts)
    train_part = windows(learning.recording, learning.parts.train, window)
    held_part = windows(learning.recording, learning.parts.validation, window)
    if not np.ptp(train_part.wanted) > 0:
        raise TextureDataError(f"{learning.recording.texture}: its acceleration does not vary: nothing to learn from.")
    train, held = (
        pairs(scale.down(part.given), ((part.wanted - scale.mean[0]) / scale.sd[0])[:, None])
        for part in (train_part, held_part)
    )
    return Rows(train, held, scale)


def fed(rows: Rows, diet: Diet, seed: int) -> Source:
    """The training rows with rest among them; noise, moves and signs are drawn afresh every time that they are seen."""
    whole = with_rest(rows.train, diet.rest, rows.scale, seed)
    if not (diet.noise or diet.hand or diet.mirrored):
        return whole

    def make(chosen: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        given, wanted = whole.batch(chosen, chance)
        inputs, targets = torch.as_tensor(given).clone(), torch.as_tensor(wanted)
        if diet.noise:
            inputs[:, 0] += diet.noise * torch.randn(inputs[:, 0].shape, generator=chance)
        if diet.hand:
            inputs[:, 1:] += diet.hand * torch.randn((len(inputs), 2, 1), generator=chance)
        if diet.mirrored:
            sign = torch.randint(0, 2, (len(inputs), 1), generator=chance, dtype=inputs.dtype).mul_(2).sub_(1)
            inputs[:, 0] *= sign
            targets = targets * sign
        return inputs, targets

    return GeneratedRows(len(whole), make, f"{whole.digest} by {diet!r}")


def settings_for(learning: Learning, default: Settings) -> Settings:
    """A method's settings with the caller's wishes over them; `quick` trains for few epochs, many rows at a time, where
    nothing else is asked for.

    Raises TrainingError for a value without sense.
    """
    if learning.settings.get("quick"):
        default = replace(default, batch=max(default.batch, QUICK_BATCH))
    return learning.training_settings(default, QUICK_EPOCHS)


def checked(given: Array, window: int) -> Array:
    """Windows (n, 3, window) as they are. Raises TextureDataError where they are none, or not finite."""
    if given.ndim != 3 or given.shape[1:] != (3, window):
        raise TextureDataError(f"windows of shape {given.shape}: (n, 3, {window}) is expected.")
    if not np.isfinite(given).all():
        raise TextureDataError("a window holds a number that is not finite: correct the recording, or leave it out.")
    return given


def answers(network: nn.Module, given: Array) -> Array:
    """What a network answers to normalised windows, as float64, dropout off and on one thread: sums in one order.

    Raises TextureDataError where an answer is not finite, as for values that 32 bits cannot hold.
    """
    result = answers_of(network, given, AT_ONCE)
    if not np.isfinite(result).all():
        raise TextureDataError("the network's answer is not finite: it was given what is far beyond what it learned.")
    return result


def for_length(settings: Settings, learning: Learning) -> Settings:
    """Epochs and patience for the length of the recording's training part; at 20 s and above they are as given."""
    samples = sum(stop - start for start, stop in learning.parts.train)
    times = min(MOST_TIMES, max(1.0, SAMPLES / max(1, samples)))
    patience = {
        name: round(times * value)
        for name in ("plateau_patience", "stop_patience")
        if (value := getattr(settings, name)) is not None
    }
    return replace(settings, epochs=round(times * settings.epochs), **patience)


def with_rest(rows: Pairs, share: float, scale: Scale, seed: int) -> Pairs:
    """Return the rows, and `share` times as many more that rest; decided by the seed.

    Their past acceleration is that of rows made quieter, from as it is down to silence: a model that runs on its own
    output meets all of these while it dies away.
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
    """(batch, *sides) as it is. Raises TextureDataError for another shape."""
    if x.shape[1:] != sides:
        expected = ", ".join(map(str, ("batch", *sides)))
        raise TextureDataError(f"a network came to shape {tuple(x.shape)}: ({expected}) is expected.")
    return x
