"""The spectrogram GAN of Ujitoko and Ban 2018: a generator of spectrograms, played one block at a time.

From the paper: a conditional generative adversarial network whose generator makes spectrograms of the acceleration,
turned to a signal without recorded phases. From the thesis: 56 samples (table 4.3). Our choice: the condition is speed
and force (there images or names of textures; here each texture has its own network); 4 frames of 56 samples, 14 apart,
so that a block is 56 samples too; log magnitudes; small convolutions along frequency that can be computed within a step
of 1 kHz; the losses of modeling/training/adversarial.py; the weights of the epoch whose spectrograms for held-out
speeds and forces are nearest to the real ones (energy distance); each bin's mean power is adjusted to that of the
training part. The paper computes phases by iterations over the whole signal (Griffin and Lim 1984); the renderer draws
them (signals/textures/block_voice.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import torch
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.files.model_files import Exported
from palpate.modeling.textures.exporting import (
    Pieces,
    attention_block_steps,  # noqa: F401 - convolutions are registered there
    pieces,
)
from palpate.modeling.textures.fitting import for_length, settings_for, shaped
from palpate.modeling.textures.methods import Learning, Method
from palpate.modeling.textures.recording import Recording, TextureDataError
from palpate.modeling.textures.windows import Stretches, samples_of
from palpate.modeling.training.adversarial import Adversarial, Adversaries, energy_distance, two_adams
from palpate.modeling.training.loop import Trained, train
from palpate.modeling.training.seeding import seeded, training_state
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import GeneratedRows, Given, Pairs, Source, pairs
from palpate.signals.arrays import Array
from palpate.signals.models.card import Activation, Affine, Reshape, Step, Upsample
from palpate.signals.models.card_steps import Turn

SIZE, PARTS, FRAMES = 56, 4, 4
"""Samples of a frame (thesis table 4.3), hops in a frame, frames in a block."""
APART, HELD_APART = 4, 7
"""Samples between the blocks of the training part, and of the validation part."""
LEAST_BLOCKS = 8
STEP = Adversarial()
SETTINGS = Settings(epochs=60, batch=64, learning_rate=5e-4, plateau_patience=None, stop_patience=20, every_epochs=5)
_NOISE = 83
"""Distinguishes this use of a seed from the trainer's own."""
LEAST_SD = 1e-3
"""The least SD of a log magnitude, so that a bin that hardly varies is not magnified."""
FAINTEST = 1e-3
"""Magnitudes below this share of the texture's own level count as this share, since the log of silence is infinite."""
NOISE = 64
"""The number of random numbers per block: about as many as a block of 98 samples has degrees of freedom."""
WIDE, CHANNELS = 128, 32
SLOPE = 0.2
BOUND = 4.0
"""The greatest deviation of a log magnitude from its mean, in SDs."""


@dataclass(frozen=True)
class Frames:
    """The division of a signal into Hann-windowed frames of `size` samples (even), `hop` apart, `count` per block."""

    size: int
    hop: int
    count: int

    def __post_init__(self) -> None:
        if self.size < 8 or self.size % 2 or not 1 <= self.hop <= self.size // 2 or self.count < 1:
            raise TextureDataError(
                f"{self.count} frames of {self.size} samples, {self.hop} apart: an even size of at least 8, a hop of "
                "at most half of it and at least one frame are expected."
            )

    @property
    def bins(self) -> int:
        """The number of frequencies from 0 to half the rate."""
        return self.size // 2 + 1

    @property
    def span(self) -> int:
        """The number of samples that a block's frames span."""
        return self.size + (self.count - 1) * self.hop


@dataclass(frozen=True)
class Spectra:
    """Blocks: natural logs of the magnitudes (n, count, bins), and the speed and force (n, 2) at the start of each."""

    log_magnitude: Array
    drive: Array


