"""Rows at rest: no speed, no force, and silence to follow, so that a generative model dies away when the hand stops."""

from __future__ import annotations

import numpy as np
import torch
from numpy.random import PCG64, Generator, SeedSequence
from torch import Tensor

from palpate.modeling.textures.recording import Scale
from palpate.modeling.training.sources import Pairs

LEVEL = 0.006
"""The SD of what follows at rest, in SDs of the acceleration: -44 dB. Less would outweigh all other rows."""
_REST = 71
"""Tells this use of a seed from the trainer's own."""


def with_rest(rows: Pairs, share: float, scale: Scale, seed: int) -> Pairs:
    """The rows, and `share` times as many more that rest; decided by the seed.

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
