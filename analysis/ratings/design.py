"""The design check: which cells are missing, filled twice or not finite. It reports; it never drops or averages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

import pandas as pd

from palpate.analysis.ratings.dataset import Crossing, DataRefused, Ratings, Scale, natural_key
from palpate.analysis.ratings.design_report import NOTES, DesignReport, Kind, Place, Problem, gathered
from palpate.analysis.ratings.design_values import value_problems
from palpate.analysis.ratings.lookalikes import lookalikes
from palpate.protocols.wording import count
from palpate.studies.tables import session_number

__all__ = ["DesignReport", "Kind", "Place", "Problem", "check_design", "check_ratings"]

Label = tuple[str, ...]
MOST_CELLS = 5_000_000


def check_ratings(ratings: Ratings, *, limit: int = 20, by_session: bool = False) -> DesignReport:
    """The design check of a data set against its declared cells, or against its own levels where none are declared.

    Where the study declares several sessions, or `by_session` says so, each session owes the cells.
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
        crossings=[Crossing(each.between, {**attributes, **each.levels}) for each in ratings.crossings],
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
    """Compare the rows with the full crossing of the columns `cells`, which every participant owes.

    The levels are those of `crossings`, one for each group, or else all that occur within a group of `between`.
    A cell is owed `repeats` rows. `nested` columns tell rows of one cell apart but are not crossed (items that
    belong to one cell): there it is owed as many items as the participant of the group with most of them has.
    At most `limit` places of a kind are listed; all are counted.
    Raises DataRefused where a column is not there.
    """
    groups = tuple(dict.fromkeys((*between, *(name for each in crossings for name in each.between))))
    labels = list(dict.fromkeys((participant, *cells, *nested, *groups)))
    _demand_columns(table, [*labels, value])
    rows = _Rows(table[table[labels].notna().all(axis=1)], participant, tuple(cells), tuple(nested), groups)
    plan = _owed_cells(rows, crossings)
    found = [
        *gathered("no_rows", [] if len(table) else [Place("the table", found="holds no rating")], limit),
        *_unlabelled(table, labels, limit),
        *gathered("two_groups", list(_two_groups(rows)), limit),
        *_cell_problems(rows, plan, value, repeats, limit),
        *value_problems(table, participant, (*cells, *nested), value, scale=scale, limit=limit),
        *gathered("lookalike", list(lookalikes(table, labels)), limit),
    ]
    return DesignReport(
        rows=len(table),
        participants=len(plan),
        cells_owed=sum(prod(map(len, levels.values())) * repeats for levels in plan.values()),
        problems=tuple(each for each in found if each.kind not in NOTES),
        notes=tuple(each for each in found if each.kind in NOTES),
    )


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
        """Each participant's groups, the participants in natural order."""
        found: dict[str, dict[Label, None]] = {}
        for person, *group in self.labels((self.participant, *self.groups)):
            found.setdefault(person, {})[tuple(group)] = None
        return {person: list(found[person]) for person in _in_order(found)}


Plan = Mapping[str, Mapping[str, tuple[str, ...]]]


def _demand_columns(table: pd.DataFrame, columns: Sequence[str]) -> None:
    for column in columns:
        if column not in table.columns:
            known = ", ".join(map(str, table.columns))
            raise DataRefused(f"the design check: no column {column!r}; the columns are {known}")


def _in_order(levels: Mapping[str, object] | set[str]) -> list[str]:
    return sorted(levels, key=lambda level: natural_key(str(level)))


def _unlabelled(table: pd.DataFrame, labels: list[str], limit: int) -> list[Problem]:
    empty = table[labels].isna()
    rows = [row for row, bad in enumerate(empty.any(axis=1).tolist()) if bad]
    return gathered(
        "unlabelled",
        [Place(f"row {row + 1}", found="no " + ", ".join(empty.columns[empty.iloc[row]])) for row in rows],
        limit,
    )


def _two_groups(rows: _Rows) -> Iterator[Place]:
    for person, groups in rows.groups_of().items():
        if len(groups) > 1:
            yield Place(str(person), found=" and ".join(_group_text(rows.groups, group) for group in groups))


def _group_text(columns: Sequence[str], group: Label) -> str:
    return ", ".join(f"{column} {level}" for column, level in zip(columns, group, strict=True))


