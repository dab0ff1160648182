"""Ratings of stimuli on attributes: each participant's own, and their means."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.spaces.matrices import frame_of
from palpate.analysis.spaces.resampling import Ratings
from palpate.analysis.statistics.cells import (
    Aggregate,
    Cells,
    cell_means,
    check_columns,
    check_options,
    coded,
    gather,
    numbers_of,
)
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, DuplicatedCells, IncompleteCells, listed

Gaps: TypeAlias = Literal["raise", "listwise", "available"]


@dataclass(frozen=True)
class Profiles:
    """The ratings: `own` (participants, stimuli, attributes) minus `offset` (attributes), NaN for missing ones.

    An offset per attribute changes neither distances nor components, and preserves their digits.
    """

    own: Floats
    offset: Floats
    participants: tuple[Hashable, ...]
    stimuli: tuple[Hashable, ...]
    attributes: tuple[Hashable, ...]
    dropped: tuple[Hashable, ...] = field(default=())

    @property
    def ratings(self) -> Ratings:
        """The ratings as (participants, cells)."""
        return Ratings(self.own.reshape(len(self.participants), -1))

    @property
    def raters(self) -> tuple[int, int]:
        """The least and the greatest number of participants of a mean."""
        count = (~np.isnan(self.own)).sum(axis=0)
        return int(count.min()), int(count.max())

    def means(self) -> pd.DataFrame:
        """Return the means (stimuli x attributes) over those who rated a stimulus, in the data's units."""
        return frame_of(self.small_means() + self.offset, self.stimuli, self.attributes)

    def shifted_means(self) -> pd.DataFrame:
        """Return the means minus each attribute's offset, for results that offsets do not change."""
        return frame_of(self.small_means(), self.stimuli, self.attributes)

    def small_means(self) -> Floats:
        """Return the means minus `offset` as an array, for components and distances."""
        result: Floats = self.ratings.means()[0].reshape(len(self.stimuli), len(self.attributes))
        return result


def gather_profiles(
    data: pd.DataFrame,
    dv: Hashable,
    stimulus: Hashable,
    attribute: Hashable,
    participant: Hashable,
    missing: Gaps = "raise",
    aggregate: Aggregate = None,
) -> Profiles:
    """Return the ratings of a long table, one row per value, sorted by label.

    `missing`: "raise" refuses a participant without a value in every cell, "listwise" leaves such participants out,
    "available" takes each mean over those who have a value. `aggregate="mean"` averages a participant's repetitions.
    Raises UnknownColumn, BadValue, IncompleteCells, DuplicatedCells or BadOption.
    """
    if missing != "available":
        return _shifted(gather(data, dv, [stimulus, attribute], participant, missing, aggregate))
    check_options("raise", aggregate)
    check_columns(data, [dv, participant, stimulus, attribute])
    values = numbers_of(data[dv], dv)
    rated = data.loc[~np.isnan(values)]
    if rated.empty:
        raise IncompleteCells(f"column {dv!r} holds no value at all")
    present_values = values[~np.isnan(values)]
    names = [participant, stimulus, attribute]
    axes = [coded(rated[name], name) for name in names]
    shape = tuple(len(axis.labels) for axis in axes)
    flat = np.ravel_multi_index(tuple(axis.codes for axis in axes), shape)
    count = np.bincount(flat, minlength=math.prod(shape))
    if count.max() > 1 and aggregate is None:
        raise DuplicatedCells(
            f"{int((count > 1).sum())} cells of a participant, stimulus and attribute hold several values; "
            "pass aggregate='mean' to average them"
        )
    cells = cell_means(present_values, flat, count).reshape(shape)
    empty = np.argwhere(np.isnan(cells).all(axis=0)).tolist()
    if empty:
        listing = listed((f"{axes[1].labels[i]!r} on {axes[2].labels[j]!r}" for i, j in empty), len(empty))
        raise IncompleteCells(f"nobody rated {listing}; leave these stimuli or attributes out")
    return _shifted(Cells(cells, axes[0].labels, names[1:], [axis.labels for axis in axes[1:]]))


def _shifted(cells: Cells) -> Profiles:
    offset = np.nanmin(cells.values, axis=(0, 1))
    people, dropped = tuple(cells.participants), tuple(cells.dropped)
    stimuli, attributes = map(tuple, cells.levels)
    return Profiles(cells.values - offset, offset, people, stimuli, attributes, dropped)


def of_people(profiles: Profiles, chosen: list[int]) -> Profiles:
    """Return the profiles of some participants, for the stimuli that they rated on every attribute."""
    own = profiles.own[chosen]
    rated = np.flatnonzero(np.all(np.any(~np.isnan(own), axis=0), axis=1))
    if not len(rated):
        raise BadOption("a part of the participants rated no stimulus on every attribute; there is nothing to compare")
    people = tuple(profiles.participants[i] for i in chosen)
    stimuli = tuple(profiles.stimuli[i] for i in rated.tolist())
    return Profiles(own[:, rated], profiles.offset, people, stimuli, profiles.attributes)
