"""The design check reports cells that are missing, filled twice or not finite; it never drops or averages anything.

`check_design` checks a whole table; `CellFaults` are the faulty cells that a test would average: the test is then
refused, or the participants are left out.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import isfinite, prod
from numbers import Real
from typing import Any

import pandas as pd

from palpate.analysis.ratings.dataset import Crossing, DataRefused, Exclusion, Ratings, Scale, natural_key
from palpate.analysis.ratings.design_report import NOTES, DesignReport, Place, Problem, ProblemKind, gathered
from palpate.protocols.lookalikes import looks
from palpate.protocols.wording import count
from palpate.studies.sessions.tables import session_number

__all__ = ["DesignReport", "Place", "Problem", "ProblemKind", "check_design", "check_ratings"]

SHOWN = 5
ADVICE = "find the ratings, or leave such participants out with --missing listwise"
SEVERAL = (
    "name the ratings that count in an analysis plan: `where: {session: ...}` keeps one session of each participant,"
    " `where: {trial: [...]}` some trials (docs/reference/analysis-plan.md); then palpate regenerate"
)
_FAULTS: Mapping[ProblemKind, tuple[str, str]] = {
    "missing": ("lacks {cells}", ADVICE),
    "duplicate": ("has {cells} filled more often than planned", SEVERAL),
    "undeclared": ("has {cells} that the design does not have", "correct the design or the table"),
}
Label = tuple[str, ...]
Observation = tuple[str, tuple[str, ...], object]
MOST_CELLS = 5_000_000
FEWEST_TO_BE_CONSTANT = 3


def check_ratings(ratings: Ratings, *, limit: int = 20, by_session: bool = False) -> DesignReport:
    """Check a data set against its declared cells, or against its own levels if none are declared.

    Where the study declares several sessions, or `by_session` says so, the cells are expected in each session.
    """
    cells, table = ratings.cells, ratings.table
    attributes = {"attribute": ratings.attributes}
    if ratings.sessions is not None and "session" in table and (ratings.sessions > 1 or by_session):
        cells, table = (*cells, "session"), table.assign(session=table["session"].map(session_number))
        attributes["session"] = tuple(str(number) for number in range(1, ratings.sessions + 1))
    nested = [name for name in ("stimulus",) if name in ratings.table.columns and name not in cells]
    return check_design(
        table,
        cells=("attribute", *cells),
        between=ratings.between,
        nested=nested,
        crossings=[Crossing(crossing.between, {**attributes, **crossing.levels}) for crossing in ratings.crossings],
        scale=ratings.scale,
        repeats=ratings.repeats,
        limit=limit,
    )


def check_design(
    table: pd.DataFrame,
    *,
    cells: Sequence[str],
    participant: str = "participant",
    value: str = "value",
    between: Sequence[str] = (),
    nested: Sequence[str] = (),
    crossings: Sequence[Crossing] = (),
    scale: Scale | None = None,
    repeats: int = 1,
    limit: int = 20,
) -> DesignReport:
    """Compare the rows with the full crossing of the columns `cells`, expected of every participant.

    The levels are those of `crossings`, one for each group, or else all that occur within a group of `between`. A cell
    should have `repeats` rows. `nested` columns distinguish rows of one cell but are not crossed (items within a cell):
    as many items are expected as the participant of the group with most of them has. At most `limit` places of a kind
    are listed; all are counted. Raises DataRefused for a missing column.
    """
    groups = tuple(dict.fromkeys((*between, *(name for crossing in crossings for name in crossing.between))))
    labels = list(dict.fromkeys((participant, *cells, *nested, *groups)))
    columns = (*labels, value)
    for column in columns:
        if column not in table.columns:
            known = ", ".join(map(str, table.columns))
            raise DataRefused(f"the design check: no column {column!r}; the columns are {known}")
    rows = _Rows(table[table[labels].notna().all(axis=1)], participant, tuple(cells), tuple(nested), groups)
    plan = _expected_cells(rows, crossings)
    problems = [
        *gathered("no_rows", [] if len(table) else [Place("the table", found="holds no rating")], limit),
        *gathered("unlabelled", _unlabelled_rows(table[labels].isna()), limit),
        *gathered("two_groups", _people_in_two_groups(rows), limit),
        *_cell_problems(rows, plan, value, repeats, limit),
        *value_problems(table, participant, (*cells, *nested), value, scale=scale, limit=limit),
        *gathered("lookalike", list(lookalikes(table, labels)), limit),
    ]
    return DesignReport(
        rows=len(table),
        participants=len(plan),
        cells_expected=sum(prod(map(len, levels.values())) * repeats for levels in plan.values()),
        problems=tuple(problem for problem in problems if problem.kind not in NOTES),
        notes=tuple(problem for problem in problems if problem.kind in NOTES),
    )


def _unlabelled_rows(empty: pd.DataFrame) -> list[Place]:
    """Return the rows without a label and the columns concerned; `empty` is true where a label is missing."""
    return [
        Place(f"row {row + 1}", found="no " + ", ".join(empty.columns[empty.iloc[row]]))
        for row, bad in enumerate(empty.any(axis=1).tolist())
        if bad
    ]


@dataclass(frozen=True)
class _Rows:
    """The labelled rows and the roles of their columns."""

    table: pd.DataFrame
    participant: str
    cells: tuple[str, ...]
    nested: tuple[str, ...]
    groups: tuple[str, ...]

    def labels(self, columns: Sequence[str]) -> list[Label]:
        return list(zip(*(self.table[column].tolist() for column in columns), strict=True))

    def groups_of(self) -> dict[str, list[Label]]:
        """Return each participant's groups, by participant in natural order."""
        levels: dict[str, dict[Label, None]] = {}
        for person, *group in self.labels((self.participant, *self.groups)):
            levels.setdefault(person, {})[tuple(group)] = None
        return {person: list(levels[person]) for person in _in_order(levels)}


