"""Settings of a test or figure that change nothing beside the others.

`--check-plan` refuses them. A plan that is already in use (its hash may stand in a registration) is read: such a
setting counts as its default, which changes no number, and a note beside the answer says so.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel


class Idle(NamedTuple):
    """A setting, where it changes nothing ("with `interval: none`"), and what it counts as (None: its default)."""

    name: str
    where: str
    instead: Any = None


AskedT = TypeVar("AskedT", bound=BaseModel)


def idle_settings(asked: Any) -> list[Idle]:
    """Return the settings that differ from what they count as and change nothing."""
    found = []
    for each in asked.idle():
        value = _counts_as(asked, each)
        if getattr(asked, each.name) != value:
            found.append(each._replace(instead=value))
    return found


def effective(asked: AskedT) -> AskedT:
    """Return the test or figure with settings that change nothing at what they count as."""
    return asked.model_copy(update={each.name: each.instead for each in idle_settings(asked)})


def idle_notes(asked: Any) -> tuple[str, ...]:
    """Return a sentence for each setting that changes nothing."""
    return tuple(f"The plan's `{each.name}` has no effect {each.where}." for each in idle_settings(asked))


def _counts_as(asked: Any, each: Idle) -> Any:
    field = type(asked).model_fields[each.name]
    return field.get_default(call_default_factory=True) if each.instead is None else each.instead
