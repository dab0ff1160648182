"""Long sentences for a page: a caption's beginning and the rest of it, a result's parts."""

from __future__ import annotations

import re
from dataclasses import dataclass

SHORT = 260
"""A caption of no more letters than this stands as it is."""
_SENTENCE = re.compile(r"(?<=\.)\s+(?=[A-Z])")


@dataclass(frozen=True)
class Caption:
    """What stands below a figure at once, and what one opens ("" for nothing)."""

    first: str
    rest: str = ""


def caption(text: str) -> Caption:
    """A short caption whole; of a long one the sentences that fit, at least one."""
    if len(text) <= SHORT:
        return Caption(text)
    first, *rest = _SENTENCE.split(text)
    while rest and len(first) + 1 + len(rest[0]) <= SHORT:
        first = f"{first} {rest.pop(0)}"
    return Caption(first, " ".join(rest))


def parts_of(headline: str) -> tuple[str, ...]:
    """A sentence that holds several results, each by itself; their semicolons stay, and what stands in brackets."""
    found: list[str] = []
    for part in headline.split("; "):
        if found and _opened(found[-1]):
            found[-1] = f"{found[-1]}; {part}"
        else:
            found.append(part)
    return (*(f"{part};" for part in found[:-1]), found[-1])


def _opened(text: str) -> bool:
    """Whether a bracket is open at the end of the text."""
    return sum(text.count(bracket) for bracket in "([") > sum(text.count(bracket) for bracket in ")]")