def _owed_cells(rows: _Rows, crossings: Sequence[Crossing]) -> Plan:
    """The levels that each participant owes; one in two groups owes those of the first, and is reported."""
    seen = _observed_levels(rows)
    by_group: dict[Label, dict[str, tuple[str, ...]]] = {}
    for group, levels in seen.items():
        declared = _declared(dict(zip(rows.groups, group, strict=True)), crossings)
        by_group[group] = {name: declared.get(name, levels[name]) for name in rows.cells}
    return {person: by_group[groups[0]] for person, groups in rows.groups_of().items()}


def _declared(group: Mapping[str, str], crossings: Sequence[Crossing]) -> Mapping[str, tuple[str, ...]]:
    for crossing in crossings:
        if all(group[name] == level for name, level in crossing.between.items()):
            return crossing.levels
    return {}


def _observed_levels(rows: _Rows) -> dict[Label, dict[str, tuple[str, ...]]]:
    found: dict[Label, dict[str, set[str]]] = {}
    for label in rows.labels((*rows.groups, *rows.cells)):
        group, cell = label[: len(rows.groups)], label[len(rows.groups) :]
        levels = found.setdefault(group, {name: set() for name in rows.cells})
        for name, level in zip(rows.cells, cell, strict=True):
            levels[name].add(level)
    return {g: {name: tuple(_in_order(levels)) for name, levels in each.items()} for g, each in found.items()}


def _cell_problems(rows: _Rows, plan: Plan, value: str, repeats: int, limit: int) -> list[Problem]:
    width = 1 + len(rows.cells)
    keys = rows.labels((rows.participant, *rows.cells, *rows.nested))
    filled = Counter(key[:width] for key in keys)
    _demand_possible(plan)
    owed = {(person, *cell): repeats for person, levels in plan.items() for cell in product(*levels.values())}
    if rows.nested and repeats == 1:
        owed = _items_owed(rows, keys, owed)
    missing = [_missing(rows, key, filled[key], wanted) for key, wanted in owed.items() if filled[key] < wanted]
    strange = [_place(rows, key, count(filled[key], "rating")) for key in filled if key not in owed]
    return [
        *gathered("missing", missing, limit),
        *gathered("undeclared", strange, limit),
        *gathered("duplicate", _duplicates(rows, keys, value, repeats), limit),
    ]


def _items_owed(rows: _Rows, keys: Sequence[Label], owed: Mapping[Label, int]) -> dict[Label, int]:
    """As many different items in a cell as the participant of the group with most of them has, at least one."""
    width = 1 + len(rows.cells)
    group_of = {person: groups[0] for person, groups in rows.groups_of().items()}
    most: dict[Label, int] = {}
    for key, items in Counter(key[:width] for key in set(keys)).items():
        place = (*group_of[key[0]], *key[1:])
        most[place] = max(items, most.get(place, 1))
    return {key: most.get((*group_of[key[0]], *key[1:]), 1) for key in owed}


def _demand_possible(plan: Plan) -> None:
    """A column that is no factor, such as a time, would cross to more cells than there is memory."""
    cells = sum(prod(map(len, levels.values())) for levels in plan.values())
    if cells > MOST_CELLS:
        widest = max((levels for each in plan.values() for levels in each.items()), key=lambda item: len(item[1]))
        raise DataRefused(
            f"the design check: the factors cross to {cells:,} cells, at most {MOST_CELLS:,} are expected;"
            f" {widest[0]!r} has {len(widest[1]):,} levels: is it a factor?"
        )


def _missing(rows: _Rows, key: Label, filled: int, wanted: int) -> Place:
    return _place(rows, key, f"{filled} of {wanted} ratings" if wanted > 1 else "")


def _duplicates(rows: _Rows, keys: Sequence[Label], value: str, repeats: int) -> list[Place]:
    values: dict[Label, list[object]] = {}
    for key, number in zip(keys, rows.table[value].tolist(), strict=True):
        values.setdefault(key, []).append(number)
    return [
        _place(rows, key, f"{count(len(each), 'rating')} ({_few(each)}), {repeats} planned")
        for key, each in values.items()
        if len(each) > repeats
    ]


def _few(values: Sequence[object]) -> str:
    shown = [f"{value:.10g}" if isinstance(value, float) else str(value) for value in values[:5]]
    return ", ".join(shown) + (", ..." if len(values) > 5 else "")


def _place(rows: _Rows, key: Label, found: str) -> Place:
    columns = (*rows.cells, *rows.nested)
    return Place(str(key[0]), dict(zip(columns, map(str, key[1:]), strict=False)), found)
