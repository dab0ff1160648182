"""What a test or figure of a plan is about: the study's answers of one kind, or a table of the plan's own."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

from palpate.protocols.study import Name

Takes: TypeAlias = Literal["ratings", "words", "forms", "choices", "table"] | Name
"""What a test is about: ratings, words, items of forms, a plan's own table, or a form's own table by its name."""
OF_NUMBERS = ("ratings", "forms")
"""Tables with one row for each value of an outcome."""


def source_of(settings: Any, kind: Any) -> str:
    """Return what a test or figure is about: "table" for one of the plan's own, else a table of answers by its name.

    A figure that takes no rows counts as one of a table.
    """
    return "table" if settings.table is not None else settings.source or kind.takes or "table"


def is_plain(source: str) -> bool:
    """Return whether a table is taken row by row, with columns of its own: the plan's own, or one of a form's own."""
    return source not in (*OF_NUMBERS, "words")


def source_problem(settings: Any, kind: Any) -> str:
    """Return why a kind of test or figure cannot take the table that `source` names, else an empty text."""
    source = source_of(settings, kind)
    of_numbers = kind.takes in OF_NUMBERS and source in OF_NUMBERS
    plain = is_plain(source) and source != "table" and kind.takes in OF_NUMBERS and hasattr(settings, "test")
    if settings.table is not None or kind.takes in ("table", None, source) or of_numbers or plain:
        return ""
    return f"it takes {kind.takes}, and no {source}; leave `source` out"


def has_own_value(settings: Any) -> bool:
    """Return whether a kind of test has a setting of its own for a column of numbers, or is a figure."""
    field = type(settings).model_fields.get("value")
    return field is None or field.default is not None or not hasattr(settings, "test")


def takes_value(settings: Any, kind: Any) -> bool:
    """Return whether the setting `value` has an effect: on a plain table, for a kind that takes ratings."""
    return has_own_value(settings) or (kind.takes in OF_NUMBERS and is_plain(source_of(settings, kind)))


def value_column(settings: Any, kind: Any) -> str | None:
    """Return the column of a plain table that is taken as its `value`; None for that of this name."""
    if has_own_value(settings) or not takes_value(settings, kind) or settings.value is None:
        return None
    return str(settings.value)
