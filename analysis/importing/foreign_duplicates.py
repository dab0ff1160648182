"""Several ratings in one cell of a foreign table: refused, averaged or the first taken, as the map says."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import replace

from palpate.analysis.importing.dialects import SHOWN, TableRefused
from palpate.analysis.importing.foreign_rows import ForeignRating
from palpate.analysis.importing.map_file import ColumnMap
from palpate.analysis.ratings.dataset import Exclusion
from palpate.protocols.wording import count, some_lines

Cell = tuple[str, ...]


def settle_duplicates(
    column_map: ColumnMap, found: Sequence[ForeignRating]
) -> tuple[list[ForeignRating], bool, list[Exclusion]]:
    """One rating for each cell in the order of the file, whether any is a mean, and what was done, by participant.

    A cell is a participant, an attribute, the within levels and the stimulus. Raises TableRefused on a duplicate
    that the map does not settle, and where a kept column differs within a cell that is averaged.
    """
    cells: dict[Cell, list[ForeignRating]] = {}
    for rating in found:
        cells.setdefault(_cell(rating), []).append(rating)
    several = {cell: ratings for cell, ratings in cells.items() if len(ratings) > 1}
    if not several:
        return list(found), False, []
    if column_map.duplicates == "refuse":
        raise TableRefused(_listed(column_map, several))
    averaged = column_map.duplicates == "mean"
    settled = [_mean(ratings) if averaged else ratings[0] for ratings in cells.values()]
    return settled, averaged, _exclusions(several, averaged)


def _cell(rating: ForeignRating) -> Cell:
    return (rating.participant, rating.attribute, *rating.within.values(), rating.stimulus)


def _listed(column_map: ColumnMap, several: dict[Cell, list[ForeignRating]]) -> str:
    lines = some_lines([f"{_named(ratings[0])}: {_wheres(ratings)}" for ratings in several.values()], SHOWN)
    advice = "say duplicates: mean or first, or name the column that tells them apart under within or stimulus"
    held = f"{count(len(several), 'cell')} {'holds' if len(several) == 1 else 'hold'} several ratings"
    return "\n".join([f"{column_map.name}: {held}; {advice}:", *(f"  {line}" for line in lines)])


def _named(rating: ForeignRating) -> str:
    levels = [f"{factor} {level}" for factor, level in rating.within.items()]
    stimulus = [f"stimulus {rating.stimulus}"] if rating.stimulus else []
    return ", ".join([f"participant {rating.participant}", rating.attribute, *levels, *stimulus])


def _wheres(ratings: Sequence[ForeignRating]) -> str:
    shown = ", ".join(f"{rating.where} ({rating.value:g})" for rating in ratings[:SHOWN])
    return shown + (", ..." if len(ratings) > SHOWN else "")


def _mean(ratings: Sequence[ForeignRating]) -> ForeignRating:
    first = ratings[0]
    for rating in ratings[1:]:
        for column, text in rating.kept.items():
            if text != first.kept[column]:
                raise TableRefused(
                    f"{rating.where}: {column!r} is {text!r}, but {first.kept[column]!r} at {first.where}, with which"
                    f" it is averaged; leave {column!r} out of keep"
                )
    return first if len(ratings) == 1 else replace(first, value=statistics.mean(r.value for r in ratings))


def _exclusions(several: dict[Cell, list[ForeignRating]], averaged: bool) -> list[Exclusion]:
    people: dict[str, list[int]] = {}
    for cell, ratings in several.items():
        people.setdefault(cell[0], []).append(len(ratings))
    if averaged:
        return _averaged({person: (sum(counts), len(counts)) for person, counts in people.items()})
    return [
        Exclusion(
            "repeated",
            person,
            f"not the first rating of its cell ({count(len(counts), 'cell')})",
            sum(counts) - len(counts),
        )
        for person, counts in people.items()
    ]


def _averaged(people: dict[str, tuple[int, int]]) -> list[Exclusion]:
    """One line for each participant, given the numbers of ratings and cells, or one for all where they are alike."""
    alike = set(people.values())
    if len(people) > 1 and len(alike) == 1:
        ratings, cells = alike.pop()
        why = f"{count(ratings, 'rating')} of each averaged into {count(cells, 'cell')}"
        who = count(len(people), "participant")
        return [Exclusion("averaged", who, why, len(people) * ratings, len(people) * cells)]
    return [
        Exclusion("averaged", person, f"{ratings} ratings averaged into {count(cells, 'cell')}", ratings, cells)
        for person, (ratings, cells) in people.items()
    ]
