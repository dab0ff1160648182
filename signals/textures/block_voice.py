"""Play a model that predicts the spectrum of a block of signal: frames with random phases, overlapped and added."""

from __future__ import annotations

import math

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.models.card import Card, Texture
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.fastest import Runs
from palpate.signals.textures.normals import Normals
from palpate.signals.textures.sounds import RenderError

LARGEST_LOG = 40.0


class Blocks:
    """A player that gets the log magnitudes (bins, frames) of the next frames from the model when the last are played.

    Frames are `window` samples long and `hop` apart; magnitudes are those of a Hann-windowed frame's FFT. Every frame
    has phases of its own, drawn one after another: frames of one block and of the next overlap in the same way, so
    there is no seam between blocks. Independent phases add in power: the level is that of the spectrum.
    """

    def __init__(self, runs: Runs, texture: Texture, peak: float, seed: int) -> None:
        """Take the model; `seed` decides its noise and the phases. Raise RenderError where the shapes do not fit."""
        self._runs, self._peak, self._seed = runs, peak, seed
        self._size, self._hop, self._bins, self._frames = shape(runs.card, texture)
        self._drawn = runs.card.takes.size - 2
        self._weights = synthesis(self._size, self._hop)
        # A touch begins at full level: so many blocks are made before it that frames overlap there as later on.
        self._lead = math.ceil((self._size / self._hop - 1) / self._frames)
        self._noise, self._phases = Normals(seed, 2), Normals(seed, 3)
        self.begin()

    def begin(self) -> None:
        """Make the next step the first of a touch."""
        self._ahead = np.zeros(self._size)
        self._ready: list[float] = []
        self._at = 0
        self._cold = True

    def step(self, speed_mm_s: float, force_N: float) -> float:
        """Return the next sample in m/s^2; NaN where the model has no answer."""
        if self._at == len(self._ready):
            try:
                # Make the samples until the next frames are needed.
                for _ in range(self._lead if self._cold else 0):
                    self._block(speed_mm_s, force_N)
                self._cold = False
                ready = np.clip(self._block(speed_mm_s, force_N), -self._peak, self._peak)
                self._ready, self._at = ready.tolist(), 0
            except ModelInputError:
                return math.nan
        self._at += 1
        return self._ready[self._at - 1]

    def _block(self, speed_mm_s: float, force_N: float) -> Array:
        """Return the samples of the next frames. Raises ModelInputError."""
        drive = [speed_mm_s, force_N, *(self._noise.next() for _ in range(self._drawn))]
        log_magnitudes = self._runs.run(np.array(drive)).reshape(self._bins, self._frames).T
        return np.concatenate([self._added(frame) for frame in np.minimum(log_magnitudes, LARGEST_LOG)])

    def _added(self, log_magnitude: Array) -> Array:
        """Add one frame to the samples ahead, and return those that no later frame reaches."""
        phases = np.array([self._phases.next() for _ in range(2 * self._bins)])
        turned = phases[: self._bins] + 1j * phases[self._bins :]
        turned /= np.maximum(np.abs(turned), 1e-12)
        turned[[0, -1]] = np.where(turned[[0, -1]].real < 0, -1.0, 1.0)
        self._ahead += self._weights * np.fft.irfft(np.exp(log_magnitude) * turned, self._size)
        done = self._ahead[: self._hop].copy()
        self._ahead[: -self._hop] = self._ahead[self._hop :]
        self._ahead[-self._hop :] = 0.0
        return done


def shape(card: Card, texture: Texture) -> tuple[int, int, int, int]:
    """Return the frame length, hop, bins and frames of a card. Raises RenderError where its numbers contradict."""
    size, hop, bins = texture.window, texture.hop, texture.window // 2 + 1
    if hop is None or not 1 <= hop <= size // 2:
        raise RenderError(
            f"{card.name}: a hop of {hop} samples between frames of {size}; 1 to {size // 2} are expected. Export it "
            "again."
        )
    if size % 2 or card.gives.size % bins or card.takes.size < 2:
        raise RenderError(
            f"{card.name}: {card.gives.size} numbers are no spectrum of frames of {size} samples ({bins} bins), or "
            f"{card.takes.size} numbers are not speed, force and more. Export it again."
        )
    return size, hop, bins, card.gives.size // bins


def hann(size: int) -> Array:
    """Return the periodic Hann window."""
    window_shape: Array = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(size) / size)
    return window_shape


def synthesis(size: int, hop: int) -> Array:
    """Return the weights (size,) with which overlapped frames of random phases have the analysed signal's level.

    For a signal of variance 1, the variance of the inverse FFT with random phases is the mean of the squared analysis
    window.
    """
    window = hann(size)
    overlapped = np.zeros(size)
    for shift in range(0, size, hop):
        overlapped += np.roll(window**2, shift)
    if size % hop:
        overlapped[:] = np.sum(window**2) / hop
    window_shape: Array = window / np.sqrt(np.mean(window**2) * overlapped)
    return window_shape
