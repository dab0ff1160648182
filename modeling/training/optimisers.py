"""Adam in two further ways: with gradients no longer than a limit, and with a rate that falls along a cosine."""

from __future__ import annotations

import math
from typing import Any

from torch import nn
from torch.nn.utils import clip_grad_norm_
from torch.optim import Adam, Optimizer

from palpate.modeling.training.loop import Optimise
from palpate.modeling.training.refusals import TrainingError

WARM = 0.05
"""The share of all steps over which the rate rises."""


class ClippedAdam(Adam):
    """The gradient of all weights together is shortened to the length `clip`, where it is longer.

    Recurrent networks need it (Pascanu et al. 2013).
    """

    def __init__(self, parameters: list[nn.Parameter], rate: float, clip: float) -> None:
        super().__init__(parameters, lr=rate, fused=True)
        for group in self.param_groups:
            group["clip"] = clip  # here, so that a checkpoint of a training with another limit is refused

    def step(self, closure: Any = None) -> Any:
        """Shorten the gradients where they are too long, then take a step of Adam."""
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


class Cosine(Adam):
    """Adam (Kingma and Ba 2015) with the schedule of Loshchilov and Hutter (2017) without restarts.

    The rate of a step is decided by the steps that Adam has counted for its weights, so that a training that was
    killed and continued goes on as if it had not been. The rate that the trainer sets is the highest one.
    """

    def __init__(self, parameters: list[nn.Parameter], rate: float, steps: int) -> None:
        super().__init__(parameters, lr=rate, fused=True)
        self.steps = steps
        for group in self.param_groups:
            group["cosine_steps"] = steps  # an option of the optimiser: a checkpoint of another course is refused

    def step(self, closure: Any = None) -> Any:
        """Take one step at its own rate."""
        highest = [group["lr"] for group in self.param_groups]
        state = next(iter(self.state.values()), None)
        share = share_of(int(state["step"]) if state else 0, self.steps)
        try:
            for group, rate in zip(self.param_groups, highest, strict=True):
                group["lr"] = rate * share
            return super().step(closure)
        finally:
            for group, rate in zip(self.param_groups, highest, strict=True):
                group["lr"] = rate


def share_of(done: int, steps: int) -> float:
    """Return the share of the highest rate after so many of all steps."""
    warm = max(1.0, WARM * steps)
    if done < warm:
        return (done + 1) / (warm + 1)
    return max(0.01, 0.5 * (1 + math.cos(math.pi * min(1.0, (done - warm) / max(1.0, steps - warm)))))


def cosine(steps: int) -> Optimise:
    """Return what makes such an optimiser for a training of so many steps."""

    def make(parameters: list[nn.Parameter], rate: float) -> Optimizer:
        return Cosine(parameters, rate, steps)

    return make
