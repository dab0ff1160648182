"""The sizes of a comparison."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Size:
    """Folds, code sizes of the reconstruction, principal components for ridge, epochs and threads of each training.

    Each training has `threads` threads.
    """

    folds: int = 5
    codes: tuple[int, ...] = (7, 16)
    components: int = 16
    epochs: int = 100
    batch: int = 8
    learning_rate: float = 1e-3
    seed: int = 0
    threads: int = 1


FULL = Size()
REDUCED = Size(folds=3, epochs=20)
"""The settings of the table in docs/reference/keyswitch.md."""
QUICK = Size(folds=2, codes=(7,), epochs=2)
