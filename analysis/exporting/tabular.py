"""A table to be shared: its columns with what they mean, and its rows one after another."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

Kind = Literal["text", "number", "whole", "truth"]
Value = str | float | int | bool | None
Row = dict[str, Value]
_NO_LEVELS: Mapping[str, str] = MappingProxyType({})


class ExportRefused(ValueError):
    """The data cannot be exported as asked; the message says where, what was found and what to do."""


@dataclass(frozen=True)
class Column:
    """A column: what it means, its kind, unit and levels.

    Without a `key` column the table means nothing, so it cannot be left out. `said` marks what a participant said
    freely, in words or as a number. `low` and `high` are the least and the greatest value that it may hold.
    """

    name: str
    description: str
    kind: Kind = "text"
    unit: str = ""
    levels: Mapping[str, str] = field(default_factory=lambda: _NO_LEVELS)
    key: bool = False
    said: bool = False
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Table:
    """A table; `rows` makes its rows anew at every call, so that a large one never stands in memory whole."""

    name: str
    description: str
    columns: tuple[Column, ...]
    rows: Callable[[], Iterable[Row]]

    def without(self, names: frozenset[str]) -> Table:
        """The table without the columns of these names; the rows may still hold them."""
        return replace(self, columns=tuple(column for column in self.columns if column.name not in names))

    def renamed(self, names: Mapping[str, str]) -> Table:
        """The table with columns under other names."""
        columns = tuple(replace(column, name=names.get(column.name, column.name)) for column in self.columns)
        return replace(self, columns=columns, rows=lambda: _renamed(self.rows(), names))


def _renamed(rows: Iterable[Row], names: Mapping[str, str]) -> Iterator[Row]:
    for row in rows:
        yield {names.get(name, name): value for name, value in row.items()}
