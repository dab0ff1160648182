"""The p value of a test's answer that decides whether a simulated study detects its effect."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from palpate.analysis.plans.families.choices import PsychometricFunction
from palpate.analysis.plans.reading import read_plan
from palpate.analysis.power.request import PowerError
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.shell_command import shell_command
from palpate.studies.catalogue import read_study

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Answer, QuestionResult, Row
    from palpate.analysis.power.request import PowerRequest

P_COLUMNS = ("p_corr", "p_corrected", "p", "p_GG_corr", "p_unc", "p_F")
"""The columns that may have a row's p value, the most conservative first."""
INTERCEPT = "(Intercept)"


class PValue(NamedTuple):
    """A p value, or None and why it is undefined; `by` names its row and column."""

    p: float | None
    why: str = ""
    by: str = ""


def p_of(answer: Answer, test: str, row: str = "", column: str = "") -> PValue:
    """Return the p value of the requested row.

    `row` is the text of a cell of it, or several separated by commas; "" means the first row that is no intercept, or
    the first difference between tracks or conditions where the answer has a table of them.
    Raises PowerError if there is no such row or column, no p value at all, or more than one row.
    """
    match = next((row_of for row_of in answer.rows if INTERCEPT not in row_of.values()), None)
    if row:
        match = _row_with(answer, test, row)
    if match is None:
        raise PowerError(f"{test}: its answer has no row")
    if not row and not column:
        match = next(iter(answer.more.get("differences", ())), match)
    columns = [column] if column else [name for name in P_COLUMNS if name in match]
    known = _p_columns(match)
    if not known:
        what = f"the row {row!r} has" if row else "this test has"
        others = [other for rows in answer.more.values() for other in rows if _p_columns(other)]
        way_out = f"; name a row that has one with --row, as {', '.join(_row_texts(others[0]))!r}" if others else ""
        raise PowerError(f"{test}: {what} no p value, and power is how often p is at most alpha{way_out}")
    if not columns or columns[0] not in match:
        what = f"no column {column!r}" if column else "name the column of its p value with --p"
        raise PowerError(f"{test}: {what}; {nearest(column, known)}")
    value, by = match[columns[0]], ": ".join(filter(None, (", ".join(_row_texts(match)), columns[0])))
    if isinstance(value, int | float) and math.isfinite(value):
        return PValue(float(value), by=by)
    return PValue(None, str(match.get("note") or "p is undefined"), by)


def _p_columns(row: Row) -> Sequence[str]:
    return [name for name in row if name == "p" or name.startswith("p_")]


def demand_p(result: QuestionResult, request: PowerRequest) -> None:
    """Raise PowerError where the answer has no p value as requested; of thresholds it names what plans them instead."""
    answer, settings = result.answer, result.settings
    if answer is None:
        return
    compares = settings.test in ("psychometric", "dprime") and not request.row and not request.column
    if compares and "differences" not in answer.more:
        by_precision = f"; plan the study by the precision of its thresholds: {precision_command(request)}"
        way_out = by_precision if read_study(request.study_file).study.procedure else ""
        raise PowerError(f"{request.test}: it has no p value, since it compares no two tracks{way_out}")
    p_of(answer, request.test, request.row, request.column)


def precision_command(request: PowerRequest) -> str:
    """Return the command that plans the study by precision, with its first test of thresholds (TEST: it has none)."""
    tests = read_plan(request.plan_file).tests
    names = [test.name for test in tests if isinstance(test, PsychometricFunction) and test.of_choices]
    test = request.test if request.test in names else next(iter(names), "TEST")
    return shell_command(
        "power", request.study_file.parent.name, "--test", test, "--trials", "24,48,96", "--lab", request.lab
    )


def _row_with(answer: Answer, test: str, text: str) -> Row:
    """Return the only row with the text, in the answer or else in one of its further tables."""
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
