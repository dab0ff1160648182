"""Bipolar pairs of adjectives from the words that were kept and a table of antonyms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import pandas as pd

from palpate.analysis.statistics.refusals import SHOWN, StatisticsError, UnknownColumn
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import some_lines


class AntonymTableError(StatisticsError):
    """A table of antonyms that cannot be used; the message has a line for each mistake."""


class Pair(NamedTuple):
    """A bipolar scale as written in the table, and which of its two words were kept."""

    word: str
    antonym: str
    word_kept: bool
    antonym_kept: bool


@dataclass(frozen=True)
class Paired:
    """The pairs, in the order of the kept words, and the kept words that make no pair."""

    pairs: tuple[Pair, ...]
    left_out: tuple[str, ...]


def antonym_pairs(
    kept: Sequence[str], table: pd.DataFrame, offered: Sequence[str] = (), *, need_both: bool = False
) -> Paired:
    """Return the bipolar pairs of the kept words, each once, in the order of `kept`.

    `table` has the columns word and antonym, a line for each pair; antonyms are symmetric. A kept word whose antonym
    was not kept still makes a pair, unless `need_both`. With `offered`, both words of every line must have been
    offered. Raises AntonymTableError with every mistake's line (the first line of the file is its header).
    """
    listed_pair = {end: pair for pair in antonym_table(table, offered) for end in pair}
    pairs: dict[tuple[str, str], Pair] = {}
    left_out: list[str] = []
    for word in kept:
        pair = listed_pair.get(word)
        if pair is None or (need_both and not set(pair) <= set(kept)):
            left_out.append(word)
        else:
            pairs[pair] = Pair(*pair, pair[0] in kept, pair[1] in kept)
    return Paired(tuple(pairs.values()), tuple(left_out))


def antonym_table(table: pd.DataFrame, offered: Sequence[str] = ()) -> tuple[tuple[str, str], ...]:
    """Return the pairs of a consistent table, with each word in one pair. Raises AntonymTableError."""
    for name in ("word", "antonym"):
        if list(table.columns).count(name) != 1:
            known = ", ".join(map(repr, table.columns))
            raise UnknownColumn(f"the table of antonyms needs one column {name!r}; its columns are {known}")
    mistakes: list[str] = []
    pairs: dict[tuple[str, str], int] = {}
    partner: dict[str, tuple[int, str]] = {}
    for line, raw in enumerate(zip(table["word"].tolist(), table["antonym"].tolist(), strict=True), start=2):
        word, antonym = (cell.strip() if isinstance(cell, str) else "" for cell in raw)
        if mistake := _mistake(word, antonym, offered, partner, pairs):
            mistakes.append(f"line {line}: {mistake}")
        elif word not in partner:
            pairs[word, antonym] = line
            partner |= {word: (line, antonym), antonym: (line, word)}
    if mistakes:
        raise AntonymTableError("\n".join(["the table of antonyms cannot be used:", *some_lines(mistakes, SHOWN)]))
    return tuple(pairs)


def _mistake(
    word: str,
    antonym: str,
    offered: Sequence[str],
    partner: dict[str, tuple[int, str]],
    pairs: dict[tuple[str, str], int],
) -> str:
    """Return the mistake in a line, given the lines before it (`partner`, `pairs`), else ""."""
    if not word or not antonym:
        return f"a word and its antonym are expected, found {word!r} and {antonym!r}"
    if word.casefold() == antonym.casefold():
        return f"{word!r} is its own antonym"
    if strange := [name for name in (word, antonym) if offered and name not in offered]:
        return f"{strange[0]!r} was not offered; {nearest(strange[0], offered)}"
    if line := pairs.get((word, antonym)):
        return f"{word!r} and {antonym!r} stand already in line {line}"
    for one, other in ((word, antonym), (antonym, word)):
        line, known = partner.get(one, (0, other))
        if known != other:
            return f"{one!r} is the antonym of {known!r} in line {line} and of {other!r} here; a word is in one pair"
    return ""
