"""One texture in full: what people say of it, what the model says, what feels like it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from palpate.modeling.library.entries import KINDS, Z90, Entry, Kind, Library, felt, known
from palpate.modeling.library.nearest import near
from palpate.modeling.library.shown import description, plain_entry
from palpate.protocols.wording import count

LIKE = 3


def whole_words(
    entry: Entry, library: Library, others: Sequence[Entry], folder: Path, kind: Kind | None = None
) -> Iterator[str]:
    """The lines that are printed; of a `kind` only what it says. `others` are those that may be like it."""
    named = "" if entry.label in ("", entry.id) else f", {entry.label}"
    yield f"{entry.id}{named} ({entry.category}): {description(entry, library, kind)}"
    yield ""
    yield from _attributes(entry, library, kind)
    yield ""
    if alike := near(entry, others, len(library.attributes), kind)[:LIKE]:
        told = ", ".join(f"{one.entry.id} {one.entry.label} ({one.distance:.1f} JND)" for one in alike)
        yield f"most like it: {told}"
    yield f"picture: {folder / entry.picture if entry.picture else 'none'}"
    if entry.made_from:
        sources = count(len(entry.made_from), "file or recording", "files or recordings")
        yield f"made from {sources}, SHA-256 in the index"


def plain_whole(entry: Entry, library: Library, kind: Kind | None) -> dict[str, Any]:
    """A texture as JSON: as `find` tells it, and what is rated and predicted of it beside each other; of a `kind` only
    what it says."""
    whole = entry.model_dump(mode="json")
    parts: dict[str, Any] = {name: whole[name] if kind in (None, name) else None for name in KINDS}
    return {**plain_entry(entry, library, kind), "words": description(entry, library, kind),
            "simulated": library.simulated, **parts, "made_from": whole["made_from"]}  # fmt: skip


def plain_library(entries: Sequence[Entry], library: Library, kind: Kind | None) -> dict[str, Any]:
    """The library as JSON: its textures, and where they come from."""
    whole = library.model_dump(mode="json", include={"attributes", "simulated", "sources", "notes"})
    return {**whole, "textures": [plain_entry(each, library, kind) for each in entries]}


def _attributes(entry: Entry, library: Library, kind: Kind | None) -> Iterator[str]:
    """A line for each attribute, rated beside predicted."""
    words = [f"{low}-{high}" for low, high in library.attributes]
    wide = max(map(len, words))
    kinds = [each for each in KINDS if known(entry, each) and kind in (None, each)]
    yield f"{'':{wide}}  {'  '.join(f'{_heading(entry, each):30}' for each in kinds)}".rstrip()
    for at, name in enumerate(words):
        yield f"{name:{wide}}  {'  '.join(f'{_told(entry, at, each):30}' for each in kinds)}".rstrip()


def _heading(entry: Entry, kind: Kind) -> str:
    if kind == "rated" and entry.rated:
        return f"rated by {entry.rated.raters}" if entry.rated.raters else "rated"
    learned = entry.predicted is not None and entry.predicted.learned
    return "predicted (it learned this one)" if learned else "predicted"


def _told(entry: Entry, at: int, kind: Kind) -> str:
    """The value and what holds it in 90 of 100 cases; of ratings also the SD between people."""
    found = felt(entry, at, kind)
    if found is None:
        return "-"
    low, high = (found.value + way * Z90 * found.sd for way in (-1, 1))
    if kind == "predicted" and entry.predicted:
        low, high = entry.predicted.low[at], entry.predicted.high[at]
    sd = entry.rated.sd[at] if entry.rated and kind == "rated" else None
    between = "" if sd is None else f", SD {sd:.1f}"
    return f"{found.value:5.1f} ({max(0.0, low):.0f} to {min(100.0, high):.0f}{between})"
