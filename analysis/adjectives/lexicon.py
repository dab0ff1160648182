"""Words that participants wrote: how many there are, how often each was written and by how many people."""

from __future__ import annotations

import math
import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import Any, Literal, TypeAlias

import pandas as pd

from palpate.analysis.adjectives.selections import check_words
from palpate.analysis.reliability.crossed import combine_labels
from palpate.analysis.statistics.cells import name_list, ordered
from palpate.analysis.statistics.refusals import BadOption, BadValue, StatisticsError, UnknownColumn, listed, shown

Normalisation: TypeAlias = Literal["as_written", "spaces", "case_and_spaces"]
KINDS = ("as_written", "spaces", "case_and_spaces")


class SynonymTableError(StatisticsError):
    """A table of synonyms that contradicts itself."""


@dataclass(frozen=True)
class Lexicon:
    """The result: `words` has a row per different word, `participants` and `stimuli` one per participant or stimulus.

    `mentions` counts each word once per trial; `unplaced` counts the mentions without a stimulus.
    """

    words: pd.DataFrame
    participants: pd.DataFrame
    stimuli: pd.DataFrame
    mentions: int
    unplaced: int
    normalisation: str


def lexicon(
    data: pd.DataFrame,
    normalisation: Normalisation = "case_and_spaces",
    *,
    synonyms: Mapping[str, str] | None = None,
    offered: Sequence[str] = (),
    word: str = "word",
    participant: str = "participant",
    stimulus: str = "stimulus",
    trial: str | Sequence[str] = ("session", "trial"),
) -> Lexicon:
    """Return the lexicon of a long table of free words, most frequent first.

    `normalisation` decides which spellings are one word: "as_written", "spaces" (outer spaces removed, inner ones
    single) or "case_and_spaces" (also lower case); the last two unify Unicode's compatible forms. `synonyms` maps a
    normalised word to the word that it counts as. A duplicate row of a trial counts once; a row without a stimulus (a
    closing suggestion) counts for words and participants. Raises a StatisticsError for unusable data.
    """
    if normalisation not in KINDS:
        raise BadOption(f"normalisation={shown(normalisation)} is unknown: one of {', '.join(map(repr, KINDS))}")
    check_words(data, [participant, stimulus, word])
    stands_for = _synonyms(synonyms or {}, normalisation)
    mentioned = _mentions(data, normalisation, stands_for, (word, participant, stimulus), name_list(trial))
    listed_already = {normalised(other, normalisation) for other in offered}
    mentions = len(mentioned)
    placed = [other for other in mentioned if other.stimulus is not None]
    offered_known = bool(offered)
    by_word: dict[str, list[_Mention]] = defaultdict(list)
    for mention in mentioned:
        by_word[mention.word].append(mention)
    rows = [
        {
            "word": word,
            "mentions": len(group),
            "participants": len({mention.participant for mention in group}),
            "stimuli": len({mention.stimulus for mention in group} - {None}),
            "spellings": "; ".join(sorted({form for mention in group for form in mention.written})),
            **({"offered": word in listed_already} if offered_known else {}),
        }
        for word, group in by_word.items()
    ]
    rows.sort(key=lambda row: (-int(str(row["mentions"])), -int(str(row["participants"])), str(row["word"])))
    head = ["word", "mentions", "participants", "stimuli", "spellings", *(["offered"] if offered_known else [])]
    return Lexicon(
        words=pd.DataFrame(rows, columns=head),
        participants=_mentions_by(mentioned, "participant"),
        stimuli=_mentions_by(placed, "stimulus"),
        mentions=mentions,
        unplaced=mentions - len(placed),
        normalisation=normalisation,
    )


def merge_word_lists(
    lists: Mapping[str, Iterable[str]],
    normalisation: Normalisation = "case_and_spaces",
    *,
    synonyms: Mapping[str, str] | None = None,
    inflected: bool = True,
) -> pd.DataFrame:
    """Merge lists of words into one lexicon with the sources of each word (thesis 5.3.3.2, Table 5.1).

    `lists` are words by their source. Spellings are merged by `normalisation` (see `lexicon`) and `synonyms`; with
    `inflected` also an English comparative, superlative or adverb (heavier, heaviest, heavily) with its base form
    (heavy) if that is in the lists, and a hyphen counts as a blank. Returns columns word (as first written), sources,
    n_sources, forms and note, in the order of first appearance; the note says what was merged. Raises a StatisticsError
    for a list without words, an empty word, and synonyms that contradict each other.
    """
    if normalisation not in KINDS:
        raise BadOption(f"normalisation={shown(normalisation)} is unknown: one of {', '.join(map(repr, KINDS))}")
    stands_for = _synonyms(synonyms or {}, normalisation)
    written: list[tuple[str, str, str]] = []
    for source, words in lists.items():
        for word in words:
            if not isinstance(word, str) or not word.strip():
                raise BadValue(f"the list {shown(source)}: a word is expected, found {shown(word)}")
            key = normalised(word, normalisation)
            written.append((source, word, " ".join(key.replace("-", " ").split()) if inflected else key))
    if empty := [source for source in lists if source not in {source for source, _, _ in written}]:
        raise BadValue(f"the list {shown(empty[0])} has no words")
    known = {key for _, _, key in written}
    merged: dict[str, list[tuple[str, str, str]]] = defaultdict(list)
    for source, word, key in written:
        base = stands_for.get(key, key)
        if base == key and inflected:
            base = next((form for form in _base_forms(key) if form in known), key)
            base = stands_for.get(base, base)
        merged[base].append((source, word, key))
    rows = []
    for base, entries in merged.items():
        forms = list(dict.fromkeys(" ".join(word.split()) for _, word, _ in entries))
        first = " ".join(next((word for _, word, key in entries if key == base), base).split())
        times = Counter(source for source, _, _ in entries)
        notes = [f"{count} times in {source}" for source, count in times.items() if count > 1]
        if others := [form for form in forms if form != first]:
            notes.append(f"counts also: {', '.join(others)}")
        rows.append(
            {
                **{"word": first, "sources": "; ".join(times), "n_sources": len(times)},
                **{"forms": "; ".join(forms), "note": "; ".join(notes)},
            }
        )
    return pd.DataFrame(rows, columns=["word", "sources", "n_sources", "forms", "note"])


