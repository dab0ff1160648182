"""What the answers of all families share: rows of plain values, columns that must be there, notes."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd

from palpate.analysis.plans.answers import Answer, Row, Selected, Value
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.apa import number
from palpate.analysis.statistics.cells import coded, numbers_of
from palpate.analysis.statistics.refusals import listed
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.undefined import finite_or_none, nan_to_none
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import StatisticSettings
    from palpate.analysis.statistics.cells import Missing

ITEMS = ("attribute", "stimulus")
CORRECTED = {"holm": "Holm", "bonferroni": "Bonferroni", "none": "not adjusted"}


def require_columns(table: pd.DataFrame, names: Iterable[str]) -> None:
    """Refuse a column that the table lacks, naming the nearest."""
    for name in names:
        if name not in table.columns:
            raise DataRefused(f"no column {name!r}; {nearest(name, map(str, table.columns))}")


def with_numbers(table: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
    """Return the table with these columns, which may hold numbers as text, as numbers; refuse what is no number."""
    numbers = {name: pd.to_numeric(table[name], errors="coerce").astype("float64") for name in names}
    for name, column in numbers.items():
        if wrong := table.loc[column.isna(), name].unique().tolist():
            raise DataRefused(
                f"column {name!r} holds {wrong[0]!r}, no number; name it in `fixed` to take it as a factor"
            )
    return table.assign(**numbers)


def complete_rows(selected: Selected, settings: StatisticSettings) -> tuple[pd.DataFrame, list[str]]:
    """Return the rows without incomplete participants, as the test's `missing` says, and notes on who was left out."""
    if settings.missing == "mixed_model":
        raise DataRefused("this test has no form that takes gaps; choose `missing: listwise`, or a mixed_model test")
    table, lacking = without_gaps(selected.table, "listwise" if settings.missing == "listwise" else "raise")
    if not lacking:
        return table, []
    people = ", ".join(f"{who} ({count(number, 'rating')} missing)" for who, number in lacking.items())
    return table, [f"Left out listwise: {people}."]


def without_gaps(
    table: pd.DataFrame, missing: Literal["raise", "listwise"] = "raise", items: tuple[str, ...] = ITEMS
) -> tuple[pd.DataFrame, dict[str, int]]:
    """Return the rows of who rated all that others of their `group` rated, and how much each other person lacks.

    What is expected in each group is every combination of `items` as often as the participant with most of it rated it;
    a value of NaN is no rating. Raises DataRefused where someone lacks ratings (unless `missing="listwise"`) and where
    nobody is left.
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
        raise DataRefused(
            f"{listed(lines, len(gaps))}; find the ratings, or leave such participants out with `missing: listwise`"
        )
    complete = known[~known["participant"].astype(str).isin(list(gaps))].reset_index(drop=True)
    if not len(complete):
        raise DataRefused(f"each of {count(len(gaps), 'participant')} lacks a rating; nobody is left listwise")
    return complete, gaps


def answer_of(
    selected: Selected,
    rows: Sequence[Row],
    method: str,
    kinds: Mapping[str, str],
    *,
    table: pd.DataFrame | None = None,
    headline: str = "",
    notes: Iterable[str] = (),
    more: Mapping[str, tuple[Row, ...]] | None = None,
) -> Answer:
    """Return an answer that counts its participants and values itself; `table` is what was used, where not all was."""
    used = selected.table if table is None else table
    return Answer(
        rows=tuple(rows),
        method=method,
        kinds=kinds,
        participants=int(used["participant"].nunique()),
        values=int(used["value"].notna().sum()),
        headline=headline,
        notes=tuple(note for note in notes if note),
        more=more or {},
    )


def plain_rows(table: pd.DataFrame, finite: bool = False) -> tuple[Row, ...]:
    """Return the rows of a result with None for an undefined number, and for an infinite one where `finite`."""
    return tuple(plain_row(row, finite) for row in table.to_dict("records"))


def plain_row(row: Mapping[Any, Any], finite: bool = False) -> Row:
    """Return one row as `plain_rows` does."""
    return {str(name): plain_value(value, finite) for name, value in row.items()}


def plain_value(value: Any, finite: bool = False) -> Value:
    """Return a value as a result table holds it; the parts of a label of several are joined with ", "."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, float):
        return finite_or_none(float(value)) if finite else nan_to_none(float(value))
    if isinstance(value, int | tuple):
        return value if isinstance(value, int) else ", ".join(map(str, value))
    return plain_value(value.item(), finite) if hasattr(value, "item") else str(value)


