"""Two variants of Adam: with clipped gradients, and with a learning rate that falls along a cosine."""

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
    """Adam whose gradient, over all weights, is scaled down to the norm `clip` where it is larger.

    Recurrent networks need it (Pascanu et al. 2013).
    """

    def __init__(self, parameters: list[nn.Parameter], rate: float, clip: float) -> None:
        super().__init__(parameters, lr=rate, fused=True)
        for group in self.param_groups:
            group["clip"] = clip  # part of a checkpoint's identity: one with another limit is refused

    def step(self, closure: Any = None) -> Any:
        """Clip the gradients, then take a step of Adam."""
        for group in self.param_groups:
            clip_grad_norm_(group["params"], group["clip"])
        return super().step(closure)


def clipped(length: float) -> Optimise:
    """Return a function that creates Adam with gradients clipped to this norm. Raises TrainingError unless above 0."""
    if not 0 < length < math.inf:
        raise TrainingError(f"gradients are clipped to a length of {length}: expected above 0.")

    def make(parameters: list[nn.Parameter], rate: float) -> Optimizer:
        return ClippedAdam(parameters, rate, length)

    return make


class Cosine(Adam):
    """Adam (Kingma and Ba 2015) with the schedule of Loshchilov and Hutter (2017) without restarts.

    The rate of a step follows from Adam's own count of steps, so a training that was killed and continued gives the
    same result. The rate that the trainer sets is the highest one.
    """

    def __init__(self, parameters: list[nn.Parameter], rate: float, steps: int) -> None:
        super().__init__(parameters, lr=rate, fused=True)
        self.steps = steps
        for group in self.param_groups:
            group["cosine_steps"] = steps  # part of a checkpoint's identity: one with another schedule is refused

    def step(self, closure: Any = None) -> Any:
        """Take one step with its rate of the schedule."""
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
    """Return the rate after `done` of `steps` steps, as a share of the highest rate: a linear rise, then a cosine."""
    warm = max(1.0, WARM * steps)
    if done < warm:
        return (done + 1) / (warm + 1)
    return max(0.01, 0.5 * (1 + math.cos(math.pi * min(1.0, (done - warm) / max(1.0, steps - warm)))))


def cosine(steps: int) -> Optimise:
    """Return a function that creates `Cosine` for a training of `steps` steps."""

    def make(parameters: list[nn.Parameter], rate: float) -> Optimizer:
        return Cosine(parameters, rate, steps)

    return make
