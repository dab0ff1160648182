"""Free words counted under a named normalisation, with synonyms, and suggestions without a stimulus."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.adjectives.lexicon import (
    Lexicon,
    SynonymTableError,
    lexicon,
    merge_word_lists,
    normalised,
    synonym_table,
)
from palpate.analysis.statistics.refusals import BadOption, BadValue, UnknownColumn
from palpate.studies.catalogue import SHIPPED, read_study

ROWS = [
    ("P1", 1, "BC3", "Heavy"),
    ("P1", 1, "BC3", " heavy "),  # the same word twice in one trial
    ("P1", 2, "K3", "easy  to open"),
    ("P2", 1, "K3", "HEAVY"),
    ("P2", 1, "K3", "weighty"),
    ("P2", 2, "BC3", "jerky"),
    ("P3", np.nan, None, "velvety"),  # a suggestion at the end
]


def written() -> pd.DataFrame:
    table = pd.DataFrame(ROWS, columns=["participant", "trial", "stimulus", "word"])
    return table.assign(session="s/" + table["participant"])


def counts(result: Lexicon) -> dict[str, tuple[int, int, int]]:
    rows = result.words.to_dict("records")
    return {row["word"]: (row["mentions"], row["participants"], row["stimuli"]) for row in rows}


def test_words_are_counted_once_a_trial_and_shared_by_people_and_stimuli() -> None:
    result = lexicon(written())
    assert counts(result) == {
        "heavy": (2, 2, 2),
        "easy to open": (1, 1, 1),
        "jerky": (1, 1, 1),
        "velvety": (1, 1, 0),
        "weighty": (1, 1, 1),
    }
    assert result.words.loc[0, "spellings"] == " heavy ; HEAVY; Heavy"
    assert (result.mentions, result.unplaced) == (6, 1)
    assert result.participants.to_dict("list") == {
        "participant": ["P1", "P2", "P3"],
        "mentions": [2, 3, 1],
        "words": [2, 3, 1],
        "words_of_its_own": [1, 2, 1],
    }
    assert result.stimuli["stimulus"].tolist() == ["BC3", "K3"]
    assert result.stimuli["mentions"].tolist() == [2, 3]


def test_trials_that_cannot_be_distinguished_are_refused() -> None:
    with pytest.raises(UnknownColumn, match="no column 'trial'"):
        lexicon(written().drop(columns="trial"))


def test_each_normalisation_says_what_is_one_word() -> None:
    assert [normalised(" Easy  TO open", kind) for kind in ("as_written", "spaces", "case_and_spaces")] == [
        " Easy  TO open",
        "Easy TO open",
        "easy to open",
    ]
    assert len(lexicon(written(), "as_written").words) == 7
    assert len(lexicon(written(), "spaces").words) == 7  # Heavy, heavy and HEAVY still differ
    assert normalised("\ufb01ne", "spaces") == "fine"  # a ligature is the letters it stands for
    with pytest.raises(BadOption, match="normalisation='lower'"):
        lexicon(written(), "lower")  # type: ignore[arg-type]


def test_synonyms_count_as_one_and_contradictions_are_refused() -> None:
    result = lexicon(written(), synonyms={"Weighty": "Heavy"})
    assert counts(result)["heavy"] == (2, 2, 2)  # P2 wrote both in one trial
    assert "weighty" not in counts(result)
    with pytest.raises(SynonymTableError, match="synonyms of synonyms: 'weighty' as 'heavy' as 'massive'"):
        lexicon(written(), synonyms={"weighty": "heavy", "heavy": "massive"})
    with pytest.raises(SynonymTableError, match="counts as itself"):
        lexicon(written(), synonyms={"Heavy": "heavy"})
    with pytest.raises(SynonymTableError, match="as 'heavy' and as 'massive'"):
        lexicon(written(), synonyms={"weighty": "heavy", "WEIGHTY": "massive"})


def test_a_table_of_synonyms_is_read_or_refused_with_its_line() -> None:
    table = pd.DataFrame({"word": ["weighty", "leaden"], "counts_as": ["heavy", "heavy"]})
    assert synonym_table(table) == {"weighty": "heavy", "leaden": "heavy"}
    with pytest.raises(SynonymTableError, match="line 4: 'leaden' appears twice"):
        synonym_table(pd.concat([table, table.iloc[[1]]]))
    with pytest.raises(SynonymTableError, match="'counts_as'"):
        synonym_table(table.rename(columns={"counts_as": "means"}))


def test_what_was_offered_already_is_marked() -> None:
    result = lexicon(written(), offered=("Heavy", "Easy to open")).words.set_index("word")
    assert result["offered"].to_dict() == {
        "heavy": True,
        "easy to open": True,
        "jerky": False,
        "velvety": False,
        "weighty": False,
    }


def test_rows_and_repeated_rows_change_nothing() -> None:
    mixed = pd.concat([written(), written().iloc[2:5]]).sample(frac=1, random_state=3)
    for name in ("words", "participants", "stimuli"):
        pd.testing.assert_frame_equal(getattr(lexicon(written()), name), getattr(lexicon(mixed), name))


def test_what_is_no_word_is_refused() -> None:
    with pytest.raises(BadValue, match="'  ' in row 8"):
        lexicon(pd.concat([written(), written().iloc[[0]].assign(word="  ")], ignore_index=True))


LISTS = {
    "experiment": ["heavy", "easy to pull", "smooth", "big", "gentle", "clever"],
    "hyundai": ["Heavy ", "Heavier", "Hard-to-pull", "Easy-to-pull"],
    "literature": ["smoothly", "bigger", "gently", "heavily", "Weighty", "calm", "calming", "calm"],
}


def test_sourced_lists_become_one_lexicon_that_keeps_the_sources() -> None:
    merged = merge_word_lists(LISTS, synonyms={"weighty": "heavy"}).set_index("word")
    assert merged["sources"].to_dict() == {
        "heavy": "experiment; hyundai; literature",
        "easy to pull": "experiment; hyundai",
        "smooth": "experiment; literature",
        "big": "experiment; literature",
        "gentle": "experiment; literature",
        "clever": "experiment",
        "Hard-to-pull": "hyundai",
        "calm": "literature",
        "calming": "literature",
    }
    assert merged.loc["heavy", "note"] == (
        "2 times in hyundai; 2 times in literature; counts also: Heavy, Heavier, heavily, Weighty"
    )
    assert merged.loc["calm", "note"] == "2 times in literature" and merged.loc["clever", "note"] == ""
    assert merged["n_sources"].sum() == 15


def test_words_are_distinguished_as_requested_and_table_5_1_keeps_all_of_its_68() -> None:
    apart = merge_word_lists(LISTS, inflected=False)["word"].tolist()
    assert {"Heavier", "smoothly", "easy to pull", "Easy-to-pull"} <= set(apart)
    assert len(merge_word_lists(LISTS, "as_written", inflected=False)) == 17
    listed = read_study(SHIPPED / "door_adjectives" / "study.yaml").study.adjectives.words
    assert len(merge_word_lists({"Table 5.1": [entry.word for entry in listed]})) == 68
    with pytest.raises(BadValue, match="'none' has no words"):
        merge_word_lists({"some": ["calm"], "none": []})
    with pytest.raises(BadValue, match="'some': a word is expected, found ' '"):
        merge_word_lists({"some": [" "]})
    with pytest.raises(BadOption, match="normalisation='lower'"):
        merge_word_lists(LISTS, "lower")  # type: ignore[arg-type]