@dataclass(frozen=True)
class SpectraScale:
    """Mean and SD (bins) of the training part's log magnitudes, mean and SD (2) of speed and force.

    Constant speed or force has SD 1.
    """

    mean: Array
    sd: Array
    hand_mean: Array
    hand_sd: Array

    def down(self, log_magnitude: Array) -> Array:
        """Standardise log magnitudes (..., bins)."""
        return (log_magnitude - self.mean) / self.sd

    def up(self, numbers: Array) -> Array:
        """Undo `down`: return log magnitudes (..., bins)."""
        return numbers * self.sd + self.mean

    def hand_down(self, drive: Array) -> Array:
        """Standardise speed and force (..., 2) in mm/s and N."""
        return (drive - self.hand_mean) / self.hand_sd


class Generator(nn.Module):
    """The generator: speed and force (batch, 2) and noise (batch, 64) to log magnitudes (batch, count, bins).

    Dense 66 -> 128 -> 32 x length, twice doubled in length, each time convolved; the last convolution has the frames
    as channels and as many places as bins.
    """

    def __init__(self, frames: Frames) -> None:
        super().__init__()
        self.frames = frames
        self.length = -(-(frames.bins + 2) // 4)
        self.first, self.second = nn.Linear(2 + NOISE, WIDE), nn.Linear(WIDE, CHANNELS * self.length)
        self.middle = nn.Conv1d(CHANNELS, CHANNELS, 3, padding=1)
        self.last = nn.Conv1d(CHANNELS, frames.count, 4 * self.length - frames.bins + 1)

    def forward(self, condition: Tensor, noise: Tensor) -> Tensor:
        """Return a spectrogram for each row."""
        given = torch.cat([shaped(condition, 2), shaped(noise, NOISE)], dim=1)
        x = leaky(self.second(leaky(self.first(given)))).view(-1, CHANNELS, self.length)
        x = leaky(self.middle(x.repeat_interleave(2, dim=2)))
        x = self.last(x.repeat_interleave(2, dim=2))
        return BOUND * torch.tanh(shaped(x, self.frames.count, self.frames.bins) / BOUND)


class Critic(nn.Module):
    """The critic: speed and force (batch, 2) and spectrogram (batch, count, bins) to a number, high for a real one."""

    def __init__(self, frames: Frames) -> None:
        super().__init__()
        self.frames = frames
        self.first = nn.Conv1d(frames.count + 2, CHANNELS, 4, stride=2, padding=1)
        self.second = nn.Conv1d(CHANNELS, 2 * CHANNELS, 4, stride=2, padding=1)
        places = frames.bins // 2 // 2
        self.third, self.last = nn.Linear(2 * CHANNELS * places, WIDE), nn.Linear(WIDE, 1)

    def forward(self, condition: Tensor, spectrogram: Tensor) -> Tensor:
        """Return a number for each row, the higher the more real the spectrogram looks for its speed and force."""
        shaped(spectrogram, self.frames.count, self.frames.bins)
        beside = condition[:, :, None].expand(-1, -1, self.frames.bins)
        x = leaky(self.second(leaky(self.first(torch.cat([spectrogram, beside], dim=1)))))
        result: Tensor = self.last(leaky(self.third(x.flatten(1))))
        return result


@dataclass(frozen=True)
class FittedGan:
    """A trained generator with the frames of its blocks and the scale of its numbers."""

    network: Adversaries
    cut: Frames
    scale: SpectraScale
    trained: Trained

    @property
    def window(self) -> int:
        """The number of samples of a frame."""
        return self.cut.size

    @property
    def hop(self) -> int:
        """The number of samples between frames."""
        return self.cut.hop

    @property
    def frames(self) -> int:
        """The number of frames in a block."""
        return self.cut.count

    @property
    def drawn(self) -> int:
        """The number of random numbers for a block, beside speed and force."""
        return NOISE

    def predict(self, given: Array) -> Array:
        """Raise TextureDataError: a GAN does not predict from the past."""
        raise TextureDataError(f"a GAN makes spectra of blocks: it does not continue windows {given.shape}.")

    def exported(self) -> Exported:
        """Return the steps from speed, force and noise (66) to log magnitudes (bins, frames) in C order."""
        return exported_generator(cast(Generator, self.network.generator), self.scale)


def fit(learning: Learning) -> FittedGan:
    """Train generator and critic on a recording's training part, watched on its validation part.

    `Learning.window` is the size of a frame (even). Raises TextureDataError for a recording without enough blocks or
    whose acceleration does not vary, TrainingError for a training that fails.
    """
    size = learning.window or SIZE
    frames = Frames(size, max(1, size // PARTS), FRAMES)
    chosen = settings_for(learning, for_length(SETTINGS, learning))
    acceleration = samples_of(learning.recording, learning.parts.train)[0]
    if not acceleration.size or not np.ptp(acceleration) > 0:
        raise TextureDataError(f"{learning.recording.texture}: its acceleration does not vary: nothing to learn from.")
    blocks = _blocks(learning, learning.parts.train, frames, APART, "training")
    held = _blocks(learning, learning.parts.validation, frames, HELD_APART, "validation")
    scale = spectra_scale(blocks)
    network = seeded(lambda: Adversaries(Generator(frames), Critic(frames)), chosen.seed)
    trained = train(
        network, training_source(blocks, scale), watched(held, scale, chosen.seed), energy_distance, chosen,
        optimiser=two_adams, train_one=STEP, report=learning.report,
    )  # fmt: skip
    return FittedGan(network, frames, match_power(network, blocks, scale, chosen.seed), trained)


def _blocks(learning: Learning, stretches: Stretches, frames: Frames, apart: int, name: str) -> Spectra:
    blocks = spectra(learning.recording, stretches, frames, apart, least_magnitude(learning, frames))
    if len(blocks.drive) < LEAST_BLOCKS:
        raise TextureDataError(
            f"{learning.recording.texture}: its {name} part has {len(blocks.drive)} blocks of {frames.span} samples; "
            f"at least {LEAST_BLOCKS} are expected: record longer, or take a shorter frame."
        )
    return blocks


def least_magnitude(learning: Learning, frames: Frames) -> float:
    """Return the least magnitude: a share of the magnitudes of white noise with the level of the training part."""
    sd = float(samples_of(learning.recording, learning.parts.train)[0].std())
    return FAINTEST * sd * float(np.sqrt(0.375 * frames.size))


def training_source(blocks: Spectra, scale: SpectraScale) -> Source:
    """Return the training rows: speed and force with new noise every time, and the real spectrogram."""
    rows = pairs(scale.hand_down(blocks.drive), scale.down(blocks.log_magnitude))

    def make(chosen: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        condition, real = rows.batch(chosen, chance)
        return (torch.as_tensor(condition), torch.randn(len(chosen), NOISE, generator=chance)), real

    return GeneratedRows(len(rows), make, f"{rows.digest} with {NOISE} numbers drawn")


def match_power(network: Adversaries, blocks: Spectra, scale: SpectraScale, seed: int) -> SpectraScale:
    """Return the scale that gives generated blocks the mean power of real ones in each bin.

    Both are compared at the speeds and forces of the training part. The power of a log magnitude is decided by its
    rare high values, which a critic hardly sees.
    """
    rows = watched(blocks, scale, seed)
    with training_state(0, 1), torch.no_grad():
        generated = network(*rows.inputs).numpy().astype(np.float64)
    power, true_power = (np.exp(2 * logs).mean(axis=(0, 1)) for logs in (scale.up(generated), blocks.log_magnitude))
    return replace(scale, mean=scale.mean + 0.5 * np.log(true_power / power))


def watched(held: Spectra, scale: SpectraScale, seed: int) -> Pairs:
    """Return held-out rows with the same noise in every epoch, in an order that separates neighbours."""
    chance = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, _NOISE])))
    order = chance.permutation(len(held.drive))
    rows = pairs(scale.hand_down(held.drive[order]), scale.down(held.log_magnitude[order]))
    drawn = torch.from_numpy(chance.standard_normal((len(rows), NOISE)).astype(np.float32))
    return Pairs((torch.as_tensor(rows.inputs), drawn), rows.targets)


