"""Which number of an answer decides whether a simulated study found its effect."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from palpate.analysis.plans.answers import Answer, Row
from palpate.protocols.did_you_mean import nearest

P_COLUMNS = ("p_corr", "p_corrected", "p", "p_GG_corr", "p_unc", "p_F")
"""Where a row's p value stands, the most cautious first."""
INTERCEPT = "(Intercept)"


class PValue(NamedTuple):
    """A p value, or None and why it is undefined; `by` names the row and the column that it stands in."""

    p: float | None
    why: str = ""
    by: str = ""


def p_of(answer: Answer, test: str, row: str = "", column: str = "") -> PValue:
    """Return the p value of the row that is meant.

    `row` is text that a cell of it holds, or several such divided by commas; "" takes the first row that is no
    intercept. Raises PowerError where there is no such row or column, no p value at all, or more rows than one.
    """
    match = next((row_of for row_of in answer.rows if INTERCEPT not in row_of.values()), None)
    if row:
        match = _row_with(answer, test, row)
    if match is None:
        raise PowerError(f"{test}: its answer has no row")
    columns = [column] if column else [name for name in P_COLUMNS if name in match]
    known = [name for name in match if name == "p" or name.startswith("p_")]
    if not known:
        what = f"the row {row!r} has" if row else "this test has"
        raise PowerError(f"{test}: {what} no p value, and power is how often p is at most alpha")
    if not columns or columns[0] not in match:
        what = f"no column {column!r}" if column else "name the column of its p value with --p"
        raise PowerError(f"{test}: {what}; {nearest(column, known)}")
    value, by = match[columns[0]], f"{', '.join(_row_texts(match))}: {columns[0]}"
    if isinstance(value, int | float) and math.isfinite(value):
        return PValue(float(value), by=by)
    return PValue(None, str(match.get("note") or "p is undefined"), by)


def _row_with(answer: Answer, test: str, text: str) -> Row:
    """Return the one row of the answer that holds the text; else one of its further tables, as a model's tests of
    effects.
    """
    for rows in (answer.rows, *answer.more.values()):
        matches = []
        for row in rows:
            texts = _row_texts(row)
            if text in texts or all(part.strip() in texts for part in text.split(",")):
                matches.append(row)
        if len(matches) == 1:
            return matches[0]
        if matches:
            matches_text = "; ".join(", ".join(_row_texts(row)) for row in matches[:4])
            raise PowerError(
                f"{test}: {len(matches)} rows hold {text!r} ({matches_text}{'; ...' if len(matches) > 4 else ''});"
                " name one, its texts divided by commas"
            )
    known = dict.fromkeys(text for row in answer.rows for text in _row_texts(row))
    raise PowerError(f"{test}: no row with {text!r}; {nearest(text, known)}")


def _row_texts(row: Row) -> Sequence[str]:
    return [value for name, value in row.items() if isinstance(value, str) and value and name != "note"]


class PowerError(ValueError):
    """The power of this test cannot be simulated as requested."""
