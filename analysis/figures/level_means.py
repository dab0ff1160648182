"""The means of every level that the bars and the trends both show: their table, their families, their places."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from palpate.analysis.figures.columns import require
from palpate.analysis.figures.figure_kind import AskedFigure
from palpate.analysis.figures.lettering import number
from palpate.analysis.figures.rating_axes import attribute_words, demand_attributes, scale_words
from palpate.analysis.figures.style import INK, OKABE_ITO
from palpate.analysis.plans.answers import Row, Selected
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.person_cells import LISTWISE, constant_columns, levels_of, texts_of
from palpate.analysis.ratings.trends import families_of
from palpate.analysis.ratings.within_intervals import mean_intervals
from palpate.analysis.statistics.refusals import IncompleteCells
from palpate.protocols.study import Text
from palpate.protocols.undefined import nan_to_none

if TYPE_CHECKING:
    import pandas as pd

Key = tuple[str, ...]
WHISKERS = {
    "sd": "± 1 standard deviation across participants",
    "cousineau_morey": "{share} within-participant intervals (Cousineau–Morey)",
    "loftus_masson": "{share} pooled within-participant intervals (Loftus–Masson)",
    "between": "{share} intervals of the mean over participants (Student)",
    "none": "",
}


class LevelFigure(AskedFigure):
    """`by`: the columns whose levels stand on the axis; `families`: a column that groups the levels of one column.

    `whiskers` say what is drawn around a mean.
    """

    by: Annotated[tuple[Text, ...], Field(min_length=1)]
    families: Text | None = None
    whiskers: Literal["sd", "cousineau_morey", "loftus_masson", "between", "none"] = "sd"
    confidence: Annotated[float, Field(gt=0, lt=1)] = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that change nothing beside the others."""
        yield from super().idle()
        if self.whiskers in ("sd", "none"):
            yield Idle("confidence", f"with `whiskers: {self.whiskers}`")


def level_rows(selected: Selected, asked: LevelFigure) -> tuple[Row, ...]:
    """One row per attribute and level: family, n, mean, sd, and the ends of the whisker (None where there is none)."""
    demand_attributes(asked.name, selected)
    extra = () if asked.families is None else (asked.families,)
    require(asked, selected.table, (*asked.by, *extra))
    groups = constant_columns(selected.table, asked.by)
    rows: list[Row] = []
    for attribute in selected.outcomes:
        part = selected.table[selected.table["attribute"] == attribute].reset_index(drop=True)
        if len(part):
            rows += _rows(part, attribute, asked, selected, groups)
    return with_families(rows, selected.table, asked)


def with_families(rows: Sequence[Row], table: pd.DataFrame, asked: LevelFigure) -> tuple[Row, ...]:
    """The rows with the family of their level: its column, the first of several factors, or none."""
    families = _families(table, asked, list(dict.fromkeys(_key(row, asked.by) for row in rows)))
    return tuple({**row, "family": families[_key(row, asked.by)]} for row in rows)


def _rows(
    part: pd.DataFrame, attribute: str, asked: LevelFigure, selected: Selected, groups: Sequence[str]
) -> list[Row]:
    found = _intervals(part, attribute, asked, selected, groups)
    rows: list[Row] = []
    for each in found.to_dict("records"):
        half = each["sd"] if asked.whiskers == "sd" else each["half"]
        known = not math.isnan(half + each["mean"])
        rows.append(
            {
                "attribute": attribute,
                **{name: str(each[name]) for name in asked.by},
                "n": int(each["n"]),
                "mean": nan_to_none(float(each["mean"])),
                "sd": nan_to_none(float(each["sd"])),
                "low": float(each["mean"] - half) if known else None,
                "high": float(each["mean"] + half) if known else None,
                "ratings_min": int(each["ratings_min"]),
                "ratings_max": int(each["ratings_max"]),
                "note": str(each["note"]) if asked.whiskers != "none" else "",
            }
        )
    return rows


def _intervals(
    part: pd.DataFrame, attribute: str, asked: LevelFigure, selected: Selected, groups: Sequence[str]
) -> pd.DataFrame:
    """The means with their intervals. Raises DataRefused where an interval lacks a cell: a figure leaves nobody out."""
    try:
        return mean_intervals(
            part,
            by=asked.by,
            between=groups,
            method="none" if asked.whiskers == "sd" else asked.whiskers,
            confidence=asked.confidence,
            levels=levels_of(selected.levels, asked.by),
        )
    except IncompleteCells as refusal:
        raise DataRefused(
            f"figure {asked.name!r}, {attribute}: {str(refusal).removesuffix(LISTWISE)}; whiskers within participants"
            " need every cell: choose `whiskers: sd`, `between` or `none`, or leave such participants out"
        ) from refusal


def _key(row: Row, by: Sequence[str]) -> Key:
    return tuple(str(row[name]) for name in by)


