"""Rows of the collected table `choices`, of simulated observers and procedures written for tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

GRID = np.linspace(-40.0, 0.0, 41)
Truth = Callable[[Any], Any]


def weibull_db(
    level: Any, threshold: float = -18.0, slope: float = 3.0, guess: float = 0.5, lapse: float = 0.02
) -> Any:
    """The observer of check 6: two intervals, levels in dB (Watson 2017)."""
    return guess + (1 - guess - lapse) * (1 - np.exp(-(10 ** (slope * (np.asarray(level) - threshold) / 20))))


def halfway(threshold: float = -18.0, slope: float = 3.0) -> float:
    """The level at which that observer's F is 0.5."""
    return threshold + 20 / slope * float(np.log10(np.log(2)))


class QuestPlus:
    """A plain QUEST+ of levels -40 to 0 dB (Watson 2017), written for tests alone."""

    def __init__(self, lapses: tuple[float, ...] = (0.0, 0.02, 0.04)) -> None:
        axes = np.meshgrid(GRID, np.linspace(0.5, 10, 20), lapses, indexing="ij")
        threshold, slope, lapse = (axis.ravel() for axis in axes)
        self.hit = weibull_db(GRID[:, None], threshold, slope, 0.5, lapse)
        self.entropies = self._entropy(self.hit)

    @staticmethod
    def _entropy(share: Any) -> Any:
        kept = np.clip(share, 1e-12, 1 - 1e-12)
        return -(kept * np.log(kept) + (1 - kept) * np.log(1 - kept))

    def __call__(self, rng: np.random.Generator, trials: int, truth: Truth) -> tuple[Any, Any]:
        weights = np.full(self.hit.shape[1], 1 / self.hit.shape[1])
        levels, hits = [], []
        for _ in range(trials):
            gain = self._entropy(self.hit @ weights) - self.entropies @ weights
            best = int(np.argmax(np.round(gain, 9)))
            hit = bool(rng.random() < truth(GRID[best]))
            weights = weights * (self.hit[best] if hit else 1 - self.hit[best])
            weights /= weights.sum()
            levels.append(GRID[best])
            hits.append(hit)
        return np.array(levels), np.array(hits, dtype=float)


def staircase(rng: np.random.Generator, trials: int, truth: Truth) -> tuple[Any, Any]:
    """Two down, one up, in steps of 2 dB from -4 dB."""
    level, run = -4.0, 0
    levels, hits = [], []
    for _ in range(trials):
        hit = bool(rng.random() < truth(level))
        levels.append(level)
        hits.append(hit)
        run = run + 1 if hit else 0
        if not hit:
            level = min(0.0, level + 2)
        elif run == 2:
            level, run = max(-40.0, level - 2), 0
    return np.array(levels), np.array(hits, dtype=float)


def constant(rng: np.random.Generator, trials: int, truth: Truth) -> tuple[Any, Any]:
    """Eight levels from -35 to 0 dB, equally often."""
    levels = np.repeat(np.linspace(-35, 0, 8), trials // 8)
    return levels, (rng.random(len(levels)) < truth(levels)).astype(float)


def rows(levels: Any, correct: Any, participant: str = "P001", **columns: Any) -> pd.DataFrame:
    """The table of one participant's track, as `choices` is collected."""
    count = len(levels)
    known = {
        "session": f"made/{participant}/1", "session_number": 1, "group": "", "stimulus": "f250", "track": "f250",
        "procedure": "constant", "level_2": np.nan, "standard": np.nan, "design": "forced_choice", "alternatives": 2,
        "target": ["first", "second"] * (count // 2) + ["first"] * (count % 2), "catch": "none",
    }  # fmt: skip
    table = pd.DataFrame(
        {"participant": participant, "trial": range(1, count + 1), "level": levels, "correct": correct}
    )
    table = table.assign(**{**known, **columns})
    right = table["correct"] == 1
    if "hit" not in table.columns:
        table["hit"] = table["correct"]
    if "chosen" not in table.columns:
        other = table["target"].map({"first": "second", "second": "first"})
        table["chosen"] = table["target"].where(right, other)
    return table


def tracks() -> pd.DataFrame:
    """Two observers in three procedures of 64 trials each; the second guesses in the last."""
    parts = []
    for n, who in enumerate(("P001", "P002")):
        for track, name, procedure in (
            ("f40", "constant", constant), ("f160", "staircase", staircase), ("f250", "questplus", QuestPlus()),
        ):  # fmt: skip
            guesses = who == "P002" and track == "f250"
            truth: Truth = (lambda level: 0.5 + 0.0 * level) if guesses else weibull_db
            levels, hits = procedure(np.random.default_rng([4, n]), 64, truth)
            table = rows(levels, hits, who, track=track, procedure=name)
            parts.append(table.assign(trial=table["trial"] + 64 * (len(parts) % 3)))
    return pd.concat(parts, ignore_index=True)
