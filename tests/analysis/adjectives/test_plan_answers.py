"""Adjective selection as an analysis plan asks for it, on recorded sessions and on a small study."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from palpate.analysis.plans import kinds
from palpate.analysis.plans.answers import Answer, Selected
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.reading import read_material
from palpate.studies.collecting.collect import collect, open_database
from tests.analysis.adjectives.tables import WORDS, random_ticks, tables

RECORDED = Path(__file__).parents[2] / "recorded" / "ten"
PAIRS = [["Rough", "Smooth"], ["Hard", "Soft"]]
SETTINGS: dict[str, dict[str, Any]] = {
    "relevance": {"normalisation": "share_of_maximum", "threshold": 0.5},
    "adjective_pairs": {"normalisation": "share_of_maximum", "threshold": 0.5, "antonyms": PAIRS},
    "word_agreement": {},
    "lexicon": {},
}


def answer(test: str, given: Selected, **settings: Any) -> Answer:
    kind = kinds.TESTS[test]
    request = kind.settings.model_validate({"name": "x", "test": test, **SETTINGS[test], **settings})
    before = given.table.copy()
    result = kind.answer(given, request)
    pd.testing.assert_frame_equal(before, given.table)
    return result


def small(people: int = 8) -> Selected:
    words, trials = tables(random_ticks(people, 5, seed=2))
    further = {"participant": "P0", "session": "s/P0/1", "trial": 0, "stimulus": "T0", "word": "Woven"}
    closing = {"participant": "P1", "session": "s/P1/1", "word": "woven"}
    free = pd.DataFrame([{**further, "kind": "further"}, {**closing, "kind": "words"}])
    return Selected(pd.concat([words, free], ignore_index=True), trials, (), {}, seed=1, draws=200, offered=WORDS)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Selected]:
    """The recorded sessions of the three studies of words, as a plan's test gets them."""
    engine = open_database(f"sqlite:///{tmp_path_factory.mktemp('collected') / 'lab.sqlite'}")
    names = ("texture_adjectives", "door_adjectives", "door_lexicon")
    for _ in collect([RECORDED / f"{name}_P001_s1.sqlite" for name in names], engine):
        pass
    result = {}
    for name in names:
        material = read_material(engine, name, digest=None, include_incomplete=False, simulated=None)
        listed = material.study.adjectives.words if material.study and material.study.adjectives else ()
        offered = tuple(entry.word for entry in listed)
        result[name] = Selected(material.words, material.trials, (), {}, draws=200, offered=offered)
    engine.dispose()
    return result


@pytest.mark.parametrize("test", SETTINGS)
def test_every_answer_is_plain_values_with_words_for_them(test: str) -> None:
    result = answer(test, small())
    for row in (row for rows in (result.rows, *result.more.values()) for row in rows):
        for value in row.values():
            assert value is None or type(value) in (float, int, str, bool)
            assert not isinstance(value, float) or math.isfinite(value)
        assert None not in row.values() or row["note"]
    assert result.rows
    assert result.headline.endswith(".")
    assert result.method.endswith(".")


def test_relevance_counts_what_was_ticked_alone_and_names_the_normalisation() -> None:
    result = answer("relevance", small())
    assert {row["word"] for row in result.rows} == set(WORDS)
    assert result.kinds["relevance"] == "share of the most ticked word's ticks (share_of_maximum)"
    assert (result.participants, result.rows[0]["relevance"], result.rows[-1]["relevance"]) == (8, 1.0, 0.0)
    assert "of 5 words reach 0.5 of the most ticked word's ticks" in result.headline
    for name in ("share_of_trials", "any_stimulus"):
        assert name in answer("relevance", small(), normalisation=name, interval="bca").kinds["relevance"]


def test_neither_normalisation_nor_threshold_is_chosen_in_silence() -> None:
    model = kinds.TESTS["relevance"].settings
    for missing in ("normalisation", "threshold"):
        given = {"name": "x", "test": "relevance", **SETTINGS["relevance"]}
        del given[missing]
        with pytest.raises(ValueError, match=missing):
            model.model_validate(given)


