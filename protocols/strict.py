"""The bases of all schemas for files that are read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, TypeVar, cast

from pydantic import (
    AliasChoices,
    BaseModel,
    ConfigDict,
    PlainValidator,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError

from palpate.protocols.did_you_mean import nearest


class Strict(BaseModel):
    """A frozen schema that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class StrictFinite(Strict):
    """A frozen schema that refuses unknown keys and numbers that are not finite."""

    model_config = ConfigDict(allow_inf_nan=False)


def problem_at(path: tuple[str | int, ...], message: str) -> ValidationError:
    """Return a schema error at a path below the value that a validator was given."""
    error = PydanticCustomError("value_error", "{error}", {"error": message})
    return ValidationError.from_exception_data("schema", [{"type": error, "loc": path, "input": {}}])


def form_of(value: object) -> str:
    """Return the tag of a value's form: `[keys]`, `[list]` or `[value]`.

    As the discriminator of a union it leaves the errors of that form only; messages leave out tags in brackets.
    """
    if isinstance(value, Mapping | Strict):
        return "[keys]"
    return "[list]" if isinstance(value, list | tuple) else "[value]"


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
                raise problem_at((key,), f"unknown key; {nearest(str(key), known)}")
        return data


K = TypeVar("K", bound=Strict)


def by_kind(kinds: Mapping[str, type[K]], value: Any) -> K:
    """Return the settings by the schema that their key `kind` names. Raises ValueError for an unknown kind."""
    if isinstance(value, Strict):
        return cast(K, value)
    if not isinstance(value, Mapping):
        raise ValueError("keys and values are expected, as {KEY: VALUE}")
    kind = value.get("kind")
    if not isinstance(kind, str) or kind not in kinds:
        found = f"found {kind!r:.60}, " if kind is not None else ""
        raise problem_at(("kind",), f"{found}expected {', '.join(kinds)}; {nearest(str(kind), kinds)}")
    return kinds[kind].model_validate(value)


def list_by_kind(kinds: Mapping[str, type[K]], values: Sequence[Any]) -> tuple[K, ...]:
    """Return the settings of each item as `by_kind` does; an error names the item's place."""
    item = Annotated[Any, PlainValidator(lambda value: by_kind(kinds, value))]
    settings: TypeAdapter[tuple[K, ...]] = TypeAdapter(tuple[item, ...])
    return settings.validate_python(tuple(values))
