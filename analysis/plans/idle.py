"""Settings of a test or figure that change nothing beside the others.

`--check-plan` refuses them. A plan that is already in use (its hash may stand in a registration) is read: such a
setting counts as its default, which changes no number, and a note beside the answer says so.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel

ON_RANKS = "on ranks within participants, which no such rescaling changes"


class Idle(NamedTuple):
    """A setting, where it changes nothing ("with `interval: none`"), and what it counts as (None: its default)."""

    name: str
    where: str
    instead: Any = None


AskedT = TypeVar("AskedT", bound=BaseModel)


def idle_settings(asked: Any, takes: str) -> list[Idle]:
    """Return the settings that differ from what they count as and change nothing.

    `takes` is the table that the kind of test or figure takes where the plan names none.
    """
    found: dict[str, Idle] = {}
    for each in (*_of_rows(asked, takes), *asked.idle()):
        if each.name not in type(asked).model_fields:
            continue
        value = _counts_as(asked, each)
        if getattr(asked, each.name) != value:
            found.setdefault(each.name, each._replace(instead=value))
    return list(found.values())


def _of_rows(asked: Any, takes: str) -> Iterator[Idle]:
    """Yield what changes nothing about the rows that are asked about."""
    if asked.table is not None:
        yield from (Idle(name, "with a table of the plan's own") for name in ("outcomes", "source", "normalise"))
    elif (asked.source or takes) == "words":
        yield from (Idle(name, "on words") for name in ("outcomes", "normalise", "missing"))
    elif (asked.source or takes) == "forms":
        yield Idle("normalise", "on a questionnaire's answers")
    if takes == "table":
        yield Idle("missing", "with a table of the plan's own, of which every row counts")


def effective(asked: AskedT, takes: str) -> AskedT:
    """Return the test or figure with settings that change nothing at what they count as."""
    return asked.model_copy(update={each.name: each.instead for each in idle_settings(asked, takes)})


def idle_notes(asked: Any, takes: str) -> tuple[str, ...]:
    """Return a sentence for each setting that changes nothing."""
    return tuple(idle_note(each.name, each.where) for each in idle_settings(asked, takes))


def idle_note(name: str, where: str) -> str:
    """Return the sentence for a setting that changes nothing there."""
    return f"The plan's `{name}` has no effect {where}."


def _counts_as(asked: Any, each: Idle) -> Any:
    field = type(asked).model_fields[each.name]
    return field.get_default(call_default_factory=True) if each.instead is None else each.instead
