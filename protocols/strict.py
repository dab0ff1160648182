"""The bases of all schemas for files that are read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar, cast

from pydantic import AliasChoices, BaseModel, ConfigDict, model_validator

from palpate.protocols.did_you_mean import nearest


class Strict(BaseModel):
    """A frozen schema that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class StrictFinite(Strict):
    """A frozen schema that refuses unknown keys and numbers that are not finite."""

    model_config = ConfigDict(allow_inf_nan=False)


class KnownKeys(Strict):
    """A frozen schema that names the nearest known key itself: for parts whose schema follows from the file."""

    @model_validator(mode="before")
    @classmethod
    def _name_unknown_keys(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        aliases = {name: cast(AliasChoices | None, field.validation_alias) for name, field in cls.model_fields.items()}
        known = [name if alias is None else str(alias.choices[0]) for name, alias in aliases.items()]
        for key in data:
            if key not in known and key not in aliases:
                raise ValueError(f"unknown key {key!r}; {nearest(str(key), known)}")
        return data


K = TypeVar("K", bound=Strict)


def by_kind(kinds: Mapping[str, type[K]], value: Any) -> K:
    """Return the settings by the schema that their key `kind` names. Raises ValueError for an unknown kind."""
    if isinstance(value, Strict):
        return cast(K, value)
    kind = value.get("kind") if isinstance(value, Mapping) else None
    if not isinstance(kind, str) or kind not in kinds:
        found = f"found {kind!r:.60}, " if kind is not None else ""
        raise ValueError(f"kind: {found}expected {', '.join(kinds)}; {nearest(str(kind), kinds)}")
    return kinds[kind].model_validate(value)
