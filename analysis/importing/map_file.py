"""The column map: a small YAML file with the meaning of a foreign table's columns. Frozen and strict."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path, PurePath
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from palpate.analysis.ratings.dataset import RESERVED, DataRefused, taken_names
from palpate.analysis.ratings.dataset import Scale as RatingScale
from palpate.protocols.complaints import expectation
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import some_lines
from palpate.protocols.yaml_text import YamlError, load

SHIPPED = Path(__file__).resolve().parent / "maps"
MOST_SHOWN = 8
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]


class MapRefused(DataRefused):
    """The column map is unusable; the message names file, line, key and the nearest valid one."""


def _as_text(value: Any) -> Any:
    """Return an integer as text, since a level or a column may be written as one."""
    return str(value) if type(value) is int else value


def _as_list(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


def _known_encoding(value: str) -> str:
    try:
        b"a".decode(value)
    except UnicodeError:
        return value  # a known one, of which one byte is no text
    except LookupError:
        raise ValueError(f"{value!r} is not an encoding; e.g. utf-8-sig, cp1252, latin-1, mac-roman, utf-16") from None
    return value


def _plain_name(value: str) -> str:
    if not value.isascii() or not value.replace("_", "").replace("-", "").isalnum():
        raise ValueError(f"{value!r}: a name of letters, digits, _ and - is expected (it names a folder)")
    return value


def _relative(value: str) -> str:
    if PurePath(value).is_absolute():
        raise ValueError(f"{value!r}: a path relative to the map, or to DATA where that is given, is expected")
    return value


Text = Annotated[str, Field(strict=True), BeforeValidator(_as_text)]
Filled = Annotated[str, Field(strict=True, min_length=1), BeforeValidator(_as_text)]


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Source(_Strict):
    """The source of a factor's level: a column, optionally renamed by `levels`, or the text that a column contains.

    `levels` as a list gives the order and refuses other levels; as a mapping it also renames. `contains` maps a level
    to a text that some cell of the participant's column contains, in any row of the table.
    """

    column: Filled
    levels: dict[Filled, Filled] | None = None
    contains: dict[Filled, Filled] | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, value: Any) -> Any:
        if isinstance(value, str | int):
            return {"column": value}
        if isinstance(value, dict) and isinstance(value.get("levels"), list):
            listed = value["levels"]
            for place, level in enumerate(listed):
                if isinstance(level, dict | list):
                    raise ValueError(
                        f"level {place + 1} of the list is {level!r:.60}; texts are expected, as [low, high], or, with"
                        " no list, what the table's texts mean, as {l: low, h: high}"
                    )
                if level in listed[:place]:
                    raise ValueError(f"the level {level!r} appears twice; name each once")
            return {**value, "levels": {level: level for level in listed}}
        return value

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.levels is not None and self.contains is not None:
            raise ValueError("levels and contains do not go together")
        return self

    @property
    def declared(self) -> tuple[str, ...]:
        """The levels in the map's order, () if the column decides."""
        return tuple(dict.fromkeys((self.levels or {}).values())) or tuple(self.contains or ())


class Columns(_Strict):
    """The columns of participant, value, attribute and factors."""

    participant: Filled
    value: Filled
    attribute: Source | None = None
    attribute_is: Filled | None = None
    stimulus: Filled | None = None
    within: dict[Filled, Source] = {}
    between: dict[Filled, Source] = {}
    keep: tuple[Filled, ...] = ()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.attribute is None) == (self.attribute_is is None):
            raise ValueError("either attribute (a column) or attribute_is (one text for all rows) is expected")
        per_row = [*self.within.values(), *([self.attribute] if self.attribute else [])]
        if any(source.contains is not None for source in per_row):
            raise ValueError("contains gives a participant's level: it belongs under between")
        return self


class Condition(_Strict):
    """A condition on rows that are ratings: the cell is one of these texts, or is not empty."""

    is_: Annotated[tuple[Text, ...], Field(min_length=1)] | None = Field(default=None, alias="is")
    not_empty: Literal[True] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.is_ is None) == (self.not_empty is None):
            raise ValueError("either is: [TEXT, ...] or not_empty: true is expected")
        return self


class MapScale(_Strict):
    """The scale of the values."""

    low: Number = Field(alias="from")
    high: Number = Field(alias="to")
    step: Number | None = None

    @model_validator(mode="after")
    def _possible(self) -> Self:
        self.scale()
        return self

    def scale(self) -> RatingScale:
        """Return the scale as the analysis uses it."""
        return RatingScale(self.low, self.high, self.step)


