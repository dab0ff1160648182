"""The spectrogram GAN of Ujitoko and Ban 2018: a generator of spectrograms, made to sound a block at a time.

From the paper: a conditional generative adversarial network whose generator makes spectrograms of the acceleration,
turned to a signal without recorded phases. From the thesis: 56 samples (table 4.3). Ours: the condition is speed and
force (there images or names of textures; here each texture has a network of its own); 4 frames of 56 samples, 14 apart,
so that a block is 56 samples too; log magnitudes; small convolutions along frequency that can be made within a step of
1 kHz; the losses of modeling/training/adversarial.py; the weights of the epoch whose spectrograms for held-out speeds
and forces lie nearest to the real ones (energy distance); each bin's mean power made that of the training part. The
paper finds phases by iterations that need the whole signal (Griffin and Lim 1984); the renderer draws them
(signals/textures/block_voice.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import torch
from torch import Tensor

from palpate.modeling.files.exported import Exported
from palpate.modeling.textures.fitting import for_length, settings_for
from palpate.modeling.textures.gan_networks import NOISE, Critic, Generator
from palpate.modeling.textures.gan_scale import SpectraScale, spectra_scale
from palpate.modeling.textures.methods import Learning, Method
from palpate.modeling.textures.recording import TextureDataError
from palpate.modeling.textures.spectrograms import FAINTEST, Frames, Spectra, spectra
from palpate.modeling.textures.windows import Stretches, samples_of
from palpate.modeling.training.adversarial import Adversarial, Adversaries, energy_distance, two_adams
from palpate.modeling.training.loop import Trained, train
from palpate.modeling.training.seeding import seeded, training_state
from palpate.modeling.training.settings import Settings
from palpate.modeling.training.sources import Given, Made, Pairs, Source, pairs
from palpate.signals.arrays import Array

SIZE, PARTS, FRAMES = 56, 4, 4
"""Samples of a frame (thesis table 4.3), hops in a frame, frames in a block."""
APART, HELD_APART = 4, 7
"""Samples between the blocks of the training part, and of the validation part."""
LEAST_BLOCKS = 8
STEP = Adversarial()
SETTINGS = Settings(epochs=60, batch=64, learning_rate=5e-4, plateau_patience=None, stop_patience=20, every_epochs=5)


@dataclass(frozen=True)
class FittedGan:
    """A trained generator, and what its numbers mean."""

    network: Adversaries
    cut: Frames
    scale: SpectraScale
    trained: Trained

    @property
    def window(self) -> int:
        """Samples of a frame."""
        return self.cut.size

    @property
    def hop(self) -> int:
        """Samples between frames."""
        return self.cut.hop

    @property
    def frames(self) -> int:
        """Frames of a block."""
        return self.cut.count

    @property
    def drawn(self) -> int:
        """Random numbers that a block takes beside speed and force."""
        return NOISE

    def predict(self, given: Array) -> Array:
        """It does not look at the past. Raises TextureDataError."""
        raise TextureDataError(f"a GAN makes spectra of blocks: it does not continue windows {given.shape}.")

    def exported(self) -> Exported:
        """Steps from speed, force and noise (66) to log magnitudes (bins, frames) in C order."""
        from palpate.modeling.textures.exporting_gan import exported_generator

        return exported_generator(cast(Generator, self.network.generator), self.scale)


def fit(learning: Learning) -> FittedGan:
    """Train generator and critic on a recording's training part, watched on its validation part.

    `Learning.window` is the size of a frame (even). Raises TextureDataError for a recording without enough blocks or
    whose acceleration does not vary, TrainingError for a training that fails.
    """
    size = learning.window or SIZE
    frames = Frames(size, max(1, size // PARTS), FRAMES)
    asked = settings_for(learning, for_length(SETTINGS, learning))
    acceleration = samples_of(learning.recording, learning.parts.train)[0]
    if not acceleration.size or not np.ptp(acceleration) > 0:
        raise TextureDataError(f"{learning.recording.texture}: its acceleration does not vary: nothing to learn from.")
    found = _blocks(learning, learning.parts.train, frames, APART, "training")
    held = _blocks(learning, learning.parts.validation, frames, HELD_APART, "validation")
    scale = spectra_scale(found)
    network = seeded(lambda: Adversaries(Generator(frames), Critic(frames)), asked.seed)
    trained = train(
        network, fed(found, scale), watched(held, scale, asked.seed), energy_distance, asked,
        optimiser=two_adams, train_one=STEP, report=learning.report,
    )  # fmt: skip
    return FittedGan(network, frames, levelled(network, found, scale, asked.seed), trained)


def _blocks(learning: Learning, stretches: Stretches, frames: Frames, apart: int, name: str) -> Spectra:
    found = spectra(learning.recording, stretches, frames, apart, least_magnitude(learning, frames))
    if len(found.drive) < LEAST_BLOCKS:
        raise TextureDataError(
            f"{learning.recording.texture}: its {name} part has {len(found.drive)} blocks of {frames.span} samples; at "
            f"least {LEAST_BLOCKS} are expected: record longer, or take a shorter frame."
        )
    return found


def least_magnitude(learning: Learning, frames: Frames) -> float:
    """What fainter magnitudes count as: a share of those of white noise as strong as the training part."""
    sd = float(samples_of(learning.recording, learning.parts.train)[0].std())
    return FAINTEST * sd * float(np.sqrt(0.375 * frames.size))


def fed(found: Spectra, scale: SpectraScale) -> Source:
    """Speed and force with fresh noise every time, and the real spectrogram."""
    rows = pairs(scale.hand_down(found.drive), scale.down(found.log_magnitude))

    def make(chosen: Tensor, chance: torch.Generator) -> tuple[Given, Given]:
        condition, real = rows.batch(chosen, chance)
        return (torch.as_tensor(condition), torch.randn(len(chosen), NOISE, generator=chance)), real

    return Made(len(rows), make, f"{rows.digest} with {NOISE} numbers drawn")


def levelled(network: Adversaries, found: Spectra, scale: SpectraScale, seed: int) -> SpectraScale:
    """The scale by which what is made has the mean power of what is real, in each bin, for the hands of the training.

    The power of a log magnitude is decided by its rare high values, which a critic hardly sees.
    """
    rows = watched(found, scale, seed)
    with training_state(0, 1), torch.no_grad():
        made = network(*rows.inputs).numpy().astype(np.float64)
    power, wanted = (np.exp(2 * each).mean(axis=(0, 1)) for each in (scale.up(made), found.log_magnitude))
    return replace(scale, mean=scale.mean + 0.5 * np.log(wanted / power))


def watched(held: Spectra, scale: SpectraScale, seed: int) -> Pairs:
    """The same noise in every epoch, so that epochs can be compared; in an order in which neighbours lie apart."""
    chance = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, _NOISE])))
    order = chance.permutation(len(held.drive))
    rows = pairs(scale.hand_down(held.drive[order]), scale.down(held.log_magnitude[order]))
    drawn = torch.from_numpy(chance.standard_normal((len(rows), NOISE)).astype(np.float32))
    return Pairs((torch.as_tensor(rows.inputs), drawn), rows.targets)


_NOISE = 83
"""Tells this use of a seed from the trainer's own."""
GAN = Method(
    name="gan", title="Spectrogram GAN", fit=fit, window=SIZE, kind="block", sampled=True,
    source="Ujitoko and Ban 2018",
)  # fmt: skip