def spectra_scale(blocks: Spectra) -> SpectraScale:
    """Return the standardisation of these blocks."""
    logs = blocks.log_magnitude.reshape(-1, blocks.log_magnitude.shape[-1])
    first = blocks.drive[:1]
    offsets = blocks.drive - first  # a hand that stays the same far from zero has an SD of exactly 0 so
    sd = offsets.std(axis=0)
    hand_sd = np.where(sd > 1e-12 * np.abs(blocks.drive).max(axis=0), sd, 1.0)
    return SpectraScale(
        logs.mean(axis=0), np.maximum(logs.std(axis=0), LEAST_SD), first[0] + offsets.mean(axis=0), hand_sd
    )


def magnitudes(acceleration: Array, frames: Frames) -> Array:
    """Return the magnitudes (n, count, bins) of the FFT of each frame of blocks (n, span), Hann-windowed (periodic)."""
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(frames.size) / frames.size)
    cut = sliding_window_view(acceleration, frames.size, axis=-1)[..., :: frames.hop, :]
    result: Array = np.abs(np.fft.rfft(cut * window, axis=-1))
    return result


def spectra(recording: Recording, stretches: Stretches, frames: Frames, apart: int, floor: float) -> Spectra:
    """Return every block within a stretch, `apart` samples after the previous one; none if all stretches are shorter.

    `floor` is the least magnitude.
    """
    starts = [np.arange(start, stop - frames.span + 1, apart) for start, stop in stretches]
    at: NDArray[Any] = np.concatenate([np.empty(0, dtype=np.int64), *starts]).astype(np.int64)
    blocks = recording.signals[0][at[:, None] + np.arange(frames.span)]
    strengths = magnitudes(blocks, frames)
    return Spectra(np.log(np.maximum(strengths, floor)), recording.signals[1:, at].T.copy())