class ColumnMap(_Strict):
    """The description of a foreign table, and how its columns become ratings."""

    name: Annotated[str, Field(strict=True, min_length=1, max_length=64), AfterValidator(_plain_name)]
    source: str = ""
    licence: str = ""
    format: Literal["long", "psychopy"] = "long"
    files: Annotated[
        tuple[Annotated[Filled, AfterValidator(_relative)], ...], Field(min_length=1), BeforeValidator(_as_list)
    ]
    encoding: Annotated[
        tuple[Annotated[str, AfterValidator(_known_encoding)], ...], Field(min_length=1), BeforeValidator(_as_list)
    ] = ("utf-8-sig",)
    delimiter: Annotated[str, Field(min_length=1, max_length=1)] | None = None
    decimal: Literal[".", ","] | None = None
    missing: tuple[Text, ...] = ("", "NA", "NaN")
    trim: bool = False
    columns: Columns
    loop: dict[Filled, dict[Filled, Filled]] = {}
    where: dict[Filled, Condition] = {}
    scale: MapScale | None = None
    duplicates: Literal["refuse", "mean", "first"] = "refuse"
    missing_value: Literal["refuse", "drop"] = "refuse"
    antonyms: dict[Filled, Filled] = {}
    categories: dict[Filled, Filled] = {}

    @model_validator(mode="after")
    def _each_name_once(self) -> Self:
        own = self.columns
        names = [*own.within, *self.loop, *own.between, *own.keep]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"the column {name!r} would stand twice in the table; give it another name")
        roles: dict[str, Iterable[str]] = {
            "within": own.within, "loop": self.loop, "between": own.between, "keep": own.keep,
        }  # fmt: skip
        for role, name in taken_names(roles):
            advice = "rename the column or leave it out" if role == "keep" else "give the factor another name"
            raise ValueError(
                f"{role}: the name {name!r} has a special meaning in the analysis; {advice}"
                f" (names that are taken: {', '.join(sorted(RESERVED))})"
            )
        return self

    @property
    def within(self) -> tuple[str, ...]:
        """The within factors: loops first, then columns."""
        return (*self.loop, *self.columns.within)

    def column_names(self) -> tuple[str, ...]:
        """Return every column of the foreign table that the map names."""
        own = self.columns
        sources = [*own.within.values(), *own.between.values(), *([own.attribute] if own.attribute else [])]
        loops = [column for levels in self.loop.values() for column in levels.values()]
        single = [own.participant, own.value, *([own.stimulus] if own.stimulus else [])]
        return tuple(dict.fromkeys([*single, *(s.column for s in sources), *own.keep, *loops, *self.where]))


def find_map(name: Path) -> Path:
    """Return the path of a map file, or of a shipped one by its name.

    Raises MapRefused with the nearest shipped name.
    """
    if name.is_file() or name.suffix in {".yaml", ".yml"}:
        return name
    shipped = {path.stem: path for path in sorted(SHIPPED.glob("*.yaml"))}
    if str(name) not in shipped:
        raise MapRefused(f"{name}: no such file, and no shipped map of that name; {nearest(str(name), shipped)}")
    return shipped[str(name)]


def read_map(path: Path) -> ColumnMap:
    """Return the column map in a YAML file. Raises MapRefused with all mistakes in it, at most eight shown."""
    try:
        document = load(path.read_bytes(), path.name)
    except YamlError as error:
        raise MapRefused(str(error)) from None
    if not isinstance(document.data, dict):
        raise MapRefused(f"{path.name}: keys and values are expected at the top, e.g. name: MY_TABLE")
    try:
        return ColumnMap.model_validate(document.data)
    except ValidationError as error:
        lines = []
        for problem in error.errors(include_url=False):
            place = tuple(part for part in problem["loc"] if part != "[key]")
            known = place
            while known and known not in document.lines:
                known = known[:-1]
            where = f" line {document.lines[known]}:" if known else ""
            key = ".".join(map(str, place)) or "the map"
            lines.append(f"{path.name}:{where} {key}: {_reason(dict(problem), place)}")
        raise MapRefused("\n".join(some_lines(lines, MOST_SHOWN))) from None


def _reason(problem: dict[str, Any], path: tuple[str | int, ...]) -> str:
    match problem["type"]:
        case "extra_forbidden":
            # The keys that the map knows beside the last one of the path.
            models: dict[str, type[BaseModel]] = {"columns": Columns, "scale": MapScale, "where": Condition}
            model = models.get(str(path[0]), ColumnMap) if len(path) > 1 else ColumnMap
            if len(path) > 2 and path[0] == "columns":
                model = Source
            known = [field.alias or name for name, field in model.model_fields.items()]
            return f"unknown key; {nearest(str(path[-1]), known)}"
        case "missing":
            return "this key is required"
        case "value_error":
            return str(problem["ctx"]["error"])
        case _:
            value_text = "" if isinstance(problem["input"], dict | list) else f"found {problem['input']!r:.60}, "
            return f"{value_text}{expectation(problem)}"
