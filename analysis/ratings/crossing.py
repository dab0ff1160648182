"""Which columns of a study's stimuli are its factors: those whose levels, crossed, give each stimulus once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import prod

Columns = Mapping[str, str]


def crossed_columns(groups: Sequence[Sequence[Columns]], only: Sequence[str] = ()) -> tuple[str, ...]:
    """The largest set of columns that names every stimulus of every group by a full crossing, each cell once.

    `groups` holds, for each group of participants, the columns of the stimuli that it is given. A column with
    one level is no factor; `only`, where given, are the columns to choose from. Of two sets of one size the one
    with the earlier columns wins. Returns () where only the stimulus itself names a stimulus.
    """
    columns = [name for name in only or _shared(groups) if _may_cross(name, groups)]
    for size in range(len(columns), 0, -1):
        for chosen in combinations(columns, size):
            if all(_is_full_crossing(chosen, stimuli) for stimuli in groups):
                return chosen
    return ()


def levels_of(columns: Sequence[str], stimuli: Sequence[Columns]) -> dict[str, tuple[str, ...]]:
    """The levels of each column in the order in which the study lists them."""
    return {name: tuple(dict.fromkeys(stimulus[name] for stimulus in stimuli)) for name in columns}


def _shared(groups: Sequence[Sequence[Columns]]) -> list[str]:
    stimuli = [stimulus for group in groups for stimulus in group]
    if not stimuli:
        return []
    return [name for name in stimuli[0] if all(name in stimulus for stimulus in stimuli)]


def _may_cross(name: str, groups: Sequence[Sequence[Columns]]) -> bool:
    """Whether the column has several levels in each group, and their number divides that of the stimuli."""
    counts = [(len({stimulus[name] for stimulus in group}), len(group)) for group in groups]
    return all(levels > 1 and stimuli % levels == 0 for levels, stimuli in counts)


def _is_full_crossing(columns: tuple[str, ...], stimuli: Sequence[Columns]) -> bool:
    cells = {tuple(stimulus[name] for name in columns) for stimulus in stimuli}
    full = prod(len(levels) for levels in levels_of(columns, stimuli).values())
    return len(cells) == len(stimuli) == full