def _people_in_two_groups(rows: _Rows) -> list[Place]:
    """Return the participants with rows in several groups, with all of their groups."""
    return [
        Place(
            str(person),
            found=" and ".join(
                ", ".join(map(" ".join, zip(rows.groups, map(str, own), strict=True))) for own in several
            ),
        )
        for person, several in rows.groups_of().items()
        if len(several) > 1
    ]


Plan = Mapping[str, Mapping[str, tuple[str, ...]]]


def _in_order(levels: Mapping[str, object] | set[str]) -> list[str]:
    return sorted(levels, key=lambda level: natural_key(str(level)))


def _expected_cells(rows: _Rows, crossings: Sequence[Crossing]) -> Plan:
    """Return the levels expected of each participant; one in two groups has those of the first, and is reported."""
    seen: dict[Label, dict[str, set[str]]] = {}
    for label in rows.labels((*rows.groups, *rows.cells)):
        group, cell = label[: len(rows.groups)], label[len(rows.groups) :]
        levels_of = seen.setdefault(group, {name: set() for name in rows.cells})
        for name, level in zip(rows.cells, cell, strict=True):
            levels_of[name].add(level)
    by_group: dict[Label, dict[str, tuple[str, ...]]] = {}
    for group, levels in seen.items():
        own = dict(zip(rows.groups, group, strict=True))
        declared: Mapping[str, tuple[str, ...]] = next(
            (crossing.levels for crossing in crossings
             if all(own[name] == level for name, level in crossing.between.items())), {},
        )  # fmt: skip
        by_group[group] = {
            name: declared[name] if name in declared else tuple(_in_order(levels[name])) for name in rows.cells
        }
    return {person: by_group[groups[0]] for person, groups in rows.groups_of().items()}