def leaky(x: Tensor) -> Tensor:
    """Return x, or a fifth of it below zero."""
    return functional.leaky_relu(x, SLOPE)


def exported_generator(network: Generator, scale: SpectraScale) -> Exported:
    """Export the network from speed (mm/s), force (N) and 64 normal numbers to logs of m/s^2, (bins, frames)."""
    frames = network.frames
    exported_pieces = list(pieces(network, ""))
    down = {"down.gain": 1 / scale.hand_sd, "down.offset": -scale.hand_mean / scale.hand_sd}
    more = {
        "down.gain": np.r_[down["down.gain"], np.ones(NOISE)],
        "down.offset": np.r_[down["down.offset"], np.zeros(NOISE)],
        "up.gain": scale.sd[:, None],
        "up.offset": scale.mean[:, None],
    }
    tensors = {name: value.detach().numpy() for _, named in exported_pieces for name, value in named.items()} | more
    steps: tuple[Step, ...] = (
        Affine(gain="down.gain", offset="down.offset"), *(step for step, _ in exported_pieces), Turn(),
        Affine(gain="up.gain", offset="up.offset"), Reshape(shape=(frames.bins * frames.count,)),
    )  # fmt: skip
    return Exported(steps, {name: np.array(value, dtype=np.float32, order="C") for name, value in tensors.items()})


@pieces.register
def _(layer: Generator, name: str) -> Pieces:
    for part in ("first", "second"):
        yield from pieces(getattr(layer, part), f"{name}{part}.")
        yield Activation(function="leaky"), {}
    yield Reshape(shape=(CHANNELS, layer.length)), {}
    yield Upsample(times=2), {}
    yield from pieces(layer.middle, f"{name}middle.")
    yield Activation(function="leaky"), {}
    yield Upsample(times=2), {}
    yield from pieces(layer.last, f"{name}last.")
    yield Affine(gain=1 / BOUND), {}
    yield Activation(function="tanh"), {}
    yield Affine(gain=BOUND), {}


GAN = Method(
    name="gan", title="Spectrogram GAN", fit=fit, window=SIZE, kind="block", sampled=True,
    source="Ujitoko and Ban 2018",
)  # fmt: skip
