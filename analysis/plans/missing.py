"""Missing cells of one question: counted, and handled as the plan declares, never averaged away."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from analysis.plans.answers import Missing, Selected
from analysis.ratings.completeness import CellsRefused, Faults
from analysis.ratings.design_report import Kind, Place
from analysis.ratings.wording import count

FORBIDDEN: tuple[Kind, ...] = ("duplicate", "undeclared")
"""What no policy allows: a cell filled more often than planned, or one that the design does not have."""


@dataclass(frozen=True)
class MissingTold:
    """What was missing for one question and what was done: participants with gaps, cells missing in all, who left."""

    policy: Missing
    participants: int = 0
    cells: int = 0
    left_out: tuple[str, ...] = ()

    def text(self) -> str:
        """One sentence, "" where nothing was missing."""
        if not self.cells:
            return ""
        found = f"{count(self.cells, 'cell')} of {count(self.participants, 'participant')} missing"
        if self.policy == "listwise":
            return f"{found}; left out listwise: {', '.join(self.left_out)}"
        return f"{found}; answered by a linear mixed model on what is there"


def handled(
    selected: Selected, faults: Faults, where: Mapping[str, str | tuple[str, ...]], policy: Missing
) -> tuple[Selected, MissingTold]:
    """The selection without incomplete participants (listwise) or as it is (mixed model), and what was missing.

    A cell counts where it lies in the test's `where`. Raises CellsRefused under `refuse`, on cells that are filled
    more often than planned or are not of the design, and where nobody is left.
    """
    people = set(selected.trials["participant"])
    gaps: dict[str, int] = {}
    for outcome in selected.outcomes:
        own = _places(outcome, people, faults, where, "missing")
        bad = {who for kind in FORBIDDEN for who in _places(outcome, people, faults, where, kind)}
        if bad or (own and policy == "refuse"):
            faults.demand_none(outcome, sorted(bad or own))
        for who, places in own.items():
            gaps[who] = gaps.get(who, 0) + len(places)
    cells = sum(gaps.values())
    if not gaps or policy == "mixed_model":
        return selected, MissingTold(policy, len(gaps), cells)
    kept = selected.table[~selected.table["participant"].isin(list(gaps))]
    if not len(kept):
        raise CellsRefused(f"each of {count(len(gaps), 'participant')} lacks a cell; nobody is left listwise")
    rest = replace(selected, table=kept.reset_index(drop=True))
    return rest, MissingTold(policy, len(gaps), cells, tuple(sorted(gaps)))


def _places(
    outcome: str, people: Iterable[str], faults: Faults, where: Mapping[str, str | tuple[str, ...]], kind: Kind
) -> dict[str, list[Place]]:
    """The cells at fault in one way for this outcome, by participant."""
    found = {}
    for who in people:
        places = faults.places.get((outcome, who), {}).get(kind, ())
        if lying := [place for place in places if _inside(place, where)]:
            found[who] = lying
    return found


def _inside(place: Place, where: Mapping[str, str | tuple[str, ...]]) -> bool:
    for column, wanted in where.items():
        level = place.participant if column == "participant" else place.cell.get(column)
        levels = (wanted,) if isinstance(wanted, str) else wanted
        if level is not None and level not in levels:
            return False
    return True
