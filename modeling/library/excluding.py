"""Where nothing fits: which wishes leave out most of the textures, and which one to give up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.modeling.library.asking import Wish
from palpate.modeling.library.entries import Entry, Kind
from palpate.modeling.library.finding import find, fitting


@dataclass(frozen=True)
class Excluded:
    """How many textures a wish leaves out by itself, and how many fit all the others (None: there are no others)."""

    said: str
    out: int
    without: int | None


def excluded(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None = None) -> list[Excluded]:
    """What each wish leaves out, in the order in which they were said; what was said in one breath is one wish."""
    found = []
    for said in dict.fromkeys(each.said for each in wishes):
        own, others = [each for each in wishes if each.said == said], [each for each in wishes if each.said != said]
        out = len(entries) - _fit(entries, own, kind)
        found.append(Excluded(said, out, _fit(entries, others, kind) if others else None))
    return found


def none_fits(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None = None) -> str:
    """In words that none of the textures fits, which wish leaves out most of them, and what would help."""
    every = excluded(entries, wishes, kind)
    whole, most = len(entries), max(each.out for each in every)
    told = f"None of {whole} textures fits."
    if len(every) > 1 and most == 0:
        told += " Each wish alone leaves out none; all at once, none is left."
    elif len(every) > 1:
        names = [repr(each.said) for each in every if each.out == most]
        told += f" Most are left out by {' and '.join(names)}: {most} of {whole}{' each' if len(names) > 1 else ''}."
    helps = max(every, key=lambda each: each.without or 0)
    if helps.without:
        told += f" Without {helps.said!r}, {helps.without} would fit."
    elif len(every) > 2:
        told += " Giving up one wish does not help."
    return told


def _fit(entries: Sequence[Entry], wishes: Sequence[Wish], kind: Kind | None) -> int:
    return len(fitting(find(entries, wishes, kind), len(entries)))
