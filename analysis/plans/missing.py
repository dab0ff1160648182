"""Missing cells of one question: counted, and handled as the plan declares, never averaged away."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import pandas as pd

from palpate.analysis.plans.answers import Missing, Selected
from palpate.analysis.plans.where import Where, keeps, kept_rows
from palpate.analysis.ratings.completeness import CellsRefused, Faults
from palpate.analysis.ratings.design_report import Kind, Place
from palpate.protocols.wording import count

ADVICE = "find the ratings, leave such participants out with `missing: listwise`, or choose `missing: mixed_model`"
WHOLE_CELLS = "name columns of the stimulus or of the participant, which keep or leave a cell for everyone"
FORBIDDEN: tuple[Kind, ...] = ("duplicate", "undeclared")
"""What no policy allows: a cell filled more often than planned, or one that the design does not have."""


@dataclass(frozen=True)
class MissingSummary:
    """What was missing for one question and what was done: participants with gaps, cells missing in all, who left."""

    policy: Missing
    participants: int = 0
    cells: int = 0
    left_out: tuple[str, ...] = ()
    unanswered: tuple[str, ...] = ()

    def text(self) -> str:
        """One sentence, "" where nothing was missing."""
        silent = f"left out without an answer about themselves: {', '.join(self.unanswered)}" if self.unanswered else ""
        if not self.cells:
            return silent
        cells = f"{self.found()}; answered from what is there"
        if self.policy == "listwise":
            cells = f"{self.found()}; left out listwise: {', '.join(self.left_out)}"
        return "; ".join(filter(None, (cells, silent)))

    def found(self) -> str:
        """How much is missing."""
        return f"{count(self.cells, 'cell')} of {count(self.participants, 'participant')} missing"


def handled(
    selected: Selected, faults: Faults, where: Where, policy: Missing, trials: pd.DataFrame
) -> tuple[Selected, MissingSummary]:
    """The selection without incomplete participants (listwise) or as it is (mixed model), and what was missing.

    A cell counts where it lies in the test's `where`, also for somebody who has none of them; `trials` are those of
    the whole study, so that nobody is overlooked. Raises CellsRefused under `refuse`, on cells that are filled
    more often than planned or are not of the design, and where nobody is left.
    """
    people = _asked_about(trials, where)
    gaps: dict[str, int] = {}
    for outcome in selected.outcomes:
        own = _places(outcome, people, faults, where, "missing")
        bad = {who for kind in FORBIDDEN for who in _places(outcome, people, faults, where, kind)}
        if bad or (own and policy == "refuse"):
            faults.demand_none(outcome, sorted(bad or own), ADVICE)
        for who, places in own.items():
            gaps[who] = gaps.get(who, 0) + len(places)
    for who, lost in cells_cut(selected.table, where, trials, people).items():
        if policy == "refuse":
            raise CellsRefused(f"`where` leaves {who} without {count(lost, 'cell')} that others keep; {WHOLE_CELLS}")
        gaps[who] = max(gaps.get(who, 0), lost)
    cells = sum(gaps.values())
    if not gaps or policy == "mixed_model":
        return selected, MissingSummary(policy, len(gaps), cells)
    kept = selected.table[~selected.table["participant"].isin(list(gaps))]
    if not len(kept):
        raise CellsRefused(f"each of {count(len(gaps), 'participant')} lacks a cell; nobody is left listwise")
    rest = replace(selected, table=kept.reset_index(drop=True))
    return rest, MissingSummary(policy, len(gaps), cells, tuple(sorted(gaps)))


def _asked_about(trials: pd.DataFrame, where: Where) -> set[str]:
    """The participants that a test is about: those whom `where` keeps by what is the same in all of their trials."""
    kept = pd.Series(True, index=trials.index)
    for column, wanted in where.items():
        if column in trials.columns and trials.groupby("participant")[column].nunique().max() == 1:
            kept &= kept_rows(trials[column], wanted)
    return set(trials.loc[kept, "participant"])


def cells_cut(table: pd.DataFrame, where: Where, trials: pd.DataFrame, people: Iterable[str]) -> dict[str, int]:
    """The cells that `where` takes from somebody and leaves to others of the same group, as a range of trials does.

    Columns of the stimulus and of the participant cut nothing: they keep or leave a cell for everyone.
    """
    if "stimulus" not in trials.columns or not any(_of_a_meeting(column, trials) for column in where):
        return {}
    named = trials.assign(group="") if "group" not in trials.columns else trials
    group = named.drop_duplicates("participant").set_index("participant")["group"]
    cells = table.groupby(["participant", "attribute", "stimulus"]).size().unstack([1, 2], fill_value=0)
    cells = cells.reindex(sorted(people), fill_value=0)
    most = cells.groupby(group.reindex(cells.index)).transform("max")
    lacking = (most - cells).sum(axis=1)
    return {str(who): int(number) for who, number in lacking.items() if number}


def _of_a_meeting(column: str, trials: pd.DataFrame) -> bool:
    """Whether a column's level is that of one meeting of a participant with a stimulus: trial, block, revised."""
    if column not in trials.columns:
        return column != "attribute"
    return all(trials.groupby(by)[column].nunique().max() > 1 for by in ("participant", "stimulus"))


def _places(outcome: str, people: Iterable[str], faults: Faults, where: Where, kind: Kind) -> dict[str, list[Place]]:
    """The cells at fault in one way for this outcome, by participant."""
    found = {}
    for who in people:
        places = faults.places.get((outcome, who), {}).get(kind, ())
        if lying := [place for place in places if _inside(place, where)]:
            found[who] = lying
    return found


def _inside(place: Place, where: Where) -> bool:
    for column, wanted in where.items():
        level = place.participant if column == "participant" else place.cell.get(column)
        if level is not None and not keeps(wanted, level):
            return False
    return True
