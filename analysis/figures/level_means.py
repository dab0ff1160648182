"""The means of every level, for bars and trends: their table, families and places."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from palpate.analysis.figures.columns import require_columns
from palpate.analysis.figures.figure_kind import FigureSettings
from palpate.analysis.figures.lettering import format_number
from palpate.analysis.figures.rating_axes import attribute_words, demand_attributes, scale_ends
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


class LevelSettings(FigureSettings):
    """The settings of level means: `by` are the columns on the axis; the column `families` groups levels of one.

    `whiskers` is the kind of interval around a mean.
    """

    by: Annotated[tuple[Text, ...], Field(min_length=1)]
    families: Text | None = None
    whiskers: Literal["sd", "cousineau_morey", "loftus_masson", "between", "none"] = "sd"
    confidence: Annotated[float, Field(gt=0, lt=1)] = 0.95

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        yield from super().idle()
        if self.whiskers in ("sd", "none"):
            yield Idle("confidence", f"with `whiskers: {self.whiskers}`")


def level_rows(selected: Selected, settings: LevelSettings) -> tuple[Row, ...]:
    """Return a row for each attribute and level: family, n, mean, sd, and the whisker's ends (None without one)."""
    demand_attributes(settings.name, selected)
    extra = () if settings.families is None else (settings.families,)
    require_columns(settings, selected.table, (*settings.by, *extra))
    groups = constant_columns(selected.table, settings.by)
    rows: list[Row] = []
    for attribute in selected.outcomes:
        part = selected.table[selected.table["attribute"] == attribute].reset_index(drop=True)
        if len(part):
            for mean in _intervals(part, attribute, settings, selected, groups).to_dict("records"):
                half = mean["sd"] if settings.whiskers == "sd" else mean["half"]
                known = not math.isnan(half + mean["mean"])
                rows.append(
                    {
                        "attribute": attribute,
                        **{name: str(mean[name]) for name in settings.by},
                        "n": int(mean["n"]),
                        "mean": nan_to_none(float(mean["mean"])),
                        "sd": nan_to_none(float(mean["sd"])),
                        "low": float(mean["mean"] - half) if known else None,
                        "high": float(mean["mean"] + half) if known else None,
                        "ratings_min": int(mean["ratings_min"]),
                        "ratings_max": int(mean["ratings_max"]),
                        "note": str(mean["note"]) if settings.whiskers != "none" else "",
                    }
                )
    return with_families(rows, selected.table, settings)


def with_families(rows: Sequence[Row], table: pd.DataFrame, settings: LevelSettings) -> tuple[Row, ...]:
    """Return the rows with the family of their level: by the column, the first of several factors, or none."""
    keys = list(dict.fromkeys(_key(row, settings.by) for row in rows))
    if len(settings.by) > 1:
        families = {key: key[0] for key in keys}
    elif settings.families is None or settings.families == settings.by[0]:
        families = dict.fromkeys(keys, "")
    else:
        levels = list(dict.fromkeys(texts_of(table, settings.by[0])))
        family_of = families_of(table, settings.by[0], settings.families, levels)
        families = {key: family_of[key[0]] for key in keys}
    return tuple({**row, "family": families[_key(row, settings.by)]} for row in rows)


def _intervals(
    part: pd.DataFrame, attribute: str, settings: LevelSettings, selected: Selected, groups: Sequence[str]
) -> pd.DataFrame:
    """Return the means with their intervals.

    Raises DataRefused if a cell is missing, since figures leave nobody out.
    """
    try:
        return mean_intervals(
            part,
            by=settings.by,
            between=groups,
            method="none" if settings.whiskers == "sd" else settings.whiskers,
            confidence=settings.confidence,
            levels=levels_of(selected.levels, settings.by),
        )
    except IncompleteCells as refusal:
        raise DataRefused(
            f"figure {settings.name!r}, {attribute}: {str(refusal).removesuffix(LISTWISE)}; whiskers within"
            " participants need every cell: choose `whiskers: sd`, `between` or `none`, or leave such participants out"
        ) from refusal


def _key(row: Row, by: Sequence[str]) -> Key:
    return tuple(str(row[name]) for name in by)