def test_pairs_are_made_of_kept_words_and_the_rest_is_reported() -> None:
    result = answer("adjective_pairs", small(), threshold=0.2)
    assert {(row["word"], row["antonym"]) for row in result.rows} == {("Rough", "Smooth"), ("Hard", "Soft")}
    fewer = answer("adjective_pairs", small(), threshold=0.2, antonyms=PAIRS[:1])
    assert {row["word"] for row in fewer.more["left_out"]} == {"Hard", "Soft"}
    assert fewer.notes[0].startswith("Left out for lack of a pair: ")
    with pytest.raises(ValueError, match="line 2: 'Calm' was not offered"):
        answer("adjective_pairs", small(), antonyms=[["Calm", "Rough"]])
    new = answer("adjective_pairs", small(), threshold=0.2, antonyms=[["Rough", "Even"]], new_words=True)
    assert new.rows[0]["relevance_antonym"] is None
    assert "was not offered" in str(new.rows[0]["note"])
    with pytest.raises(DataRefused, match="the plan has no table 'antonyms'"):
        answer("adjective_pairs", small(), antonyms="antonyms")
    own = {"antonyms": pd.DataFrame(PAIRS, columns=["word", "antonym"])}
    named = answer("adjective_pairs", replace(small(), tables=own), threshold=0.2, antonyms="antonyms")
    assert named.rows == result.rows


def test_the_lexicon_takes_suggestions_with_and_without_a_trial() -> None:
    result = answer("lexicon", small())
    assert result.rows == (
        {
            **{"word": "woven", "mentions": 2, "participants": 2, "stimuli": 1},
            **{"spellings": "Woven; woven", "offered": False},
        },
    )
    assert result.notes == ("1 mention without a stimulus (suggestions).",)
    assert answer("lexicon", small(), kinds=["further"]).rows[0]["mentions"] == 1
    assert answer("lexicon", small(), synonyms={"woven": "fabric"}).rows[0]["word"] == "fabric"
    with pytest.raises(DataRefused, match="kinds of word there: further, ticked, words"):
        answer("lexicon", small(), kinds=["spoken"])


def test_further_lists_are_merged_with_what_was_written() -> None:
    own = {"literature": pd.DataFrame({"word": ["Woven", "calm"]})}
    given = replace(small(), tables=own)
    result = answer("lexicon", given, lists={"literature": "literature", "authors": ["calmer", "stiff"]})
    merged = {row["word"]: row["sources"] for row in result.more["merged"]}
    assert merged == {"woven": "experiment; literature", "calm": "literature; authors", "stiff": "authors"}
    note = "Merged lexicon: 3 words (1 of experiment, 2 of literature, 2 of authors; 2 are of more than one source)."
    assert result.notes[-1] == note
    apart = answer("lexicon", given, lists={"authors": ["calmer", "calm"]}, inflected=False)
    assert len(apart.more["merged"]) == 3
    with pytest.raises(DataRefused, match="no table 'literatur'; did you mean 'literature'"):
        answer("lexicon", given, lists={"books": "literatur"})
    with pytest.raises(DataRefused, match="'experiment' means the words written in this study"):
        answer("lexicon", given, lists={"experiment": ["calm"]})
    with pytest.raises(DataRefused, match="no column 'word'; it has adjective"):
        answer("lexicon", replace(given, tables={"t": pd.DataFrame({"adjective": ["calm"]})}), lists={"books": "t"})
    with pytest.raises(ValueError, match="inflected is about lists"):
        answer("lexicon", given, inflected=False)


def test_a_study_without_words_is_refused() -> None:
    ratings = pd.DataFrame({"participant": ["P1"], "attribute": ["rough"], "value": [1.0]})
    with pytest.raises(DataRefused, match="words are ticked"):
        answer("relevance", Selected(ratings, pd.DataFrame(), ("rough",), {}))


def test_recorded_sessions_of_one_participant(recorded: dict[str, Selected]) -> None:
    textures, doors = recorded["texture_adjectives"], recorded["door_adjectives"]
    ticked = textures.table[textures.table["kind"] == "ticked"]
    result = answer("relevance", textures, normalisation="share_of_trials")
    by_word = {row["word"]: row for row in result.rows}
    assert len(by_word) == 57
    for word, count in ticked["word"].value_counts().items():
        assert by_word[word]["relevance"] == count / len(textures.trials)
    assert by_word["Hard"]["ci_low"] is None
    assert "two participants" in str(by_word["Hard"]["note"])
    assert len(answer("relevance", doors, threshold=0.2).rows) == 68
    with pytest.raises(ValueError, match="two participants"):
        answer("word_agreement", doors)
    words = answer("lexicon", recorded["door_lexicon"])
    assert sum(int(row["mentions"] or 0) for row in words.more["stimuli"]) == words.values
    assert [row["stimulus"] for row in words.more["stimuli"]] == ["BC3", "FORD", "G90", "K3", "K8", "MQ4"]
