"""The conditions of a plan's `where`: levels of a column, or a range of numbers."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Annotated, Self, TypeAlias

from pydantic import AliasChoices, Discriminator, Field, Tag, model_validator

from palpate.protocols.strict import Strict, form_of
from palpate.protocols.study import Level, Number, is_number

if TYPE_CHECKING:
    import pandas as pd


class Range(Strict):
    """Numbers from `from` to `to`, both included; one of the two is optional."""

    low: Number | None = Field(default=None, validation_alias=AliasChoices("from", "low"))
    high: Number | None = Field(default=None, validation_alias=AliasChoices("to", "high"))

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.low is None and self.high is None:
            raise ValueError("from, to or both are expected")
        if self.low is not None and self.high is not None and self.low > self.high:
            raise ValueError(f"from ({self.low:g}) lies above to ({self.high:g})")
        return self

    def __str__(self) -> str:
        ends = (("from", self.low), ("to", self.high))
        return " ".join(f"{word} {end:g}" for word, end in ends if end is not None)

    def holds(self, level: str) -> bool:
        """Return whether the text is a number in the range."""
        if not is_number(level):
            return False
        number = float(level)
        return (self.low is None or number >= self.low) and (self.high is None or number <= self.high)


Condition: TypeAlias = Annotated[
    Annotated[Level, Tag("[value]")] | Annotated[tuple[Level, ...], Tag("[list]")] | Annotated[Range, Tag("[keys]")],
    Discriminator(form_of),
]
Where: TypeAlias = Mapping[str, Condition]


def levels_of(condition: Condition) -> tuple[str, ...]:
    """Return the levels of a condition, one or several; none for a range."""
    return () if isinstance(condition, Range) else (condition,) if isinstance(condition, str) else condition


def keeps(condition: Condition, level: str) -> bool:
    """Return whether rows with this level are kept."""
    return condition.holds(level) if isinstance(condition, Range) else level in levels_of(condition)


def level_texts(column: pd.Series) -> pd.Series:
    """Return a column's levels as text; a number that is whole has no fraction."""
    return column.map(lambda value: f"{value:.15g}") if column.dtype.kind == "f" else column.astype(str)


def compared_levels(column: pd.Series, condition: Condition) -> tuple[str, ...]:
    """Return the levels of a condition as `level_texts` writes those of the column."""
    levels = levels_of(condition)
    if column.dtype.kind != "f":
        return levels
    return tuple(f"{float(level):.15g}" if is_number(level) else level for level in levels)


def matching_rows(column: pd.Series, condition: Condition) -> pd.Series[bool]:
    """Return which rows of a column satisfy the condition; a missing value is in no range."""
    texts = level_texts(column)
    if isinstance(condition, Range):
        return texts.map(condition.holds).astype(bool)
    return texts.isin(compared_levels(column, condition))


def first_word(levels: Collection[str]) -> str | None:
    """Return the first level that is no number; None if all are, so that a range applies to them."""
    return next((level for level in sorted(levels) if not is_number(level)), None)
