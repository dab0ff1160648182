"""What figures of ratings say of attributes, scales and people, as plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from palpate.analysis.figures.axes import elided, round_ends
from palpate.analysis.figures.shown_columns import numbers
from palpate.analysis.ratings.dataset import DataRefused
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row, Selected


def attribute_words(selected: Selected) -> list[dict[str, str]]:
    """Each attribute: its name, its words at the low and the high end ("" for a scale of one word), its category."""
    return [
        {
            "name": name,
            "low": name,
            "high": selected.antonyms.get(name, ""),
            "category": selected.categories.get(name, ""),
        }
        for name in selected.outcomes
    ]


def title_of(attribute: Mapping[str, Any], letters: int = 10_000) -> str:
    """Both words as they are read, from the low end to the high one, in at most about so many letters."""
    if not attribute["high"]:
        return elided(attribute["name"], letters)
    low, high = attribute["low"], attribute["high"]
    half = (letters - 3) // 2
    low = elided(low, max(half, letters - 3 - len(high)))
    return f"{low} → {elided(high, max(half, letters - 3 - len(low)))}"


def scale_words(selected: Selected) -> list[float]:
    """The ends of the declared scale, else round numbers around the values."""
    low, high = selected.scale if selected.scale is not None else round_ends(numbers(selected.table, "value"))
    return [float(low), float(high)]


def on_scale(selected: Selected) -> str:
    """What a caption says of the scale."""
    return "on the rating scale" if selected.scale is not None else "on the range of the data, which have no scale"


def people_text(rows: Sequence[Row], column: str = "n") -> str:
    """How many participants numbers are over, in words."""
    n = sorted({value for row in rows if isinstance(value := row.get(column), int) and value > 0})
    if not n:
        return "no participant"
    return count(n[-1], "participant") if len(n) == 1 else f"{n[0]} to {n[-1]} participants"


def demand_attributes(name: str, selected: Selected) -> None:
    """Refuse a figure of ratings whose table has no attribute or no value."""
    for column in ("attribute", "value", "participant"):
        if column not in selected.table.columns:
            raise DataRefused(f"figure {name!r} shows ratings, and its table has no column {column!r}")
    if not selected.outcomes:
        raise DataRefused(f"figure {name!r}: no attribute is left to show; look at `outcomes`")


def by_category(attributes: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """The attributes of each category, in order."""
    found: dict[str, list[Mapping[str, Any]]] = {}
    for attribute in attributes:
        found.setdefault(attribute["category"], []).append(attribute)
    return found
