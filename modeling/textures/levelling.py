"""The level that a sampled model comes to on its own output, and one gain of its SD that makes it the recording's.

One step ahead a likelihood is content with an SD that is a little small or large; on the model's own output such an
error comes back with every step.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from numpy.random import PCG64, Generator, SeedSequence
from torch import Tensor, nn

from modeling.textures.heads import Spread
from modeling.textures.recording import Array, Parts, Recording, Scale
from modeling.training.seeding import training_state

ROUNDS = 4
MOST_GAIN = 1.25
"""A gain beyond this, or below its inverse, would hide a model that is wrong."""
LONGEST = 1000
"""Samples of a stretch that is run freely: longer ones are cut, so that all run side by side."""
_LEVEL = 72
"""Tells this use of a seed from the others."""


def level_alike(network: nn.Module, recording: Recording, parts: Parts, scale: Scale, window: int, seed: int) -> float:
    """Set the gain of the network's SD so that it runs at the recording's level; the gain is returned, 1 for no change.

    It runs freely along the speeds and forces of the training and validation parts, from what was recorded before
    each stretch; the same draws are used for every gain. The test part is not looked at. Of the gains that were tried
    the one with the level nearest to the recording's is taken.
    """
    spread = next((layer for layer in network.modules() if isinstance(layer, Spread)), None)
    stretches = _cut((*parts.train, *parts.validation), window)
    if spread is None or not stretches:
        return 1.0
    actual = _level(np.concatenate([recording.signals[0, start + window : stop] for start, stop in stretches]))
    gain, tried = 1.0, dict[float, float]()
    for _ in range(ROUNDS):
        spread.log_gain.fill_(math.log(gain))
        ratio = _level(free_run(network, recording, stretches, scale, window, seed)) / actual
        tried[gain] = abs(math.log(ratio)) if ratio > 0 else math.inf
        gain = float(np.clip(gain / max(ratio, 1e-3), 1 / MOST_GAIN, MOST_GAIN))
        if gain in tried:
            break
    best = min(tried, key=lambda each: tried[each])
    spread.log_gain.fill_(math.log(best))
    return best


def free_run(
    network: nn.Module, recording: Recording, stretches: list[tuple[int, int]], scale: Scale, window: int, seed: int
) -> Array:
    """What the network makes of each stretch after its first window, one after another, in m/s^2, about 0."""
    longest = max(stop - start for start, stop in stretches)
    hand = torch.zeros(len(stretches), 3, longest)
    for row, (start, stop) in zip(hand, stretches, strict=True):
        row[:, : stop - start] = torch.from_numpy(scale.down(recording.signals[:, start:stop]).astype(np.float32))
    chance = Generator(PCG64(SeedSequence([seed, _LEVEL])))
    drawn = torch.from_numpy(chance.standard_normal((longest, len(stretches))).astype(np.float32))
    with training_state(0, 1), torch.no_grad():
        network.eval()
        for at in range(window, longest):
            hand[:, 0, at] = _sample(network(hand[:, :, at - window : at]), drawn[at])
    made = [row[0, window : stop - start] for row, (start, stop) in zip(hand, stretches, strict=True)]
    found: Array = torch.cat(made).numpy().astype(np.float64) * scale.sd[0] + scale.mean[0]
    return found


def _sample(answer: Tensor, drawn: Tensor) -> Tensor:
    return answer[:, 0] + answer[:, 1].exp() * drawn


def _cut(stretches: tuple[tuple[int, int], ...], window: int) -> list[tuple[int, int]]:
    """Parts of at most `LONGEST` samples that hold more than a window."""
    cut = [(at, min(at + LONGEST, stop)) for start, stop in stretches for at in range(start, stop, LONGEST)]
    return [(start, stop) for start, stop in cut if stop - start > 2 * window]


def _level(signal: Array) -> float:
    return float(np.sqrt(np.mean(np.square(signal))))