def _cell_problems(rows: _Rows, plan: Plan, value: str, repeats: int, limit: int) -> list[Problem]:
    width = 1 + len(rows.cells)
    keys = rows.labels((rows.participant, *rows.cells, *rows.nested))
    filled = Counter(key[:width] for key in keys)
    # A column that is no factor, such as a time, would cross to more cells than there is memory.
    cells = sum(prod(map(len, levels.values())) for levels in plan.values())
    if cells > MOST_CELLS:
        widest = max((column for levels in plan.values() for column in levels.items()), key=lambda item: len(item[1]))
        raise DataRefused(
            f"the design check: the factors cross to {cells:,} cells, at most {MOST_CELLS:,} are expected;"
            f" {widest[0]!r} has {len(widest[1]):,} levels: is it a factor?"
        )
    expected = {(person, *cell): repeats for person, levels in plan.items() for cell in product(*levels.values())}
    if rows.nested and repeats == 1:
        # As many different items in a cell as the participant of the group with most of them has, at least one.
        group_of = {person: groups[0] for person, groups in rows.groups_of().items()}
        most: dict[Label, int] = {}
        for key, items in Counter(key[:width] for key in set(keys)).items():
            cell = (*group_of[key[0]], *key[1:])
            most[cell] = max(items, most.get(cell, 1))
        expected = {key: most.get((*group_of[key[0]], *key[1:]), 1) for key in expected}
    missing = [
        _place(rows, key, f"{filled[key]} of {planned} ratings" if planned > 1 else "")
        for key, planned in expected.items()
        if filled[key] < planned
    ]
    strange = [_place(rows, key, count(filled[key], "rating")) for key in filled if key not in expected]
    values: dict[Label, list[object]] = {}
    for key, number in zip(keys, rows.table[value].tolist(), strict=True):
        values.setdefault(key, []).append(number)
    places = []
    for key, numbers in values.items():
        if len(numbers) > repeats:
            texts = [f"{rating:.10g}" if isinstance(rating, float) else str(rating) for rating in numbers[:5]]
            listed = ", ".join(texts) + (", ..." if len(numbers) > 5 else "")
            places.append(_place(rows, key, f"{count(len(numbers), 'rating')} ({listed}), {repeats} planned"))
    return [
        *gathered("missing", missing, limit),
        *gathered("undeclared", strange, limit),
        *gathered("duplicate", places, limit),
    ]


def _place(rows: _Rows, key: Label, found: str) -> Place:
    columns = (*rows.cells, *rows.nested)
    return Place(str(key[0]), dict(zip(columns, map(str, key[1:]), strict=False)), found)


def value_problems(
    table: pd.DataFrame, participant: str, cells: Sequence[str], value: str, *, scale: Scale | None, limit: int
) -> list[Problem]:
    """Return every value that is not finite, off the scale or off its steps, and every constant rater."""
    rows: list[Observation] = [
        (str(person), tuple(map(str, cell)), number)
        for person, number, *cell in zip(*(table[c].tolist() for c in (participant, value, *cells)), strict=True)
    ]

    def places(wrong: Callable[[object], bool]) -> list[Place]:
        bad = (row for row in rows if wrong(row[2]))
        return [Place(who, dict(zip(cells, cell, strict=True)), f"{number}") for who, cell, number in bad]

    def off_step(number: Any) -> bool:
        return scale is not None and _finite(number) and scale.holds(float(number)) and not scale.on_step(float(number))

    def is_outside(number: Any) -> bool:
        return scale is not None and _finite(number) and not scale.holds(float(number))

    return [
        *gathered("non_finite", places(lambda number: not _finite(number)), limit),
        *gathered("out_of_scale", places(is_outside), limit),
        *gathered("off_step", places(off_step), limit),
        *_constant(rows, cells, limit),
    ]


def _finite(number: object) -> bool:
    return isinstance(number, Real) and isfinite(float(number))


def _constant(rows: Sequence[Observation], cells: Sequence[str], limit: int) -> list[Problem]:
    """Return constant raters, and for the others the attributes that they rate constantly: reported, never excluded."""
    everywhere: dict[str, list[object]] = {}
    by_attribute: dict[tuple[str, str], list[object]] = {}
    column = cells.index("attribute") if "attribute" in cells else None
    for person, cell, number in rows:
        everywhere.setdefault(person, []).append(number)
        if column is not None:
            by_attribute.setdefault((person, cell[column]), []).append(number)
    people = {person for person, values in everywhere.items() if _same(values)}
    return [
        *gathered("constant_rater", [Place(p, found=_all(everywhere[p])) for p in everywhere if p in people], limit),
        *gathered(
            "constant_attribute",
            [
                Place(person, {"attribute": attribute}, _all(values))
                for (person, attribute), values in by_attribute.items()
                if person not in people and _same(values)
            ],
            limit,
        ),
    ]


