"""Ratings of participants as an array with gaps, and their means over participants drawn with replacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import IncompleteCells, TooFew

TRIES = 50


@dataclass(frozen=True)
class Ratings:
    """Ratings as `values` (participants, cells), NaN for missing ones."""

    values: Floats

    @property
    def people(self) -> int:
        """The number of participants."""
        return len(self.values)

    def means(self, counts: Floats | None = None) -> Floats:
        """Return the mean of each cell over those who filled it, (draws, cells).

        `counts` (draws, participants) are weights.
        """
        weights = np.ones((1, self.people)) if counts is None else counts
        present = (~np.isnan(self.values)).astype(np.float64)
        result: Floats = (weights @ np.nan_to_num(self.values)) / (weights @ present)
        return result


def resample(ratings: Ratings, draws: int, rng: Generator) -> Floats:
    """Return how often each participant is drawn, (draws, participants).

    If each pattern of filled cells has at least two people, participants are drawn within patterns, so that groups with
    their own stimuli keep their sizes. Otherwise they are drawn from all, and a draw with an empty cell is repeated.
    Raises TooFew for one participant, IncompleteCells if a cell is too rarely filled.
    """
    if ratings.people < 2:
        raise TooFew("one participant: nothing can be resampled; expected two or more")
    present = ~np.isnan(ratings.values)
    _, pattern = np.unique(present, axis=0, return_inverse=True)
    sizes = np.bincount(pattern.ravel())
    groups = [np.flatnonzero(pattern.ravel() == i) for i in range(len(sizes))]
    if sizes.min() < 2:
        weights = present.astype(np.float64)
        people = len(weights)
        accepted = np.zeros((0, people))
        for _ in range(TRIES):
            counts = rng.multinomial(people, np.full(people, 1 / people), size=draws).astype(np.float64)
            accepted = np.concatenate((accepted, counts[((counts @ weights) > 0).all(axis=1)]))
            if len(accepted) >= draws:
                return accepted[:draws]
        raise IncompleteCells(
            f"fewer than 1 in {TRIES} resamples of the participants fill every cell: too few rated some of the stimuli "
            "for an interval; ask for none, or leave these stimuli out"
        )
    counts = np.zeros((draws, ratings.people))
    for members in groups:
        counts[:, members] = rng.multinomial(len(members), np.full(len(members), 1 / len(members)), size=draws)
    return counts
