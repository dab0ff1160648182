"""Tests of adjective selection in plans: relevance, bipolar pairs, agreement on words, a lexicon of free words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from palpate.analysis.plans.answers import Answer, Confidence, Kind, Row, Selected, StatisticSettings
from palpate.protocols.study import Text
from palpate.protocols.wording import count, some

if TYPE_CHECKING:
    import pandas as pd

    from palpate.analysis.adjectives.selections import Selections

Threshold = Annotated[float, Field(gt=0, le=1)]
Normalisation: TypeAlias = Literal["share_of_trials", "share_of_maximum", "any_stimulus"]
TICKED, WRITTEN = "ticked", "experiment"
"""The kind of ticked words, and the source of words written in a study."""
LISTED = 20
SHARE_OF = {
    "share_of_trials": "of the answered trials",
    "share_of_maximum": "of the most ticked word's ticks",
    "any_stimulus": "of the participants for some stimulus",
}


class RelevanceSpec(StatisticSettings):
    """The relevance of each offered word; normalisation and threshold have no default on purpose."""

    test: Literal["relevance"]
    normalisation: Normalisation
    threshold: Threshold
    interval: Literal["percentile", "bca"] = "percentile"
    draws: Annotated[int, Field(ge=100, le=1_000_000)] | None = None
    confidence: Confidence = 0.95


class PairsSpec(StatisticSettings):
    """Bipolar pairs of the kept words; `antonyms` are pairs, or the name of a table with columns word, antonym.

    A pair needs one kept word; with `need_both`, two. With `new_words` an antonym may be a word that was not offered.
    """

    test: Literal["adjective_pairs"]
    normalisation: Normalisation
    threshold: Threshold
    antonyms: Text | tuple[tuple[Text, Text], ...]
    need_both: bool = False
    new_words: bool = False


class AgreementSpec(StatisticSettings):
    """The agreement of participants on words."""

    test: Literal["word_agreement"]
    confidence: Confidence = 0.95


class LexiconSpec(StatisticSettings):
    """The words that participants wrote; `kinds` are kinds of word (None: all but the ticked ones).

    `synonyms` maps a word to the word that it counts as, or names a table with columns word, counts_as. `lists` are
    further words by source, each a list or the name of a table with a column word: they are merged with the written
    words into one lexicon with sources; `inflected` says whether heavier then counts as heavy.
    """

    test: Literal["lexicon"]
    kinds: tuple[Text, ...] | None = None
    normalisation: Literal["as_written", "spaces", "case_and_spaces"] = "case_and_spaces"
    synonyms: Text | Mapping[Text, Text] = Field(default_factory=dict)
    lists: Annotated[Mapping[Text, Text | tuple[Text, ...]], Field(max_length=20)] = Field(default_factory=dict)
    inflected: bool = True

    @model_validator(mode="after")
    def _inflected_with_lists(self) -> Self:
        if "inflected" in self.model_fields_set and not self.lists:
            raise ValueError("inflected is about lists: {SOURCE: [WORD, ...]}, which are merged; there are none")
        return self


def relevance_answer(selected: Selected, settings: RelevanceSpec) -> Answer:
    """Return the relevance of every word, most relevant first."""
    from palpate.analysis.adjectives.relevance import relevance
    from palpate.analysis.plans.answers import plain_rows

    selections = _selections(selected)
    draws = settings.draws or selected.draws
    relevances = relevance(
        selections,
        settings.normalisation,
        settings.threshold,
        draws=draws,
        seed=selected.seed,
        interval=settings.interval,
        confidence=settings.confidence,
    )
    how = f"{settings.confidence:.0%} {settings.interval} interval, {draws} draws of participants, seed {selected.seed}"
    kinds = {
        "ticks": "trials in which the word was ticked",
        "relevance": f"share {SHARE_OF[settings.normalisation]} ({settings.normalisation})",
        "ci_low": how,
        "ci_high": how,
        "kept_chance": f"share of the draws in which the word reaches {settings.threshold:g}",
    }
    method = f"Relevance of adjectives by {settings.normalisation}, kept from {settings.threshold:g} on."
    kept = relevances.loc[relevances["kept"], "word"].tolist()
    more = f"; and {len(kept) - LISTED} more" if len(kept) > LISTED else ""
    names = f": {'; '.join(kept[:LISTED])}{more}" if kept else ""
    of_what = SHARE_OF[settings.normalisation]
    headline = f"{len(kept)} of {len(relevances)} words reach {settings.threshold:g} {of_what}{names}."
    return _answer(selected, selections, plain_rows(relevances, finite=True), method, kinds, headline)


def pairs_answer(selected: Selected, settings: PairsSpec) -> Answer:
    """Return the bipolar pairs of the kept words, with unpaired kept words in `more`."""
    import pandas as pd

    from palpate.analysis.adjectives.antonyms import antonym_pairs
    from palpate.analysis.adjectives.relevance import relevance

    selections = _selections(selected)
    scores = relevance(selections, settings.normalisation, settings.threshold, draws=0)
    score: dict[str, float] = dict(zip(scores["word"], scores["relevance"].tolist(), strict=True))
    kept = scores.loc[scores["kept"], "word"].tolist()
    offered = () if settings.new_words else selected.offered
    antonyms = (
        _own_table(selected, settings.antonyms)
        if isinstance(settings.antonyms, str)
        else pd.DataFrame(list(settings.antonyms), columns=["word", "antonym"])
    )
    matches = antonym_pairs(kept, antonyms, offered, need_both=settings.need_both)
    rows: list[Row] = []
    for word, antonym, word_kept, antonym_kept in matches.pairs:
        absent = [name for name in (word, antonym) if name not in score]
        rows.append(
            {
                **{"word": word, "antonym": antonym, "word_kept": word_kept, "antonym_kept": antonym_kept},
                **{"relevance_word": score.get(word), "relevance_antonym": score.get(antonym)},
                "note": f"{absent[0]} was not offered and has no relevance" if absent else "",
            }
        )
    left: tuple[Row, ...] = tuple(
        {"word": unpaired, "relevance": score[unpaired], "note": "no pair"} for unpaired in matches.left_out
    )
    named = ", ".join(f"{pair.word}–{pair.antonym}" for pair in matches.pairs)
    headline = f"{len(rows)} bipolar pairs of {len(kept)} kept words" + (f": {named}." if rows else ".")
    notes = [f"Left out for lack of a pair: {', '.join(matches.left_out)}."] if left else []
    kinds = {f"relevance_{end}": f"relevance by {settings.normalisation}" for end in ("word", "antonym")}
    method = f"Antonym pairs of the words that reach {settings.threshold:g} by {settings.normalisation}."
    return _answer(selected, selections, rows, method, kinds, headline, notes, {"left_out": left})


def agreement_answer(selected: Selected, settings: AgreementSpec) -> Answer:
    """Return the agreement by word, with that by stimulus in `more`."""
    from palpate.analysis.adjectives.agreement import word_agreement
    from palpate.analysis.plans.answers import plain_rows, with_interval

    selections = _selections(selected)
    by_word = word_agreement(selections, draws=selected.draws, seed=selected.seed, confidence=settings.confidence)
    together = by_word.words.iloc[-1]
    limits = (together["ci_low"], together["ci_high"], settings.confidence)
    alpha = with_interval("Krippendorff's alpha of all words", together["alpha"], *limits)
    overlap = (by_word.jaccard, by_word.jaccard_low, by_word.jaccard_high, settings.confidence)
    headline = f"{alpha}; {with_interval('mean Jaccard overlap of two participants', *overlap)}."
    how = f"{settings.confidence:.0%} percentile interval, {selected.draws} draws of stimuli, seed {selected.seed}"
    kinds = {
        "alpha": "Krippendorff's alpha, nominal: ticked or not, stimuli as units",
        "kappa": "Fleiss' kappa, ticked or not",
        "jaccard": "mean overlap of two participants' sets of words (interval: draws of participants)",
        "ci_low": how,
        "ci_high": how,
    }
    notes = [
        "All words together: agreeing that a word is seldom ticked counts as agreement; read the single words too.",
        *([by_word.note] if by_word.note else []),
    ]
    method = "Agreement on words: Krippendorff 2011, Fleiss 1971, Jaccard 1901."
    more = {"stimuli": plain_rows(by_word.stimuli, finite=True)}
    return _answer(selected, selections, plain_rows(by_word.words, finite=True), method, kinds, headline, notes, more)


def lexicon_answer(selected: Selected, settings: LexiconSpec) -> Answer:
    """Return the different words that were written, with participants and stimuli in `more`."""
    from palpate.analysis.adjectives.lexicon import lexicon, mean_and_sd, merge_word_lists, synonym_table
    from palpate.analysis.plans.answers import plain_rows, require_columns
    from palpate.analysis.ratings.dataset import NoRows
    from palpate.analysis.statistics.apa import number

    table = selected.table
    require_columns(table, ("participant", "kind", "word"))
    of_kinds = table["kind"].isin(settings.kinds) if settings.kinds is not None else table["kind"] != TICKED
    if not of_kinds.any():
        there = ", ".join(sorted(set(table["kind"]))) or "none at all"
        raise NoRows(f"no written words among the answers; kinds of word there: {there}")
    written = table[of_kinds]
    synonyms = settings.synonyms
    if isinstance(synonyms, str):
        synonyms = synonym_table(_own_table(selected, synonyms))
    word_list = lexicon(written, settings.normalisation, synonyms=synonyms, offered=selected.offered)
    per_person, sd = mean_and_sd(word_list.participants["words"].tolist())
    headline = (
        f"{count(len(word_list.words), 'different word')} in {count(word_list.mentions, 'mention')} by "
        f"{count(len(word_list.participants), 'participant')} "
        f"({number(per_person)} different words each, SD {number(sd) if sd >= 0 else 'undefined'})."
    )
    notes = [f"{count(word_list.unplaced, 'mention')} without a stimulus (suggestions)."] if word_list.unplaced else []
    kinds = {
        "mentions": "trials in which the word was written",
        "participants": "how many wrote it",
        "words_of_its_own": "words that no other participant wrote (that were written of no other stimulus)",
    }
    method = f"Lexicon of written words, normalised by {settings.normalisation}, {len(synonyms)} synonyms."
    more = {
        "participants": plain_rows(word_list.participants, finite=True),
        "stimuli": plain_rows(word_list.stimuli, finite=True),
    }
    if settings.lists:
        lists = {WRITTEN: word_list.words["word"].tolist(), **_lists(selected, settings)}
        merged = merge_word_lists(lists, settings.normalisation, synonyms=synonyms, inflected=settings.inflected)
        more["merged"] = plain_rows(merged, finite=True)
        of_each = Counter(source for sources in merged["sources"] for source in sources.split("; "))
        numbers = ", ".join(f"{of_each[source]} of {source}" for source in lists)
        several = int((merged["n_sources"] > 1).sum())
        notes.append(
            f"Merged lexicon: {count(len(merged), 'word')} ({numbers}; {several} are of more than one source)."
        )
        kinds |= {"sources": "where the word comes from", "forms": "how it is written there"}
    return Answer(
        *(plain_rows(word_list.words, finite=True), method, kinds, len(word_list.participants), len(written)),
        headline,
        tuple(notes),
        more,
    )


def _selections(selected: Selected) -> Selections:
    from palpate.analysis.adjectives.selections import gather_selections
    from palpate.analysis.ratings.dataset import NoRows

    if "kind" not in selected.table.columns or not len(selected.trials):
        raise NoRows("no adjectives were chosen here: this test needs a study in which words are ticked")
    ticked = selected.table[selected.table["kind"] == TICKED]
    return gather_selections(ticked, selected.trials, selected.offered)


def _lists(selected: Selected, settings: LexiconSpec) -> dict[str, list[str]]:
    """Return the words of each list. Raises DataRefused for a table without words, or with the study's own name."""
    from palpate.analysis.ratings.dataset import DataRefused

    words: dict[str, list[str]] = {}
    for source, named in settings.lists.items():
        if source == WRITTEN:
            raise DataRefused(f"lists: {WRITTEN!r} means the words written in this study; give the list another name")
        if isinstance(named, str):
            table = _own_table(selected, named)
            if "word" not in table.columns:
                raise DataRefused(f"the table {named!r} has no column 'word'; it has {some(table.columns)}")
            words[source] = table["word"].tolist()
        else:
            words[source] = list(named)
    return words