def _families(table: pd.DataFrame, asked: LevelFigure, keys: Sequence[Key]) -> dict[Key, str]:
    if len(asked.by) > 1:
        return {key: key[0] for key in keys}
    if asked.families is None or asked.families == asked.by[0]:
        return dict.fromkeys(keys, "")
    found = families_of(table, asked.by[0], asked.families, list(dict.fromkeys(texts_of(table, asked.by[0]))))
    return {key: found[key[0]] for key in keys}


def level_words(selected: Selected, asked: LevelFigure, rows: Sequence[Row]) -> dict[str, Any]:
    """The levels in order (levels of one family together), the attributes, the scale, what whiskers are."""
    family = {_key(row, asked.by): str(row["family"]) for row in rows}
    order = list(dict.fromkeys(family.values()))
    keys = sorted(family, key=lambda key: order.index(family[key]))
    share = f"{100 * asked.confidence:g} %"
    return {
        "by": list(asked.by),
        "levels": [{"key": list(key), "family": family[key], "written": _written(key)} for key in keys],
        "attributes": attribute_words(selected),
        "scale": scale_words(selected),
        "whiskers": WHISKERS[asked.whiskers].format(share=share),
    }


def _written(key: Key) -> str:
    return key[0] if len(key) == 1 else " × ".join(key[1:])


def whisker_ends(rows: Sequence[Row]) -> list[float]:
    """Both ends of every whisker."""
    return [float(value) for row in rows for end in ("low", "high") if isinstance(value := row[end], int | float)]


def unknown(rows: Sequence[Row], asked: LevelFigure) -> str:
    """What a caption says of whiskers that do not exist."""
    lacking = [row for row in rows if row["low"] is None]
    if asked.whiskers == "none" or not lacking:
        return ""
    return f" {len(lacking)} of {len(rows)} means have no whisker: {lacking[0]['note'] or 'no spread'}."


def unequal(rows: Sequence[Row]) -> str:
    """What a caption says where participants' means at one level rest on unequal numbers of ratings."""
    least = [row["ratings_min"] for row in rows if row["ratings_min"] != row["ratings_max"]]
    most = [row["ratings_max"] for row in rows if row["ratings_min"] != row["ratings_max"]]
    if not least:
        return ""
    return f" Not every participant's mean rests on as many ratings: {min(least)} to {max(most)}."  # type: ignore[type-var]


class Places:
    """Where each level stands, its family, and the family's look."""

    def __init__(self, words: Mapping[str, Any], gap: float = 0.6) -> None:
        self.by: list[str] = words["by"]
        self.keys: list[Key] = [tuple(each["key"]) for each in words["levels"]]
        self.written: dict[Key, str] = {tuple(each["key"]): each["written"] for each in words["levels"]}
        self.family: dict[Key, str] = {tuple(each["key"]): each["family"] for each in words["levels"]}
        self.members: dict[str, list[Key]] = {}
        for key in self.keys:
            self.members.setdefault(self.family[key], []).append(key)
        self.at: dict[Key, float] = {}
        for i, keys in enumerate(self.members.values()):
            self.at |= {key: len(self.at) + j + i * gap for j, key in enumerate(keys)}

    @property
    def reference(self) -> Key | None:
        """The first level where it is a family of its own among larger ones (the original), else None."""
        sizes = [len(keys) for keys in self.members.values()]
        alone = len(sizes) > 1 and sizes[0] == 1 and max(sizes) > 1
        return self.keys[0] if alone else None

    def colours(self) -> dict[str, str]:
        """A family of one level that comes first is the reference: ink. The others get a colour each."""
        first = {self.family[self.reference]: INK} if self.reference else {}
        rest = [name for name in self.members if name not in first]
        return first | {name: OKABE_ITO[i % len(OKABE_ITO)] for i, name in enumerate(rest)}

    def rows(self, rows: Sequence[Row], attribute: str) -> dict[Key, Row]:
        """The rows of an attribute by level, in the order of the axis, without levels that it has no mean at."""
        found = {_key(row, self.by): row for row in rows if row["attribute"] == attribute and row["mean"] is not None}
        return {key: found[key] for key in self.keys if key in found}

    def told(self, row: Row, words: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
        """What a mark says of a level."""
        key = _key(row, self.by)
        lines = [(name, level) for name, level in zip(self.by, key, strict=True)]
        family = [("family", self.family[key])] if len(self.by) == 1 and self.family[key] else []
        spread = [("SD", number(_float(row["sd"])))]
        if row["low"] is not None and not words["whiskers"].startswith("±"):
            spread.append(("interval", f"{number(_float(row['low']))} to {number(_float(row['high']))}"))
        numbers = [("mean", number(_float(row["mean"]))), *spread, ("participants", str(row["n"]))]
        return (("attribute", str(row["attribute"])), *lines, *family, *numbers)


def _float(value: Any) -> float | None:
    return None if value is None else float(value)


def key_text(key: Key) -> str:
    """The name under which marks of other figures know a level."""
    return " × ".join(key)
