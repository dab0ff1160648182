"""The errors of trainings, checkpoints and jobs."""

from __future__ import annotations


class TrainingError(ValueError):
    """A training that cannot begin or go on; `epoch` and `batch` count from 1, and are None before the first."""

    def __init__(self, message: str, epoch: int | None = None, batch: int | None = None) -> None:
        super().__init__(message)
        self.epoch, self.batch = epoch, batch


class CheckpointError(ValueError):
    """A checkpoint that is damaged, or that belongs to another training."""


class JobError(ValueError):
    """A job that was refused, or a way of running jobs that is not available: the message names it."""


class JobBroken(RuntimeError):
    """A job that failed for another reason than its input: the message holds the worker's traceback."""
