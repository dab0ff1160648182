"""The columns of a wide table of ratings: which attribute each is, which end is which, and what the numbers say."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.modeling.attributes.material import MaterialError, Pair, Rated
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import some

TOP = 100.0
RATERS = "raters"
KNOWN = ("id", "label", "category", "class", RATERS)
SD = ".sd"
BETWEEN = re.compile(r"[\s_/–—-]+(?:to[\s_/–—-]+)?")
"""What may stand between the two words of an attribute, beside the hyphen."""
MOST_RATERS = 10**9


@dataclass(frozen=True)
class Rating:
    """The column of an attribute, and that of its SD ("" without one); `turned`: the pair's second word comes first."""

    pair: Pair
    column: str
    sd: str
    turned: bool


@dataclass(frozen=True)
class Columns:
    """The attributes that the table rates, in the order of the pairs."""

    ratings: tuple[Rating, ...]

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Their names."""
        return tuple(each.pair for each in self.ratings)

    @property
    def of_numbers(self) -> frozenset[str]:
        """The columns that hold numbers."""
        return frozenset({*(name for each in self.ratings for name in (each.column, each.sd) if name), RATERS})

    @property
    def notes(self) -> tuple[str, ...]:
        """Which columns were turned."""
        return tuple(
            f"column {each.column!r} turned: 0 is {each.pair.low}, 100 {each.pair.high}"
            for each in self.ratings if each.turned
        )  # fmt: skip


def columns_of(place: str, header: Sequence[str], pairs: Sequence[Pair]) -> Columns:
    """Which attribute each column is. Raises MaterialError on an unknown, missing or twofold column."""
    for name in header:
        if header.count(name) > 1:
            raise MaterialError(f"{place}: the column {name!r} stands there twice")
    if "id" not in header:
        raise MaterialError(f"{place}: a column 'id' is expected; found {some(header) or 'nothing'}")
    found = {name: _meant(name, pairs) for name in header if name not in KNOWN and not name.endswith(SD)}
    _demand_known(place, header, found, pairs)
    return Columns(tuple(_rating(place, pair, header, found) for pair in pairs))


def _meant(name: str, pairs: Sequence[Pair]) -> tuple[Pair, bool] | None:
    """The pair that a column is called by, and whether its words are turned round."""
    plain = _plain(name)
    for pair in pairs:
        if plain == _plain(f"{pair.low}-{pair.high}"):
            return pair, False
        if plain == _plain(f"{pair.high}-{pair.low}"):
            return pair, True
    return None


def _plain(name: str) -> str:
    return BETWEEN.sub(" ", name.strip().lower())


def _demand_known(
    place: str, header: Sequence[str], found: Mapping[str, tuple[Pair, bool] | None], pairs: Sequence[Pair]
) -> None:
    words = {word.lower(): pair for pair in pairs for word in (pair.low, pair.high)}
    for name, meant in found.items():
        if meant is None and name.lower() in words:
            told = f"both its words say which end is which: {words[name.lower()].name}"
            raise MaterialError(f"{place}: the column {name!r} names one word of an attribute; {told}")
        if meant is None:
            known = (*KNOWN, *(pair.name for pair in pairs))
            raise MaterialError(f"{place}: no column is called {name!r}; {nearest(name, known)}")
    for name in header:
        if name.endswith(SD) and name.removesuffix(SD) not in found:
            raise MaterialError(f"{place}: {name!r} is an SD, and no column {name.removesuffix(SD)!r} is there")


def _rating(place: str, pair: Pair, header: Sequence[str], found: Mapping[str, tuple[Pair, bool] | None]) -> Rating:
    names = [name for name, meant in found.items() if meant is not None and meant[0] == pair]
    if len(names) != 1:
        told = f"two columns rate it: {', '.join(names)}" if names else f"found {', '.join(header)}"
        raise MaterialError(f"{place}: one column {pair.name!r} is expected, the mean rating on it; {told}")
    meant, sd = found[names[0]], f"{names[0]}{SD}"
    return Rating(pair, names[0], sd if sd in header else "", meant is not None and meant[1])


def rated_in(cells: Mapping[str, str], place: str, columns: Columns, scale: tuple[float, float]) -> Rated | None:
    """What the cells of a texture say, on 0 to 100; None where all of its ratings are empty.

    SDs that do not stand there are NaN (not known), and so many raters 0. Raises MaterialError.
    """
    if not any(cells[each.column] for each in columns.ratings):
        return None
    wide = TOP / (scale[1] - scale[0])
    mean = np.array([_mean(cells, place, each, scale) for each in columns.ratings])
    sd = np.array([_sd(cells, place, each) * wide for each in columns.ratings])
    return Rated(mean, sd, _raters(cells, place))


def _mean(cells: Mapping[str, str], place: str, rating: Rating, scale: tuple[float, float]) -> float:
    low, high = scale
    value = _number(cells, place, rating.column)
    if not low <= value <= high:
        raise MaterialError(
            f"{place}: {rating.column} is {value:g}, a mean rating on the scale from {low:g} to {high:g} is expected"
        )
    share = TOP * (value - low) / (high - low)
    return TOP - share if rating.turned else share


def _sd(cells: Mapping[str, str], place: str, rating: Rating) -> float:
    if not rating.sd or not cells[rating.sd]:
        return math.nan
    value = _number(cells, place, rating.sd)
    if value < 0:
        raise MaterialError(f"{place}: {rating.sd} is {value:g}, an SD of 0 or more is expected")
    return value


def _raters(cells: Mapping[str, str], place: str) -> int:
    if not cells.get(RATERS):
        return 0
    value = _number(cells, place, RATERS)
    if value != int(value) or not 1 <= value <= MOST_RATERS:
        raise MaterialError(f"{place}: raters is {value:g}, a whole number of people is expected")
    return int(value)


def _number(cells: Mapping[str, str], place: str, column: str) -> float:
    try:
        value = float(cells[column])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise MaterialError(f"{place}: {column} is {cells[column]!r}, a finite number is expected")
    return value
