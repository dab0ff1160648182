"""Adam that never follows a gradient longer than a limit: recurrent networks need it (Pascanu et al. 2013)."""

from __future__ import annotations

import math
from typing import Any

from torch import nn
from torch.nn.utils import clip_grad_norm_
from torch.optim import Adam, Optimizer

from palpate.modeling.training.loop import Optimise
from palpate.modeling.training.refusals import TrainingError


class ClippedAdam(Adam):
    """The gradient of all weights together is shortened to the length `clip`, where it is longer."""

    def __init__(self, parameters: list[nn.Parameter], rate: float, clip: float) -> None:
        super().__init__(parameters, lr=rate, fused=True)
        for group in self.param_groups:
            group["clip"] = clip  # here, so that a checkpoint of a training with another limit is refused

    def step(self, closure: Any = None) -> Any:
        """One step."""
        for group in self.param_groups:
            clip_grad_norm_(group["params"], group["clip"])
        return super().step(closure)


def clipped(length: float) -> Optimise:
    """Adam whose gradients are no longer than this. Raises TrainingError for a length that is not above 0."""
    if not 0 < length < math.inf:
        raise TrainingError(f"gradients are clipped to a length of {length}: expected above 0.")

    def make(parameters: list[nn.Parameter], rate: float) -> Optimizer:
        return ClippedAdam(parameters, rate, length)

    return make