def _same(values: Sequence[object]) -> bool:
    return len(values) >= FEWEST_TO_BE_CONSTANT and _finite(values[0]) and len(set(values)) == 1


def _all(values: Sequence[object]) -> str:
    return f"all {len(values)} ratings are {values[0]:g}"


def lookalikes(table: pd.DataFrame, columns: Sequence[str]) -> Iterator[Place]:
    """Yield the sets of labels in one column that differ only in the spelling of a number, a letter or a blank."""
    for column in columns:
        alike: dict[str, set[str]] = {}
        for label in table[column].dropna().unique().tolist():
            alike.setdefault(looks(str(label)), set()).add(str(label))
        for labels in alike.values():
            if len(labels) > 1:
                yield Place(column, found=" and ".join(ascii(label) for label in sorted(labels)))


class CellsRefused(DataRefused):
    """A test's cells do not match the design."""


@dataclass(frozen=True)
class CellFaults:
    """The cells that are missing, filled twice or not in the design, by attribute and participant.

    `expected` is how many cells of one attribute each participant should have, 0 where that differs between groups.
    `notes` are those of the same design check.
    """

    places: Mapping[tuple[str, str], Mapping[ProblemKind, Sequence[Place]]] = field(default_factory=dict)
    expected: int = 0
    notes: tuple[Problem, ...] = ()

    def demand_none(self, attribute: str, participants: Iterable[str], advice: str = ADVICE) -> None:
        """Raise CellsRefused if a cell of the attribute is faulty for one of the participants.

        `advice` is what to do about a missing cell.
        """
        people = list(participants)
        for kind, (words, remedy) in _FAULTS.items():
            faulty = {who: places for who in people if (places := self.places.get((attribute, who), {}).get(kind))}
            if faulty:
                lines = []
                for who, places in list(faulty.items())[:SHOWN]:
                    several = count(len(places), "cell")
                    if self.expected:
                        several = f"{len(places):,} of {count(self.expected, 'cell')}"
                    cell = places[0].cell
                    first = ", ".join(f"{column} {level}" for column, level in cell.items() if column != "attribute")
                    where = f" ({'the first: ' if len(places) > 1 else ''}{first})" if first else ""
                    lines.append(f"{who} {words.format(cells=several)}{where}")
                more = f"; and {count(len(faulty) - SHOWN, 'more participant')}" if len(faulty) > SHOWN else ""
                raise CellsRefused(f"{'; '.join(lines)}{more}; {advice if kind == 'missing' else remedy}")


def cell_faults(ratings: Ratings, by_session: bool = False) -> CellFaults:
    """Return every cell that the design check does not allow to average; `by_session` is as for `check_ratings`."""
    report = check_ratings(ratings, limit=sys.maxsize, by_session=by_session)
    places: dict[tuple[str, str], dict[ProblemKind, list[Place]]] = {}
    for problem in report.problems:
        for place in problem.listed if problem.kind in _FAULTS else ():
            kinds = places.setdefault((place.cell["attribute"], place.participant), {})
            kinds.setdefault(problem.kind, []).append(place)
    expected, uneven = divmod(
        report.cells_expected, max(1, report.participants * len(ratings.attributes) * ratings.repeats)
    )
    return CellFaults(places, 0 if uneven else expected, report.notes)


def without_incomplete(ratings: Ratings) -> Ratings:
    """Return the ratings of participants who filled every expected cell, and an exclusion for every other participant.

    Raises DataRefused if nobody is left.
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
            f" {count(len(gone), 'participant')} lacks a cell; the design check without --missing names them"
        )
    whose = ratings.table["participant"]
    lines = [
        Exclusion("participant", who, f"incomplete: {count(missing[who], 'cell')} missing", int((whose == who).sum()))
        for who in gone
    ]
    complete = ratings.table[~whose.isin(gone)].reset_index(drop=True)
    return replace(ratings, table=complete, exclusions=(*ratings.exclusions, *lines))
