"""The results of a design check: typed problems with places, and notes that qualify all numbers of a data set."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Literal

from palpate.analysis.ratings.dataset import Exclusion
from palpate.protocols.wording import count

ProblemKind = Literal[
    "no_rows", "unlabelled", "two_groups", "undeclared", "missing", "duplicate", "non_finite", "out_of_scale",
    "off_step", "constant_rater", "constant_attribute", "lookalike",
]  # fmt: skip
MOST_PLACES = 20
MOST_ALIKE = 3
"""The number of similar exclusions above which they become one counted line."""
NOTES: frozenset[ProblemKind] = frozenset({"constant_rater", "constant_attribute", "lookalike"})

_TITLES: Mapping[ProblemKind, tuple[str, str]] = {
    "no_rows": ("table", "without a row"),
    "unlabelled": ("row", "without a participant or a level"),
    "two_groups": ("participant", "in more than one group"),
    "undeclared": ("cell", "that the design does not have"),
    "missing": ("missing cell", ""),
    "duplicate": ("cell", "filled more often than planned"),
    "non_finite": ("value", "that is not a finite number"),
    "out_of_scale": ("value", "outside the scale"),
    "off_step": ("value", "between the steps of the scale"),
    "constant_rater": ("participant", "who gave one value throughout"),
    "constant_attribute": ("attribute", "on which a participant gave one value throughout"),
    "lookalike": ("set", "of labels that look alike and count as different"),
}
_MANY: Mapping[ProblemKind, str] = {"non_finite": "that are not finite numbers"}


@dataclass(frozen=True)
class Place:
    """The place of a problem: a participant, the cell by its columns, and what was found."""

    participant: str
    cell: Mapping[str, str] = field(default_factory=dict)
    found: str = ""

    def text(self) -> str:
        """Return one line: participant, cell, finding."""
        cell = [f"{column} {level}" for column, level in self.cell.items()]
        where = ", ".join([self.participant, *cell])
        return f"{where}: {self.found}" if self.found else where


@dataclass(frozen=True)
class Problem:
    """All places with one kind of problem: their number, and the first ones."""

    kind: ProblemKind
    count: int
    listed: tuple[Place, ...]

    @property
    def title(self) -> str:
        """The number of places and their problem: `2 cells filled more often than planned`."""
        thing, shared = _TITLES[self.kind]
        if self.count != 1:
            shared = _MANY.get(self.kind, shared)
        return f"{count(self.count, thing)} {shared}".rstrip()

    def text(self) -> str:
        """Return a headline with the count, then one line for each listed place."""
        lines = [f"{self.title}:", *(f"  {place.text()}" for place in self.listed)]
        if self.count > len(self.listed):
            lines.append(f"  ... and {self.count - len(self.listed):,} more")
        return "\n".join(lines)


@dataclass(frozen=True)
class DesignReport:
    """The result of the check: `problems` prevent a statistic, `notes` are for a person to decide on."""

    rows: int
    participants: int
    cells_expected: int
    problems: tuple[Problem, ...]
    notes: tuple[Problem, ...]

    @property
    def ok(self) -> bool:
        """Whether every expected cell has exactly its finite, allowed values."""
        return not self.problems

    def of(self, kind: ProblemKind) -> Problem | None:
        """Return the problem or note of one kind, or None."""
        return next((problem for problem in (*self.problems, *self.notes) if problem.kind == kind), None)

    def text(self) -> str:
        """Return the report for a terminal."""
        verdict = "complete" if self.ok else "not usable as it is"
        people, given = count(self.participants, "participant"), count(self.rows, "rating")
        head = f"{people}, {given}, {count(self.cells_expected, 'cell')} owed: {verdict}"
        return "\n".join([head, *(problem.text() for problem in (*self.problems, *self.notes))])


def gathered(kind: ProblemKind, places: Sequence[Place], limit: int) -> list[Problem]:
    """Return the places as one problem, or none without places."""
    return [Problem(kind, len(places), tuple(places[:limit]))] if places else []


def data_notes(
    notes: Sequence[Problem], exclusions: Sequence[Exclusion], sessions: int | None = None
) -> tuple[str, ...]:
    """Return the notes of the design check (similar labels, constant raters), and on averaged and discarded rows.

    `sessions`: how many sessions of each participant the study declares (None: rows without sessions).
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
    """Yield each exclusion as a line; many similar ones become one counted line, so that others are noticed."""
    ordered = sorted(exclusions, key=lambda line: (line.what, line.why, line.rows))
    for (what, why, rows), own in groupby(ordered, key=lambda line: (line.what, line.why, line.rows)):
        whose = [line.who for line in own]
        if len(whose) > MOST_ALIKE:
            yield f"{what} of {whose[0]} and {len(whose) - 1:,} more ({rows:,} each): {why}"
        else:
            yield from (f"{what} of {who} ({rows:,}): {why}" for who in whose)
