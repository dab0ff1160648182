"""Textures of the library as text: tables and descriptions for people, JSON for scripts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from palpate.modeling.library.entries import KINDS, Z90, AttributeValue, Entry, Kind, Library, is_known, value_of
from palpate.modeling.library.search import Match, Near, near
from palpate.modeling.library.terms import in_words, vocabulary
from palpate.modeling.library.wishes import Wish
from palpate.protocols.wording import count

SURE = "± holds 90 of 100: the mean of all people where they rated, what they would say where it is predicted."
LIKE = 3


def names_of(library: Library) -> tuple[str, ...]:
    """Return the attributes' names as "Low-High"."""
    return tuple(f"{low}-{high}" for low, high in library.attributes)


def percent(share: float) -> str:
    """Return a share (0 to 1) as a percentage; 100 % only for the whole."""
    return f"{min(99, round(100 * share)) if share < 1 - 1e-9 else 100} %"


def value_text(estimate: AttributeValue | None) -> str:
    """Return an attribute's value with half the width of its 90 % interval."""
    return "-" if estimate is None else f"{estimate.value:.0f} ±{Z90 * estimate.sd:.0f}"


def source_text(entry: Entry, attributes: int, kind: Kind | None = None) -> str:
    """Return the source of the values: people, with their number, or a model."""
    kinds = {estimate.kind for at in range(attributes) if (estimate := value_of(entry, at, kind))}
    people = entry.rated.raters if entry.rated else 0
    learned = ", learned" if entry.predicted and entry.predicted.learned else ""
    text = f"{people} {'person' if people == 1 else 'people'}" if people else "people"
    by = {"rated": text, "predicted": f"predicted{learned}"}
    return " + ".join(by[kind] for kind in KINDS if kind in kinds) or "-"


def wish_words(wish: Wish, library: Library) -> str:
    """Return a wish with its meaning: the values with a membership of at least 0.5."""
    low, high = library.attributes[wish.pair]
    fits = wish.soft.half_fit
    return f"{wish.text}: {low}-{high} {fits[0]:.0f} to {fits[1]:.0f}" if fits else f"{wish.text}: nowhere"


def plain_entry(entry: Entry, library: Library, kind: Kind | None = None) -> dict[str, Any]:
    """Return a texture as JSON: its attributes by name, each with SD, 90 % interval and kind."""
    attributes: dict[str, Any] = {}
    for at, name in enumerate(names_of(library)):
        estimate, attributes[name] = value_of(entry, at, kind), None
        if estimate is not None:
            low, high = (estimate.value + way * Z90 * estimate.sd for way in (-1, 1))
            attributes[name] = {"value": estimate.value, "sd": estimate.sd, "low": low, "high": high,
                                "from": estimate.kind}  # fmt: skip
    return {"id": entry.id, "label": entry.label, "class": entry.category, "attributes": attributes,
            "raters": entry.rated.raters if entry.rated else 0, "picture": entry.picture}  # fmt: skip


def matches_data(
    matches: Sequence[Match], wishes: Sequence[Wish], library: Library, kind: Kind | None
) -> dict[str, Any]:
    """Return the answer to `find` as JSON."""
    wished = [{"said": wish.text, "attribute": names_of(library)[wish.pair],
              "membership": [list(knot) for knot in wish.soft.knots]} for wish in wishes]  # fmt: skip
    rows = [
        {**plain_entry(match.entry, library, kind), "fit": match.fit, "fits": list(match.fits_by_wish)}
        for match in matches
    ]
    return {"wished": wished, "found": rows, "simulated": library.simulated}


def plain_near(neighbours: Sequence[Near], entry: Entry, library: Library, kind: Kind | None) -> dict[str, Any]:
    """Return the answer to `nearest` as JSON; distances in JNDs."""
    rows = [
        {**plain_entry(neighbour.entry, library, kind), "distance": neighbour.distance, "distance_sd": neighbour.sd,
         "alike": neighbour.alike, "apart": dict(zip(names_of(library), neighbour.apart, strict=True))}
        for neighbour in neighbours
    ]  # fmt: skip
    return {"texture": plain_entry(entry, library, kind), "nearest": rows, "simulated": library.simulated}


def distance_text(neighbour: Near) -> str:
    """Return a distance in JNDs with half the width of its 90 % interval."""
    return f"{neighbour.distance:.1f} ±{Z90 * neighbour.sd:.1f}"


