"""What qualifies every number of a data set, in lines: the one place that collects it for console, JSON and reports."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby

from palpate.analysis.ratings.dataset import Exclusion
from palpate.analysis.ratings.design_report import Place, Problem
from palpate.protocols.wording import count

MOST_PLACES = 20
MOST_ALIKE = 3
"""More exclusions of one kind with the same reason are one counted line."""


def data_notes(
    notes: Sequence[Problem], exclusions: Sequence[Exclusion], sessions: int | None = None
) -> tuple[str, ...]:
    """Return the notes of the design check (look-alike labels, constant raters), and what was averaged or no rating.

    `sessions`: how many sessions of each participant the study declares (None: the rows know no sessions).
    """
    merged = [line for line in exclusions if line.what == "averaged"]
    rows = sum(line.rows for line in exclusions if line.what == "rows")
    lines = [replace(note, listed=tuple(sorted(note.listed, key=Place.text)[:MOST_PLACES])).text() for note in notes]
    if merged:
        ratings, means = sum(line.rows for line in merged), sum(line.into for line in merged)
        lines.append(f"{count(ratings, 'repeated rating')} averaged into {means:,} (the exclusion ledger says whose)")
    if sessions is not None and sessions > 1:
        lines.append(
            f"The answers of each participant's {sessions} sessions are averaged, except where a plan's test names"
            " `session` (as a factor, or as `where: {session: 1}`)"
        )
    if rows:
        lines.append(f"{count(rows, 'row')} of the table left out as no rating (the exclusion ledger says why)")
    return tuple(lines)


def exclusion_lines(exclusions: Iterable[Exclusion]) -> Iterator[str]:
    """Yield each exclusion as a line; many that are alike are one counted line, so that others are seen."""
    ordered = sorted(exclusions, key=lambda line: (line.what, line.why, line.rows))
    for (what, why, rows), own in groupby(ordered, key=lambda line: (line.what, line.why, line.rows)):
        whose = [line.who for line in own]
        if len(whose) > MOST_ALIKE:
            yield f"{what} of {whose[0]} and {len(whose) - 1:,} more ({rows:,} each): {why}"
        else:
            yield from (f"{what} of {who} ({rows:,}): {why}" for who in whose)
