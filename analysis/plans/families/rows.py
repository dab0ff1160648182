"""The rows of a selection that a test can use: those of complete participants, with numbers where needed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
import pandas as pd

from palpate.analysis.plans.answers import Selected, require_columns
from palpate.analysis.ratings.dataset import DataRefused, DeclarationRefused
from palpate.analysis.ratings.design import CellsRefused
from palpate.analysis.statistics.cells import coded, numbers_of
from palpate.analysis.statistics.refusals import listed
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import StatisticSettings
    from palpate.analysis.statistics.cells import Missing

ITEMS = ("attribute", "stimulus")


def parts_of(table: pd.DataFrame, by: tuple[str, ...]) -> Iterator[tuple[dict[str, str], pd.DataFrame]]:
    """Yield the rows of each combination of labels in the order of the labels."""
    if not by:
        yield {}, table
        return
    axes = [coded(table[name], name) for name in by]
    codes = pd.DataFrame({i: axis.codes for i, axis in enumerate(axes)}, index=table.index)
    for key in sorted(set(codes.itertuples(index=False, name=None))):
        labels = {name: str(axis.labels[i]) for name, axis, i in zip(by, axes, key, strict=True)}
        yield labels, table[(codes == list(key)).all(axis=1)]


def with_numbers(table: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """Return the table with these columns as numbers, which may be stored as text. Raises an error for other text."""
    numbers = {name: pd.to_numeric(table[name], errors="coerce").astype("float64") for name in names}
    for name, column in numbers.items():
        if wrong := table.loc[column.isna(), name].unique().tolist():
            raise DeclarationRefused(
                f"column {name!r} holds {wrong[0]!r}, no number; name it in `fixed` to take it as a factor"
            )
    return table.assign(**numbers)


def complete_rows(selected: Selected, settings: StatisticSettings) -> tuple[pd.DataFrame, list[str]]:
    """Return the rows without incomplete participants, as the test's `missing` says, and notes on exclusions."""
    table, lacking = without_gaps(selected.table, "listwise" if settings.missing == "listwise" else "raise")
    if not lacking:
        return table, []
    people = ", ".join(f"{who} ({count(number, 'rating')} missing)" for who, number in lacking.items())
    return table, [f"Left out listwise: {people}."]


def without_gaps(
    table: pd.DataFrame, missing: Literal["raise", "listwise"] = "raise", items: tuple[str, ...] = ITEMS
) -> tuple[pd.DataFrame, dict[str, int]]:
    """Return the rows of those who rated all that others of their `group` rated, and how much each other person lacks.

    In each group every combination of `items` is expected as often as in the participant with most of it; NaN is no
    rating. Raises CellsRefused if someone lacks ratings (unless `missing="listwise"`) and if nobody is left.
    """
    known = table[~np.isnan(numbers_of(table["value"], "value"))].reset_index(drop=True)
    names = [name for name in items if name in table.columns]
    people = [str(label) for label in coded(table["participant"], "participant").labels]
    groups = table["group"].astype(str).tolist() if "group" in table.columns else [""] * len(table)
    group = dict(zip(map(str, table["participant"]), groups, strict=True))
    labels = list(zip(*(known[name].tolist() for name in names), strict=True)) if names else [()] * len(known)
    rated: dict[str, Counter[tuple[object, ...]]] = {who: Counter() for who in people}
    for who, label in zip(known["participant"].astype(str).tolist(), labels, strict=True):
        rated[who][label] += 1
    expected: dict[str, Counter[tuple[object, ...]]] = {}
    for who in people:
        expected[group[who]] = expected.get(group[who], Counter()) | rated[who]
    missing_ratings = {who: (expected[group[who]] - rated[who]).total() for who in people}
    gaps = {who: number for who, number in missing_ratings.items() if number}
    if not gaps:
        return known, {}
    if missing == "raise":
        lines = (f"{who} lacks {count(number, 'rating')}" for who, number in gaps.items())
        raise CellsRefused(
            f"{listed(lines, len(gaps))}; find the ratings, or leave such participants out with `missing: listwise`"
        )
    complete = known[~known["participant"].astype(str).isin(list(gaps))].reset_index(drop=True)
    if not len(complete):
        raise CellsRefused(f"each of {count(len(gaps), 'participant')} lacks a rating; nobody is left listwise")
    return complete, gaps


def refuse_averaging(selected: Selected, factors: Sequence[str]) -> None:
    """Refuse means over stimuli, since two means are of different stimuli if some are missing."""
    if "stimulus" not in selected.table.columns:
        return
    require_columns(selected.table, factors)
    cells = selected.table.groupby(["participant", *factors], observed=True)
    most = int(cells["stimulus"].nunique().max())
    if most > 1:
        raise DataRefused(
            f"a participant's mean in a cell of {' x '.join(factors)} rests on up to {most} stimuli, and some are"
            " missing: means of different stimuli would be compared; name the other factors, too, choose"
            " `missing: listwise`, or ask a test of kind mixed_model with stimulus among its random effects"
        )


def left_out(settings: StatisticSettings) -> Missing:
    """Return how the statistics treat a missing value, by the test's settings."""
    return "listwise" if settings.missing == "listwise" else "raise"


def demand_once(table: pd.DataFrame, names: Sequence[str], level: str) -> None:
    """Refuse several values of one rater in one unit, for a level of measurement that has no mean."""
    if bool(table.duplicated(list(names)).any()):
        *units, rater = names
        raise DataRefused(
            f"several values of one {rater} for one {' and '.join(units)}: values of level {level!r} have no mean; "
            "name more columns in `units`, or keep one with `where`"
        )