def table(
    entries: Sequence[Entry], library: Library, kind: Kind | None, extra: Mapping[str, Sequence[str]] | None = None
) -> Any:
    """Return textures as a table: rank, name, class, further columns, attributes, and their source."""
    from rich.markup import escape
    from rich.table import Table

    further = extra or {}
    result = Table(box=None, pad_edge=False, collapse_padding=True)
    result.add_column("", justify="right", no_wrap=True)
    for heading in ("id", "label", "class"):
        result.add_column(heading, no_wrap=True)
    for heading in (*further, *(f"{low}\n{high}" for low, high in library.attributes)):
        result.add_column(heading, justify="right", no_wrap=True)
    result.add_column("said by", no_wrap=True)
    count = len(library.attributes)
    for place, entry in enumerate(entries):
        values = (value_text(value_of(entry, at, kind)) for at in range(count))
        own = (column[place] for column in further.values())
        label = "" if entry.label == entry.id else entry.label
        source = source_text(entry, count, kind)
        names = map(escape, (entry.id, label, entry.category))
        result.add_row(str(place + 1), *names, *own, *values, source)
    return result


def description(entry: Entry, library: Library, kind: Kind | None = None) -> str:
    """Return a texture in words that `find` understands, as "very rough, perhaps soft"."""
    known = vocabulary(library.attributes)
    words = []
    for at in range(len(library.attributes)):
        if estimate := value_of(entry, at, kind):
            unsure = Z90 * estimate.sd > abs(estimate.value - 50) and not 45 <= estimate.value <= 55
            words.append(f"{'perhaps ' if unsure else ''}{in_words(known, at, estimate.value)}")
    return ", ".join(words)


def description_lines(
    entry: Entry, library: Library, others: Sequence[Entry], folder: Path, kind: Kind | None = None
) -> Iterator[str]:
    """Yield the description of a texture, with the most similar of `others`; only values of `kind`, if it is given."""
    named = "" if entry.label in ("", entry.id) else f", {entry.label}"
    yield f"{entry.id}{named} ({entry.category}): {description(entry, library, kind)}"
    yield ""
    words = [f"{low}-{high}" for low, high in library.attributes]
    wide = max(map(len, words))
    kinds = [source for source in KINDS if is_known(entry, source) and kind in (None, source)]
    yield f"{'':{wide}}  {'  '.join(f'{_heading(entry, source):30}' for source in kinds)}".rstrip()
    for at, name in enumerate(words):
        yield f"{name:{wide}}  {'  '.join(f'{_value_text(entry, at, source):30}' for source in kinds)}".rstrip()
    yield ""
    if alike := near(entry, others, len(library.attributes), kind)[:LIKE]:
        text = ", ".join(f"{match.entry.id} {match.entry.label} ({match.distance:.1f} JND)" for match in alike)
        yield f"most like it: {text}"
    yield f"picture: {folder / entry.picture if entry.picture else 'none'}"
    if entry.made_from:
        sources = count(len(entry.made_from), "file or recording", "files or recordings")
        yield f"made from {sources}, SHA-256 in the index"


def plain_whole(entry: Entry, library: Library, kind: Kind | None) -> dict[str, Any]:
    """Return a texture as JSON: entry, description, and its ratings and predictions, or only those of `kind`."""
    whole = entry.model_dump(mode="json")
    parts: dict[str, Any] = {name: whole[name] if kind in (None, name) else None for name in KINDS}
    return {**plain_entry(entry, library, kind), "words": description(entry, library, kind),
            "simulated": library.simulated, **parts, "made_from": whole["made_from"]}  # fmt: skip


def plain_library(entries: Sequence[Entry], library: Library, kind: Kind | None) -> dict[str, Any]:
    """Return the library as JSON: its textures and their sources."""
    whole = library.model_dump(mode="json", include={"attributes", "simulated", "sources", "notes"})
    return {**whole, "textures": [plain_entry(entry, library, kind) for entry in entries]}


def _heading(entry: Entry, kind: Kind) -> str:
    if kind == "rated" and entry.rated:
        return f"rated by {entry.rated.raters}" if entry.rated.raters else "rated"
    learned = entry.predicted is not None and entry.predicted.learned
    return "predicted (it learned this one)" if learned else "predicted"


def _value_text(entry: Entry, at: int, kind: Kind) -> str:
    """Return the value with its 90 % interval; for ratings also the SD between people."""
    estimate = value_of(entry, at, kind)
    if estimate is None:
        return "-"
    low, high = (estimate.value + way * Z90 * estimate.sd for way in (-1, 1))
    if kind == "predicted" and entry.predicted:
        low, high = entry.predicted.low[at], entry.predicted.high[at]
    sd = entry.rated.sd[at] if entry.rated and kind == "rated" else None
    between = "" if sd is None else f", SD {sd:.1f}"
    return f"{estimate.value:5.1f} ({max(0.0, low):.0f} to {min(100.0, high):.0f}{between})"