def _own_table(selected: Selected, name: str) -> pd.DataFrame:
    from palpate.analysis.ratings.dataset import DataRefused
    from palpate.protocols.did_you_mean import nearest

    if name not in selected.tables:
        raise DataRefused(f"the plan has no table {name!r}; {nearest(name, selected.tables)}")
    return selected.tables[name]


def _answer(
    selected: Selected,
    selections: Selections,
    rows: Sequence[Row],
    method: str,
    kinds: Mapping[str, str],
    headline: str,
    notes: Sequence[str] = (),
    more: Mapping[str, tuple[Row, ...]] | None = None,
) -> Answer:
    known = () if selected.offered else ("The words that were offered are not known: one never ticked is not listed.",)
    presented = selections.presented
    several = presented.min() != 1 or presented.max() != 1
    again = ("Stimuli were met more than once, or not by all.",) if several else ()
    people, ticks = len(selections.participants), int(selections.ticked.sum())
    return Answer(tuple(rows), method, kinds, people, ticks, headline, (*notes, *known, *again), more or {})


KINDS: Mapping[str, Kind] = {
    "relevance": Kind("relevance of words", RelevanceSpec, relevance_answer, takes="words", each="all"),
    "adjective_pairs": Kind("pairs of adjectives", PairsSpec, pairs_answer, takes="words", each="all"),
    "word_agreement": Kind("agreement on words", AgreementSpec, agreement_answer, takes="words", each="all"),
    "lexicon": Kind("words written", LexiconSpec, lexicon_answer, takes="words", each="all"),
}
