"""The words that each participant ticked for each stimulus, as counts, for relevance and agreement."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.analysis.reliability.crossed import combine_labels
from palpate.analysis.statistics.cells import check_columns
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.refusals import BadOption, BadValue, UnknownColumn, listed
from palpate.protocols.did_you_mean import nearest

Counts: TypeAlias = NDArray[np.intp]


@dataclass(frozen=True)
class Selections:
    """The counts of ticked words: `ticked` (participants, stimuli, words) and `presented` (participants, stimuli).

    `ticked` counts the trials in which a word was ticked, `presented` all trials. Words are in the order in which they
    were offered, participants and stimuli in natural order.
    """

    ticked: Counts
    presented: Counts
    participants: list[Hashable]
    stimuli: list[Hashable]
    words: list[str]
    offered_known: bool

    @property
    def trials(self) -> int:
        """The number of answered trials."""
        return int(self.presented.sum())

    @property
    def any_ticked(self) -> Floats:
        """For each participant, stimulus and word: 1 if it was ticked in at least one trial, else 0."""
        return (self.ticked > 0).astype(np.float64)


def gather_selections(
    words: pd.DataFrame,
    trials: pd.DataFrame,
    offered: Sequence[str] = (),
    *,
    word: str = "word",
    participant: str = "participant",
    stimulus: str = "stimulus",
    trial: Sequence[str] = ("session", "trial"),
) -> Selections:
    """Return the selections of a long table of ticked words, and of the trials in which words could be ticked.

    `trials` has one row per answered trial, also where nothing was ticked; `trial` are the columns that, with the
    participant, name a trial. A duplicate row counts once. Without `offered` only words that somebody ticked are
    included. Raises UnknownColumn, BadValue (a word that was not offered, a trial that is not among the trials, a trial
    with two stimuli) or BadOption.
    """
    names = [participant, *trial]
    check_columns(trials, [*names, stimulus])
    check_words(words, [*names, word])
    listed_words = _offered(words, offered, word)
    where, keys = combine_labels(trials, [*names, stimulus]), combine_labels(trials, names)
    stimulus_of: dict[Any, Hashable] = {}
    for label in where.labels:
        parts: Any = label
        if (other := stimulus_of.setdefault(parts[:-1], parts[-1])) != parts[-1]:
            raise BadValue(f"the trial {parts[:-1]!r} has two stimuli, {other!r} and {parts[-1]!r}; name every trial")
    who, what = combine_labels(trials, [participant]), combine_labels(trials, [stimulus])
    at = {label: code for code, label in enumerate(keys.labels)}
    first = np.zeros(len(keys.labels), dtype=np.intp)
    first[keys.codes] = np.arange(len(trials))
    presented = np.zeros((len(who.labels), len(what.labels)), dtype=np.intp)
    np.add.at(presented, (who.codes[first], what.codes[first]), 1)
    ticked = np.zeros((*presented.shape, len(listed_words)), dtype=np.intp)
    if len(words):
        named = combine_labels(words, names)
        if lost := [label for label in named.labels if label not in at]:
            raise BadValue(f"words of trials that are not among the trials: {listed(map(repr, lost), len(lost))}")
        place = {offered_word: i for i, offered_word in enumerate(listed_words)}
        rows = np.array([at[label] for label in named.labels], dtype=np.intp)[named.codes]
        columns = np.array([place[offered_word] for offered_word in words[word].tolist()], dtype=np.intp)
        both = np.unique(rows * len(listed_words) + columns)  # the trial and the word of every tick, each once
        rows, columns = first[both // len(listed_words)], both % len(listed_words)
        np.add.at(ticked, (who.codes[rows], what.codes[rows], columns), 1)
    return Selections(ticked, presented, who.labels, what.labels, listed_words, bool(offered))


def check_words(words: pd.DataFrame, names: Sequence[Hashable]) -> None:
    """Refuse a table of words without one of these columns, or with a word that is not text; it may be empty."""
    if not isinstance(words, pd.DataFrame):
        raise UnknownColumn(f"words is a {type(words).__name__}; expected a pandas DataFrame, one row per word")
    if len(words):
        check_columns(words, names)
    column = words[names[-1]].tolist() if len(words) else []
    wrong = [row for row, text in enumerate(column) if not isinstance(text, str) or not text.strip()]
    if wrong:
        listing = listed((f"{column[row]!r} in row {row + 1}" for row in wrong), len(wrong))
        raise BadValue(f"column {names[-1]!r} must hold words; found {listing}")


def _offered(words: pd.DataFrame, offered: Sequence[str], word: str) -> list[str]:
    if isinstance(offered, str):
        raise BadOption(f"offered={offered!r} is one text; a list of words is expected")
    twice = sorted({ticked_word for ticked_word in offered if list(offered).count(ticked_word) > 1})
    if twice:
        raise BadOption(f"words offered twice: {listed(map(repr, twice), len(twice))}; each may stand once")
    there: list[str] = sorted(set(words[word].tolist())) if len(words) else []
    if not offered:
        return there
    strange = [ticked_word for ticked_word in there if ticked_word not in set(offered)]
    if strange:
        listing = listed(
            (f"{ticked_word!r} ({nearest(ticked_word, offered)})" for ticked_word in strange), len(strange)
        )
        raise BadValue(f"words that were not offered: {listing}; keep ticked words only, or offer them")
    return list(offered)
