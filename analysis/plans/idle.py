"""Settings of a test or figure that have no effect in combination with the others.

`--check-plan` refuses them. A plan in use (its hash may be in a registration) is still read: such a setting counts as
its default, which changes no number, with a note beside the answer.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel

from palpate.analysis.plans.sources import OF_NUMBERS, is_plain, source_of, takes_value

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
    source = source_of(settings, kind)
    rows = "with a table of the plan's own" if source == "table" else f"on {source}"
    if settings.table is not None:
        of_rows.append(Idle("source", rows))
    if source == "words":
        of_rows += (Idle(name, rows) for name in ("outcomes", "normalise", "missing"))
    elif source == "forms":
        of_rows.append(Idle("normalise", "on a questionnaire's answers"))
    elif is_plain(source) and (settings.table is not None or source != "table"):
        one_answer = kind.takes not in OF_NUMBERS or getattr(kind, "each", "") == "outcome"
        of_rows += (Idle(name, rows) for name in (("outcomes", "normalise") if one_answer else ("normalise",)))
    if is_plain(kind.takes):
        of_rows.append(Idle("missing", f"{rows}, of which every row counts"))
    if not takes_value(settings, kind):
        of_rows.append(Idle("value", rows))
    for setting in (*of_rows, *settings.idle()):
        if setting.name not in type(settings).model_fields:
            continue
        field = type(settings).model_fields[setting.name]
        value = field.get_default(call_default_factory=True) if setting.instead is None else setting.instead
        if getattr(settings, setting.name) != value:
            by_name.setdefault(setting.name, setting._replace(instead=value))
    return list(by_name.values())


def outcomes_of_own_table(settings: Any) -> Iterator[Idle]:
    """Yield `outcomes` for a kind that uses all rows of a plan's own table, or of a form's own, for one answer."""
    if settings.table is not None:
        yield Idle("outcomes", "with a table of the plan's own")
    elif settings.source is not None and is_plain(settings.source):
        yield Idle("outcomes", f"on {settings.source}")


def effective(settings: SettingsT, kind: Any) -> SettingsT:
    """Return the test or figure with ineffective settings replaced by the values that they count as."""
    return settings.model_copy(update={setting.name: setting.instead for setting in idle_settings(settings, kind)})


def idle_notes(settings: Any, kind: Any) -> tuple[str, ...]:
    """Return a sentence for each setting without effect."""
    return tuple(idle_note(setting.name, setting.where) for setting in idle_settings(settings, kind))


def idle_note(name: str, where: str) -> str:
    """Return the sentence for a setting without effect."""
    return f"The plan's `{name}` has no effect {where}."