def sample_kinds(confidence: float, correction: str) -> dict[str, str]:
    """Return what each column of a one-sample t test is."""
    return {
        "n": "participants",
        "sd": "SD over participants",
        "ci_low": share(confidence, "interval of the mean, Student's t"),
        "ci_high": share(confidence, "interval of the mean, Student's t"),
        "t": "one-sample t against 0",
        "df": "degrees of freedom",
        "dz": "dz = mean / SD",
        "p": "two-sided p, not adjusted",
        "p_corrected": f"two-sided p, {CORRECTED[correction]}",
        "family_size": "tests in the family",
    }


def share(confidence: float, words: str) -> str:
    """Return `95% interval ...`, as the APA writes it."""
    return f"{100 * confidence:g}% {words}"


def averaged_note(least: int, most: int) -> str:
    """Return a note on what a participant's mean rests on, "" where it is one rating each."""
    if most <= 1:
        return ""
    many = f"{most}" if least == most else f"{least} to {most}"
    return f"Each participant's {many} ratings in a cell were averaged first."


def turned_note(names: Sequence[str], selected: Selected) -> list[str]:
    """Return a note on the attributes that were turned round, and about what; none where none were."""
    if not names:
        return []
    about = "0" if selected.scale is None else f"{(selected.scale[0] + selected.scale[1]) / 2:g}"
    return [f"Turned round about {about} before averaging: {', '.join(names)}."]


def refuse_averaging(selected: Selected, factors: Sequence[str]) -> None:
    """Refuse means over stimuli: with some of them missing, two means are about different stimuli."""
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
    """Return how the statistics treat a missing value under what the test declares."""
    return "listwise" if settings.missing == "listwise" else "raise"


def table_notes(table: pd.DataFrame) -> tuple[str, str]:
    """Return how many ratings were averaged for each value of a result, and who was left out of it; "" for nothing."""
    least, most = table.attrs.get("ratings_per_cell", (1, 1))
    dropped = table.attrs.get("dropped", [])
    left_out = f"Left out listwise: {', '.join(map(str, dropped))}." if dropped else ""
    return averaged_note(least, most), left_out


def coefficient(value: float) -> str:
    """Return a coefficient that is at most 1 as APA writes it: .29, −.05, 1.00."""
    return re.sub(r"^(−?)0\.", r"\1.", number(value)) if math.isfinite(value) else "undefined"


def with_interval(name: str, value: Any, low: Any, high: Any, confidence: float) -> str:
    """Return a coefficient with its interval, if it has one: ICC(A,1) = .29, 95% CI [.02, .76]."""
    value, low, high = (plain_value(part, finite=True) for part in (value, low, high))
    if not isinstance(value, float):
        return f"{name} is undefined"
    text = f"{name} = {coefficient(value)}"
    if not (isinstance(low, float) and isinstance(high, float)):
        return text
    return f"{text}, {confidence:.0%} CI [{coefficient(low)}, {coefficient(high)}]"


def averaged(values_per_cell: tuple[int, int]) -> tuple[str, ...]:
    """Return the note on cells that are means of several values."""
    least, most = values_per_cell
    if most <= 1:
        return ()
    many = str(most) if least == most else f"{least} to {most}"
    return (f"Each cell is the mean of {many} values.",)


def demand_once(table: pd.DataFrame, names: Sequence[str], level: str) -> None:
    """Refuse several values of one rater in one unit, at a level of measurement that has no mean."""
    if bool(table.duplicated(list(names)).any()):
        *units, rater = names
        raise DataRefused(
            f"several values of one {rater} for one {' and '.join(units)}: values of level {level!r} have no mean; "
            "name more columns in `units`, or keep one with `where`"
        )
