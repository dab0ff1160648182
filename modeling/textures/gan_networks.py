"""The generator of spectrograms and its critic: convolutions along frequency, with speed and force as a condition."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from palpate.modeling.textures.shapes import shaped
from palpate.modeling.textures.spectrograms import Frames

NOISE = 64
"""Numbers drawn for each block: about as many as a block of 98 samples has degrees of freedom."""
WIDE, CHANNELS = 128, 32
SLOPE = 0.2
BOUND = 4.0
"""No log magnitude lies further from its mean than this many SDs."""


class Generator(nn.Module):
    """Speed and force (batch, 2), normalised, and noise (batch, 64) to log magnitudes (batch, count, bins), normalised.

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
        """A spectrogram for each row."""
        given = torch.cat([shaped(condition, 2), shaped(noise, NOISE)], dim=1)
        x = leaky(self.second(leaky(self.first(given)))).view(-1, CHANNELS, self.length)
        x = leaky(self.middle(x.repeat_interleave(2, dim=2)))
        x = self.last(x.repeat_interleave(2, dim=2))
        return BOUND * torch.tanh(shaped(x, self.frames.count, self.frames.bins) / BOUND)


class Critic(nn.Module):
    """Speed and force (batch, 2) and a spectrogram (batch, count, bins) to one number a row: high for a real one."""

    def __init__(self, frames: Frames) -> None:
        super().__init__()
        self.frames = frames
        self.first = nn.Conv1d(frames.count + 2, CHANNELS, 4, stride=2, padding=1)
        self.second = nn.Conv1d(CHANNELS, 2 * CHANNELS, 4, stride=2, padding=1)
        places = frames.bins // 2 // 2
        self.third, self.last = nn.Linear(2 * CHANNELS * places, WIDE), nn.Linear(WIDE, 1)

    def forward(self, condition: Tensor, spectrogram: Tensor) -> Tensor:
        """How real it looks for that hand."""
        shaped(spectrogram, self.frames.count, self.frames.bins)
        beside = condition[:, :, None].expand(-1, -1, self.frames.bins)
        x = leaky(self.second(leaky(self.first(torch.cat([spectrogram, beside], dim=1)))))
        found: Tensor = self.last(leaky(self.third(x.flatten(1))))
        return found


def leaky(x: Tensor) -> Tensor:
    """x, or a fifth of it below zero."""
    return functional.leaky_relu(x, SLOPE)
