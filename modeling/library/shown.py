"""What is printed of textures: tables for people, plain values for scripts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from palpate.modeling.library.asking import Wish
from palpate.modeling.library.entries import KINDS, Z90, Entry, Felt, Kind, Library, felt
from palpate.modeling.library.finding import Found
from palpate.modeling.library.terms import in_words, vocabulary

if TYPE_CHECKING:
    from palpate.modeling.library.nearest import Near

SURE = "± holds 90 of 100: the mean of all people where they rated, what they would say where it is predicted."


def names_of(library: Library) -> tuple[str, ...]:
    """The attributes as tables name them."""
    return tuple(f"{low}-{high}" for low, high in library.attributes)


def percent(share: float) -> str:
    """A share as people read it; 100 % only where nothing is missing."""
    return f"{min(99, round(100 * share)) if share < 1 - 1e-9 else 100} %"


def told(each: Felt | None) -> str:
    """An attribute's value and how sure it is."""
    return "-" if each is None else f"{each.value:.0f} ±{Z90 * each.sd:.0f}"


def came_from(entry: Entry, attributes: int, kind: Kind | None = None) -> str:
    """Whether people or a model said so, and how many people."""
    kinds = {found.kind for at in range(attributes) if (found := felt(entry, at, kind))}
    people = entry.rated.raters if entry.rated else 0
    learned = ", learned" if entry.predicted and entry.predicted.learned else ""
    said = f"{people} {'person' if people == 1 else 'people'}" if people else "people"
    by = {"rated": said, "predicted": f"predicted{learned}"}
    return " + ".join(by[each] for each in KINDS if each in kinds) or "-"


def wish_words(wish: Wish, library: Library) -> str:
    """What a wish was taken to mean: the values that fit it at least by half."""
    low, high = library.attributes[wish.pair]
    met = wish.soft.met
    return f"{wish.said}: {low}-{high} {met[0]:.0f} to {met[1]:.0f}" if met else f"{wish.said}: nowhere"


def plain_entry(entry: Entry, library: Library, kind: Kind | None = None) -> dict[str, Any]:
    """A texture as JSON: its attributes by name, each with SD, 90 % interval and where it comes from."""
    attributes = {name: _plain(felt(entry, at, kind)) for at, name in enumerate(names_of(library))}
    return {"id": entry.id, "label": entry.label, "class": entry.category, "attributes": attributes,
            "raters": entry.rated.raters if entry.rated else 0, "picture": entry.picture}  # fmt: skip


def _plain(found: Felt | None) -> dict[str, Any] | None:
    if found is None:
        return None
    low, high = (found.value + way * Z90 * found.sd for way in (-1, 1))
    return {"value": found.value, "sd": found.sd, "low": low, "high": high, "from": found.kind}


def plain_found(found: Sequence[Found], wishes: Sequence[Wish], library: Library, kind: Kind | None) -> dict[str, Any]:
    """The answer to `find` as JSON."""
    asked = [{"said": each.said, "attribute": names_of(library)[each.pair],
              "membership": [list(knot) for knot in each.soft.knots]} for each in wishes]  # fmt: skip
    rows = [{**plain_entry(each.entry, library, kind), "fit": each.fit, "fits": list(each.each)} for each in found]
    return {"wished": asked, "found": rows, "simulated": library.simulated}


def plain_near(found: Sequence[Near], entry: Entry, library: Library, kind: Kind | None) -> dict[str, Any]:
    """The answer to `nearest` as JSON; distances in JNDs."""
    rows = [
        {**plain_entry(each.entry, library, kind), "distance": each.distance, "distance_sd": each.sd,
         "alike": each.alike, "apart": dict(zip(names_of(library), each.apart, strict=True))}
        for each in found
    ]  # fmt: skip
    return {"texture": plain_entry(entry, library, kind), "nearest": rows, "simulated": library.simulated}


def far(each: Near) -> str:
    """A distance in JNDs, and what holds it in 90 of 100 cases."""
    return f"{each.distance:.1f} ±{Z90 * each.sd:.1f}"


def table(
    entries: Sequence[Entry], library: Library, kind: Kind | None, extra: Mapping[str, Sequence[str]] | None = None
) -> Any:
    """Textures as a table: rank, name, class, what is asked of them, attributes, and who said so."""
    from rich.table import Table

    further = extra or {}
    found = Table(box=None, pad_edge=False, collapse_padding=True)
    found.add_column("", justify="right", no_wrap=True)
    for heading in ("id", "label", "class"):
        found.add_column(heading, no_wrap=True)
    for heading in (*further, *(f"{low}\n{high}" for low, high in library.attributes)):
        found.add_column(heading, justify="right", no_wrap=True)
    found.add_column("said by", no_wrap=True)
    count = len(library.attributes)
    for place, entry in enumerate(entries):
        values = (told(felt(entry, at, kind)) for at in range(count))
        own = (column[place] for column in further.values())
        label = "" if entry.label == entry.id else entry.label
        said = came_from(entry, count, kind)
        found.add_row(str(place + 1), *_escaped(entry.id, label, entry.category), *own, *values, said)
    return found


def description(entry: Entry, library: Library, kind: Kind | None = None) -> str:
    """A texture in the words that it is found by."""
    known = vocabulary(library.attributes)
    words = []
    for at in range(len(library.attributes)):
        if found := felt(entry, at, kind):
            unsure = Z90 * found.sd > abs(found.value - 50) and not 45 <= found.value <= 55
            words.append(f"{'perhaps ' if unsure else ''}{in_words(known, at, found.value)}")
    return ", ".join(words)


def _escaped(*texts: str) -> Iterable[str]:
    from rich.markup import escape

    return map(escape, texts)
