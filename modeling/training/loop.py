"""One loop for every network: epochs, the watched loss, early stopping, and the best weights at the end."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from torch import nn
from torch.optim import Adam, Optimizer

from palpate.modeling.training.checkpoints import (
    State,
    checkpoint_of,
    identity_of,
    put_back,
    read_latest,
    refuse_longer,
    refuse_other,
    write_checkpoint,
)
from palpate.modeling.training.history import Epoch
from palpate.modeling.training.refusals import TrainingError
from palpate.modeling.training.seeding import training_state
from palpate.modeling.training.settings import Course, Settings, course_of
from palpate.modeling.training.sources import Source
from palpate.modeling.training.steps import Loss, copied, finite, mean_loss, restore, train_epoch, trainable
from palpate.protocols.progress import Clock, Pace, Report, lasting, silent

Optimise: TypeAlias = Callable[[list[nn.Parameter], float], Optimizer]
"""A function of the parameters and the first learning rate that returns an optimiser."""
TrainEpoch: TypeAlias = Callable[[nn.Module, Optimizer, Source, Loss, Settings, int], float]
"""A function that trains one epoch and returns the mean loss over its rows, as `steps.train_epoch` does."""


@dataclass(frozen=True)
class Trained:
    """A finished training: its epochs, the one whose weights the network now has, and its duration in seconds.

    `stopped` is whether early stopping ended it; `continued_from` is the epoch of the checkpoint that it resumed, or 0.
    """

    history: tuple[Epoch, ...]
    best_epoch: int
    seconds: float
    stopped: bool
    continued_from: int = 0

    @property
    def best_loss(self) -> float:
        """The watched loss of the best epoch."""
        return self.history[self.best_epoch - 1].watched


def adam(parameters: list[nn.Parameter], rate: float) -> Optimizer:
    """Return Adam (Kingma and Ba 2015) with one kernel for all weights (times: docs/reference/training.md)."""
    return Adam(parameters, lr=rate, fused=True)


def train(
    network: nn.Module,
    data: Source,
    held: Source | None,
    loss: Loss,
    settings: Settings,
    *,
    optimiser: Optimise = adam,
    train_one: TrainEpoch = train_epoch,
    report: Report = silent,
    clock: Clock = time.perf_counter,
) -> Trained:
    """Train the network in place; it ends in evaluation mode, without gradients, with its best epoch's weights.

    `loss(answer, target)` is a mean over rows. The best epoch has the lowest loss on `held`, or without `held` the
    lowest mean loss while training; with `settings.keep_last` it is the last. `train_one` trains an epoch, by default
    with one step per batch; its `repr` identifies it in a checkpoint. The result depends on network, data, loss,
    optimiser, `train_one` and settings alone.

    Raises TrainingError for a loss, gradient or weight that is not finite; the network then has its best weights so
    far, or its first ones. Raises CheckpointError for a checkpoint of another training.
    """
    parameters = trainable(network)
    with training_state(settings.seed, settings.threads):
        optimiser_used = _of_one_rate(optimiser(parameters, settings.learning_rate), settings.learning_rate)
        state = State(network, optimiser_used, copied(network), [])
        run = _Run(state, data, held, loss, settings, train_one, report, clock)
        try:
            return run.to_the_end(run.identity() if settings.checkpoint else {})
        except TrainingError:
            restore(network, state.best)
            raise
        finally:
            network.eval()
            network.zero_grad(set_to_none=True)


def _of_one_rate(optimiser: Optimizer, rate: float) -> Optimizer:
    """Return the optimiser. Raises TrainingError where groups have different rates: the schedule sets one for all."""
    if {float(group["lr"]) for group in optimiser.param_groups} != {rate}:
        rates = ", ".join(f"{float(group['lr']):g}" for group in optimiser.param_groups)
        raise TrainingError(f"the optimiser's learning rate is {rates}: expected the one it was given, {rate:g}, only.")
    return optimiser


@dataclass(frozen=True)
class _Run:
    state: State
    data: Source
    held: Source | None
    loss: Loss
    settings: Settings
    train_one: TrainEpoch
    report: Report
    clock: Clock

    def identity(self) -> dict[str, Any]:
        """Return the identity of a checkpoint, which reads all of the data."""
        state = self.state
        values = identity_of(state.network, self.data, self.held, self.loss, state.optimiser, self.settings)
        return values if self.train_one is train_epoch else {**values, "steps": repr(self.train_one)}

    def to_the_end(self, identity: Mapping[str, Any]) -> Trained:
        """Train from the last checkpoint until the course ends; return the whole training."""
        history = self.state.history
        continued = self._continue(identity)
        course = course_of((epoch.watched for epoch in history), self.settings)
        before = history[-1].seconds if history else 0.0
        began, pace = self.clock(), Pace(self.settings.epochs, self.clock, len(history))
        while not course.ended(self.settings):
            course = self._epoch(course, lambda: before + self.clock() - began)
            pace.step()
            last = self.state.history[-1]
            held = "" if last.held_loss is None else f", held out {last.held_loss:.4g}"
            best = f"best {course.best_loss:.4g} in epoch {course.best_epoch}"
            left = "done" if course.ended(self.settings) else f"at most {lasting(pace.left_s)} left"
            epochs = f"epoch {last.epoch} of {self.settings.epochs}"
            self.report(f"{epochs}: loss {last.train_loss:.4g}{held} ({best}), {left}")
            due = course.epochs % self.settings.every_epochs == 0 or course.ended(self.settings)
            if due and self.settings.checkpoint is not None:
                write_checkpoint(self.settings.checkpoint, checkpoint_of(self.state, identity))
        restore(self.state.network, self.state.best)
        seconds = before + self.clock() - began
        return Trained(tuple(history), course.best_epoch, seconds, course.over(self.settings), continued)

    def _epoch(self, course: Course, seconds: Callable[[], float]) -> Course:
        """Train one epoch, measure the held-out loss, and save the weights if they are the best so far."""
        state, epoch = self.state, course.epochs + 1
        for group in state.optimiser.param_groups:
            group["lr"] = course.rate
        train_loss = self.train_one(state.network, state.optimiser, self.data, self.loss, self.settings, epoch)
        if not finite(state.network.state_dict().values()):
            raise TrainingError(f"epoch {epoch}: a weight is not finite after its last batch.", epoch)
        held = None if self.held is None else mean_loss(state.network, self.held, self.loss, self.settings, epoch)
        state.history.append(Epoch(epoch, seconds(), course.rate, train_loss, held))
        after = course.after(state.history[-1].watched, self.settings)
        if after.best_epoch == epoch:
            state.best = copied(state.network)
        return after

    def _continue(self, identity: Mapping[str, Any]) -> int:
        """Restore the last checkpoint; return its epoch, or 0 where there is none."""
        folder = self.settings.checkpoint
        checkpoint = None if folder is None else read_latest(folder, self.report)
        if checkpoint is None:
            return 0
        refuse_other(checkpoint, identity, str(folder))
        refuse_longer(checkpoint, self.settings, str(folder))
        put_back(self.state, checkpoint)
        self.report(f"continuing after epoch {checkpoint.epoch}, from {folder}")
        return checkpoint.epoch
