"""Counts and lists as they are written in sentences."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def count(number: int, one: str, many: str = "") -> str:
    """Return a number of things in words: `1 rating`, `2 ratings`, `12,600 ratings`."""
    return f"{number:,} {one if number == 1 else many or one + 's'}"


def phrase(words: Sequence[str]) -> str:
    """Return words as a list within a sentence."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 2 else words)


def some(names: Iterable[object], most: int = 8, between: str = ", ") -> str:
    """Return the first of the names, and how many more there are: `a, b and 7 more`."""
    listed = [str(name) for name in names]
    return between.join(listed[:most]) + (f" and {len(listed) - most:,} more" if len(listed) > most else "")


def some_lines(lines: Sequence[str], most: int) -> list[str]:
    """Return the first of the lines, and a last line that says how many more there are."""
    return [*lines[:most], *([f"... and {len(lines) - most:,} more"] if len(lines) > most else [])]
