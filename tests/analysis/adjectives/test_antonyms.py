"""Bipolar pairs, and every mistake that a table of antonyms can hold, with its line."""

from __future__ import annotations

import pandas as pd
import pytest

from palpate.analysis.adjectives.antonyms import AntonymTableError, antonym_pairs
from palpate.analysis.statistics.refusals import UnknownColumn

OFFERED = ("Rough", "Smooth", "Flat", "Bumpy", "Hard", "Soft", "Grainy", "Thin", "Thick")
GOOD = [("Rough", "Smooth"), ("Flat", "Bumpy"), ("Hard", "Soft"), ("Thin", "Thick")]


def table(pairs: list[tuple[object, object]]) -> pd.DataFrame:
    return pd.DataFrame(pairs, columns=["word", "antonym"])


def refused(pairs: list[tuple[object, object]]) -> str:
    with pytest.raises(AntonymTableError) as caught:
        antonym_pairs(["Rough"], table(pairs), OFFERED)
    return str(caught.value)


def test_both_kept_make_one_pair_and_who_has_no_antonym_is_left_out() -> None:
    result = antonym_pairs(["Smooth", "Grainy", "Rough", "Bumpy", "Flat", "Soft"], table(GOOD), OFFERED)
    assert [(pair.word, pair.antonym) for pair in result.pairs] == GOOD[:3]  # in the order of relevance
    assert [(pair.word_kept, pair.antonym_kept) for pair in result.pairs] == [(True, True), (True, True), (False, True)]
    assert result.left_out == ("Grainy",)


def test_with_need_both_one_kept_word_makes_no_pair() -> None:
    result = antonym_pairs(["Rough", "Smooth", "Soft"], table(GOOD), OFFERED, need_both=True)
    assert [(pair.word, pair.antonym) for pair in result.pairs] == [("Rough", "Smooth")]
    assert result.left_out == ("Soft",)


def test_a_pair_given_both_ways_is_one_pair() -> None:
    result = antonym_pairs(["Rough"], table([("Rough", "Smooth"), ("Smooth", "Rough")]), OFFERED)
    assert result.pairs == (("Rough", "Smooth", True, False),)


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ([*GOOD, ("Rough", "Smooth")], "line 6: 'Rough' and 'Smooth' stand already in line 2"),
        ([("Rough", "rough")], "line 2: 'Rough' is its own antonym"),
        ([("Rough", "Smoth")], "line 2: 'Smoth' was not offered; did you mean 'Smooth'?"),
        ([*GOOD, ("Bumpy", "Smooth")], "line 6: 'Bumpy' is the antonym of 'Flat' in line 3 and of 'Smooth' here"),
        (
            [("Rough", "Smooth"), ("Smooth", "Flat"), ("Flat", "Rough")],  # round in a circle
            "line 3: 'Smooth' is the antonym of 'Rough' in line 2 and of 'Flat' here",
        ),
        ([("Rough", None)], "line 2: a word and its antonym are expected, found 'Rough' and ''"),
    ],
)
def test_mistakes_in_the_table_are_refused_with_their_line(pairs: list[tuple[object, object]], message: str) -> None:
    assert message in refused(pairs)


def test_all_mistakes_are_reported_together() -> None:
    assert refused([("Rough", "Rough"), ("Hard", "Sof"), ("", "Thin")]).count("\nline") == 3


def test_a_table_without_its_columns_is_refused() -> None:
    with pytest.raises(UnknownColumn, match="needs one column 'antonym'"):
        antonym_pairs([], pd.DataFrame({"word": ["Rough"], "opposite": ["Smooth"]}))


def test_an_antonym_that_was_not_offered_is_accepted_where_the_offer_is_unknown() -> None:
    result = antonym_pairs(["Hard to pull"], table([("Easy-to-pull", "Hard to pull")]))
    assert result.pairs == (("Easy-to-pull", "Hard to pull", False, True),)