def _base_forms(word: str) -> Iterator[str]:
    """Yield possible base forms of an English comparative, superlative or adverb: heaviest -> heavy, bigger -> big."""
    for ending in ("est", "er", "ly"):
        if word.endswith(ending) and len(word) > len(ending) + 2:
            stem = word[: -len(ending)]
            yield stem
            yield from [f"{stem[:-1]}y"] if stem.endswith("i") else []
            yield f"{stem}e"
            yield from [stem[:-1]] if len(stem) > 3 and stem[-1] == stem[-2] else []
            yield from [f"{stem}le"] if ending == "ly" else []  # gently, of gentle


def synonym_table(table: pd.DataFrame) -> dict[str, str]:
    """Return a table with the columns word and counts_as as a mapping. Raises SynonymTableError with the line."""
    for name in ("word", "counts_as"):
        if list(table.columns).count(name) != 1:
            known = ", ".join(map(repr, table.columns))
            raise SynonymTableError(f"the table of synonyms needs one column {name!r}; its columns are {known}")
    synonyms: dict[str, str] = {}
    for line, raw in enumerate(zip(table["word"].tolist(), table["counts_as"].tolist(), strict=True), start=2):
        word, counts_as = (cell.strip() if isinstance(cell, str) else "" for cell in raw)
        if not word or not counts_as:
            raise SynonymTableError(f"line {line}: a word and what it counts as are expected, found {raw!r}")
        if word in synonyms:
            raise SynonymTableError(f"line {line}: {word!r} appears twice; keep one line")
        synonyms[word] = counts_as
    return synonyms


def normalised(word: str, normalisation: str) -> str:
    """Return a word in its normalised form."""
    if normalisation == "as_written":
        return word
    spaced = re.sub(r"\s+", " ", unicodedata.normalize("NFKC", word)).strip()
    return spaced.casefold() if normalisation == "case_and_spaces" else spaced


@dataclass(frozen=True)
class _Mention:
    word: str
    written: tuple[str, ...]
    participant: Hashable
    stimulus: Hashable | None


def _synonyms(table: Mapping[str, str], normalisation: str) -> dict[str, str]:
    synonyms: dict[str, str] = {}
    for variant, word in table.items():
        key, value = normalised(variant, normalisation), normalised(word, normalisation)
        if key == value:
            raise SynonymTableError(f"{variant!r} counts as itself; leave it out of the synonyms")
        if synonyms.setdefault(key, value) != value:
            raise SynonymTableError(f"{variant!r} counts as {synonyms[key]!r} and as {value!r}; keep one")
    chained = [f"{key!r} as {value!r} as {synonyms[value]!r}" for key, value in synonyms.items() if value in synonyms]
    if chained:
        raise SynonymTableError(f"synonyms of synonyms: {listed(chained, len(chained))}; name the last word at once")
    return synonyms


def _mentions(
    data: pd.DataFrame,
    normalisation: str,
    stands_for: Mapping[str, str],
    names: tuple[str, str, str],
    trial: Sequence[Hashable],
) -> list[_Mention]:
    """Return one mention for each different word of a trial, whatever its spellings and repetitions there."""
    word, participant, stimulus = names
    if not len(data):
        return []
    if lost := [repr(name) for name in trial if name not in data]:
        raise UnknownColumn(f"no column {listed(lost, len(lost))}; `trial` names the columns that tell trials apart")
    places = [data[name].astype(object).where(data[name].notna(), None).tolist() for name in trial]
    who = combine_labels(data, [participant])
    people = [who.labels[int(code)] for code in who.codes]
    stimuli = data[stimulus].astype(object).where(data[stimulus].notna(), None).tolist()
    written: dict[Any, set[str]] = defaultdict(set)
    for at, text in enumerate(data[word].tolist()):
        counted = normalised(text, normalisation)
        where = (people[at], tuple(place[at] for place in places), None if stimuli[at] == "" else stimuli[at])
        written[stands_for.get(counted, counted), where].add(text)
    return [_Mention(word, tuple(sorted(forms)), key[0], key[2]) for (word, key), forms in written.items()]


def _mentions_by(mentions: Iterable[_Mention], what: Literal["participant", "stimulus"]) -> pd.DataFrame:
    """Return the mentions and different words of each participant or stimulus, and how many words nobody else has."""
    words: dict[Any, Counter[str]] = defaultdict(Counter)
    for mention in mentions:
        words[getattr(mention, what)][mention.word] += 1
    shared = Counter(word for own in words.values() for word in own)
    rows = [
        {
            what: label,
            "mentions": sum(words[label].values()),
            "words": len(words[label]),
            "words_of_its_own": sum(shared[word] == 1 for word in words[label]),
        }
        for label in ordered(list(words))
    ]
    return pd.DataFrame(rows, columns=[what, "mentions", "words", "words_of_its_own"])


def mean_and_sd(values: Sequence[float]) -> tuple[float, float]:
    """Return the mean and the SD (n - 1), NaN for too few values."""
    return (fmean(values) if values else math.nan), (stdev(values) if len(values) > 1 else math.nan)
