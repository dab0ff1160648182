"""Whether every cell that a test averages is there: a missing one is refused, or its participant is left out."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from palpate.analysis.ratings.dataset import DataRefused, Exclusion, Ratings
from palpate.analysis.ratings.design import check_ratings
from palpate.analysis.ratings.design_report import Kind, Place, Problem
from palpate.protocols.wording import count

SHOWN = 5
ADVICE = "find the ratings, or leave such participants out with --missing listwise"
SEVERAL = (
    "name the ratings that count in an analysis plan: `where: {session: ...}` keeps one session of each participant,"
    " `where: {trial: [...]}` some trials (docs/reference/analysis-plan.md); then palpate regenerate"
)
_FAULTS: Mapping[Kind, tuple[str, str]] = {
    "missing": ("lacks {cells}", ADVICE),
    "duplicate": ("has {cells} filled more often than planned", SEVERAL),
    "undeclared": ("has {cells} that the design does not have", "correct the design or the table"),
}


class CellsRefused(DataRefused):
    """A test's cells do not hold what the design asks for."""


@dataclass(frozen=True)
class Faults:
    """The cells that are missing, filled twice or not of the design, by attribute and participant.

    `owed` is how many cells of one attribute each participant owes, 0 where that differs between groups. `notes` are
    those of the same design check.
    """

    places: Mapping[tuple[str, str], Mapping[Kind, Sequence[Place]]] = field(default_factory=dict)
    owed: int = 0
    notes: tuple[Problem, ...] = ()

    def demand_none(self, attribute: str, participants: Iterable[str], advice: str = ADVICE) -> None:
        """Raise CellsRefused where a cell of the attribute is at fault for one of the participants.

        `advice` is what to do about a missing one.
        """
        people = list(participants)
        for kind, (words, remedy) in _FAULTS.items():
            faulty = {who: places for who in people if (places := self.places.get((attribute, who), {}).get(kind))}
            if faulty:
                lines = [self._line(words, who, places) for who, places in list(faulty.items())[:SHOWN]]
                more = f"; and {count(len(faulty) - SHOWN, 'more participant')}" if len(faulty) > SHOWN else ""
                raise CellsRefused(f"{'; '.join(lines)}{more}; {advice if kind == 'missing' else remedy}")

    def _line(self, words: str, who: str, places: Sequence[Place]) -> str:
        of = f"{len(places):,} of {count(self.owed, 'cell')}" if self.owed else count(len(places), "cell")
        first = _cell(places[0])
        line = f"{who} {words.format(cells=of)}"
        return line + (f" ({'the first: ' if len(places) > 1 else ''}{first})" if first else "")


def cell_faults(ratings: Ratings, by_session: bool = False) -> Faults:
    """Return every cell that the design check forbids to average, none unlisted; `by_session` as `check_ratings`."""
    report = check_ratings(ratings, limit=sys.maxsize, by_session=by_session)
    places: dict[tuple[str, str], dict[Kind, list[Place]]] = {}
    for problem in report.problems:
        for place in problem.listed if problem.kind in _FAULTS else ():
            kinds = places.setdefault((place.cell["attribute"], place.participant), {})
            kinds.setdefault(problem.kind, []).append(place)
    owed, uneven = divmod(report.cells_owed, max(1, report.participants * len(ratings.attributes) * ratings.repeats))
    return Faults(places, 0 if uneven else owed, report.notes)


def without_incomplete(ratings: Ratings) -> Ratings:
    """Return the ratings of participants who filled every owed cell, with a line in `exclusions` for each other.

    Raises DataRefused where nobody is left.
    """
    missing: dict[str, int] = {}
    for (_, who), kinds in cell_faults(ratings).places.items():
        missing[who] = missing.get(who, 0) + len(kinds.get("missing", ()))
    gone = [who for who in ratings.participants if missing.get(who)]
    if not gone:
        return ratings
    if len(gone) == len(ratings.participants):
        raise DataRefused(
            f"data set {ratings.name!r}: nobody is left without incomplete participants: each of"
            f" {count(len(gone), 'participant')} lacks a cell; the design check of a run without --missing names them"
        )
    whose = ratings.table["participant"]
    lines = [
        Exclusion("participant", who, f"incomplete: {count(missing[who], 'cell')} missing", int((whose == who).sum()))
        for who in gone
    ]
    complete = ratings.table[~whose.isin(gone)].reset_index(drop=True)
    return replace(ratings, table=complete, exclusions=(*ratings.exclusions, *lines))


def _cell(place: Place) -> str:
    return ", ".join(f"{column} {level}" for column, level in place.cell.items() if column != "attribute")
