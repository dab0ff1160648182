"""Settings of a test or figure that have no effect in combination with the others.

`--check-plan` refuses them. A plan in use (its hash may be in a registration) is still read: such a setting counts as
its default, which changes no number, with a note beside the answer.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel

ON_RANKS = "on ranks within participants, which no such rescaling changes"


class Idle(NamedTuple):
    """A setting, the condition under which it has no effect ("with `interval: none`"), and what it counts as."""

    name: str
    where: str
    instead: Any = None


SettingsT = TypeVar("SettingsT", bound=BaseModel)


def idle_settings(settings: Any, kind: Any) -> list[Idle]:
    """Return the settings that have no effect and differ from the value that they count as.

    `kind` is the kind of the test or figure.
    """
    by_name: dict[str, Idle] = {}
    of_rows: list[Idle] = []
    own = "with a table of the plan's own"
    if settings.table is not None:
        one_answer = kind.takes in ("table", "choices") or getattr(kind, "each", "") == "outcome"
        names = ("outcomes", "source", "normalise") if one_answer else ("source", "normalise")
        of_rows += (Idle(name, own) for name in names)
    elif (settings.source or kind.takes) == "words":
        of_rows += (Idle(name, "on words") for name in ("outcomes", "normalise", "missing"))
    elif (settings.source or kind.takes) == "forms":
        of_rows.append(Idle("normalise", "on a questionnaire's answers"))
    elif (settings.source or kind.takes) == "choices":
        of_rows += (Idle(name, "on choices") for name in ("outcomes", "normalise"))
    if kind.takes in ("table", "choices"):
        rows = "on choices" if settings.table is None and (settings.source or kind.takes) == "choices" else own
        of_rows.append(Idle("missing", f"{rows}, of which every row counts"))
    for setting in (*of_rows, *settings.idle()):
        if setting.name not in type(settings).model_fields:
            continue
        field = type(settings).model_fields[setting.name]
        value = field.get_default(call_default_factory=True) if setting.instead is None else setting.instead
        if getattr(settings, setting.name) != value:
            by_name.setdefault(setting.name, setting._replace(instead=value))
    return list(by_name.values())


def outcomes_of_own_table(settings: Any) -> Iterator[Idle]:
    """Yield `outcomes` for a kind that uses all rows of a plan's own table for one answer."""
    if settings.table is not None:
        yield Idle("outcomes", "with a table of the plan's own")


def effective(settings: SettingsT, kind: Any) -> SettingsT:
    """Return the test or figure with ineffective settings replaced by the values that they count as."""
    return settings.model_copy(update={setting.name: setting.instead for setting in idle_settings(settings, kind)})


def idle_notes(settings: Any, kind: Any) -> tuple[str, ...]:
    """Return a sentence for each setting without effect."""
    return tuple(idle_note(setting.name, setting.where) for setting in idle_settings(settings, kind))


def idle_note(name: str, where: str) -> str:
    """Return the sentence for a setting without effect."""
    return f"The plan's `{name}` has no effect {where}."