def level_words(selected: Selected, settings: LevelSettings, rows: Sequence[Row]) -> dict[str, Any]:
    """Return the levels in order (those of one family together), the attributes, the scale, and the whiskers' kind."""
    family = {_key(row, settings.by): str(row["family"]) for row in rows}
    order = list(dict.fromkeys(family.values()))
    keys = sorted(family, key=lambda key: order.index(family[key]))
    share = f"{100 * settings.confidence:g} %"
    return {
        "by": list(settings.by),
        "levels": [
            {"key": list(key), "family": family[key], "written": key[0] if len(key) == 1 else " × ".join(key[1:])}
            for key in keys
        ],
        "attributes": attribute_words(selected),
        "scale": scale_ends(selected),
        "whiskers": WHISKERS[settings.whiskers].format(share=share),
    }


def whisker_ends(rows: Sequence[Row]) -> list[float]:
    """Return both ends of every whisker."""
    return [float(value) for row in rows for end in ("low", "high") if isinstance(value := row[end], int | float)]


def missing_whiskers_note(rows: Sequence[Row], settings: LevelSettings) -> str:
    """Return the caption's note on missing whiskers, else ""."""
    without = [row for row in rows if row["low"] is None]
    if settings.whiskers == "none" or not without:
        return ""
    return f" {len(without)} of {len(rows)} means have no whisker: {without[0]['note'] or 'no spread'}."


def unequal_ratings_note(rows: Sequence[Row]) -> str:
    """Return the caption's note if participants' means at one level average unequal numbers of ratings, else ""."""
    least = [row["ratings_min"] for row in rows if row["ratings_min"] != row["ratings_max"]]
    most = [row["ratings_max"] for row in rows if row["ratings_min"] != row["ratings_max"]]
    if not least:
        return ""
    return f" Not every participant's mean rests on as many ratings: {min(least)} to {max(most)}."  # type: ignore[type-var]


class LevelPlaces:
    """The place of each level along the axis, its family, and the family's appearance."""

    def __init__(self, words: Mapping[str, Any], gap: float = 0.6) -> None:
        self.by: list[str] = words["by"]
        self.keys: list[Key] = [tuple(level["key"]) for level in words["levels"]]
        self.written: dict[Key, str] = {tuple(level["key"]): level["written"] for level in words["levels"]}
        self.family: dict[Key, str] = {tuple(level["key"]): level["family"] for level in words["levels"]}
        self.members: dict[str, list[Key]] = {}
        for key in self.keys:
            self.members.setdefault(self.family[key], []).append(key)
        self.at: dict[Key, float] = {}
        for i, keys in enumerate(self.members.values()):
            self.at |= {key: len(self.at) + j + i * gap for j, key in enumerate(keys)}

    @property
    def reference(self) -> Key | None:
        """The first level if it is a family of its own among larger ones (the original), else None."""
        sizes = [len(keys) for keys in self.members.values()]
        alone = len(sizes) > 1 and sizes[0] == 1 and max(sizes) > 1
        return self.keys[0] if alone else None

    def colours(self) -> dict[str, str]:
        """Return a colour for each family; a single first level is the reference, in the colour of ink."""
        first = {self.family[self.reference]: INK} if self.reference else {}
        rest = [name for name in self.members if name not in first]
        return first | {name: OKABE_ITO[i % len(OKABE_ITO)] for i, name in enumerate(rest)}

    def rows(self, rows: Sequence[Row], attribute: str) -> dict[Key, Row]:
        """Return the rows of an attribute by level, in axis order, without levels that have no mean."""
        rows_at = {_key(row, self.by): row for row in rows if row["attribute"] == attribute and row["mean"] is not None}
        return {key: rows_at[key] for key in self.keys if key in rows_at}

    def details(self, row: Row, words: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
        """Return the details of a level's mark."""
        key = _key(row, self.by)
        lines = [(name, level) for name, level in zip(self.by, key, strict=True)]
        family = [("family", self.family[key])] if len(self.by) == 1 and self.family[key] else []
        spread = [("SD", format_number(_float(row["sd"])))]
        if row["low"] is not None and not words["whiskers"].startswith("±"):
            spread.append(("interval", f"{format_number(_float(row['low']))} to {format_number(_float(row['high']))}"))
        numbers = [("mean", format_number(_float(row["mean"]))), *spread, ("participants", str(row["n"]))]
        return (("attribute", str(row["attribute"])), *lines, *family, *numbers)


def _float(value: Any) -> float | None:
    return None if value is None else float(value)


def level_name(key: Key) -> str:
    """Return the key by which marks of other figures refer to a level."""
    return " × ".join(key)
