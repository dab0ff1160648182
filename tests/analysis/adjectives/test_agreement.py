"""Agreement on words against the general coefficients, slow loops and statsmodels."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.adjectives.agreement import ALL, word_agreement
from palpate.analysis.adjectives.selections import gather_selections
from palpate.analysis.reliability.krippendorff import krippendorff
from palpate.analysis.statistics.refusals import TooFew
from tests.analysis.adjectives.tables import WORDS, random_ticks, study, tables

TICKS = random_ticks(6, 8, seed=4)
RESULT = word_agreement(study(TICKS), draws=300, seed=1)


def ticked(word: str) -> np.ndarray:
    """Ticked or not, as an array (stimuli, participants)."""
    return np.array([[float(word in TICKS[f"P{p}", f"T{s}"].split()) for p in range(6)] for s in range(8)])


def test_alpha_of_each_word_and_of_all_is_krippendorffs_nominal_alpha() -> None:
    rows = RESULT.words.set_index("word")
    for word in WORDS[:-1]:
        assert rows.loc[word, "alpha"] == pytest.approx(krippendorff(ticked(word), "nominal").alpha, rel=1e-12)
    units = np.concatenate([ticked(word) for word in WORDS])
    assert rows.loc[ALL, "alpha"] == pytest.approx(krippendorff(units, "nominal").alpha, rel=1e-12)
    assert np.isnan(rows.loc["Vague", "alpha"])
    assert "nobody anywhere" in rows.loc["Vague", "note"]
    defined = rows.drop("Vague")
    assert (defined["ci_low"] < defined["alpha"]).all()
    assert (defined["alpha"] < defined["ci_high"]).all()


def test_kappa_is_that_of_statsmodels() -> None:
    from statsmodels.stats import inter_rater as rater

    for word in WORDS[:-1]:
        yes = ticked(word).sum(axis=1)
        expected = rater.fleiss_kappa(np.column_stack((yes, 6 - yes)))
        assert RESULT.words.set_index("word").loc[word, "kappa"] == pytest.approx(expected, rel=1e-12)


def test_overlap_is_the_mean_of_jaccard_over_pairs() -> None:
    means = []
    for s in range(8):
        sets = [set(TICKS[f"P{p}", f"T{s}"].split()) for p in range(6)]
        overlaps = [len(a & b) / len(a | b) for a, b in combinations(sets, 2) if a | b]
        means.append(np.mean(overlaps))
        row = RESULT.stimuli.set_index("stimulus").loc[f"T{s}"]
        assert row["jaccard"] == pytest.approx(means[-1], rel=1e-12)
        assert ("ticked nothing" in row["note"]) == (len(overlaps) < 15)
    assert RESULT.jaccard == pytest.approx(np.mean(means), rel=1e-12)
    assert RESULT.jaccard_low < RESULT.jaccard < RESULT.jaccard_high


def test_full_agreement_is_one() -> None:
    same = {(f"P{p}", f"T{s}"): WORDS[s] for p in range(4) for s in range(3)}
    result = word_agreement(study(same), draws=100)
    assert result.jaccard == result.jaccard_low == 1
    assert result.words.set_index("word").loc[["Rough", "Smooth", "Hard", ALL], "alpha"].tolist() == [1, 1, 1, 1]


def test_stimuli_that_not_all_participants_felt_have_alpha_and_no_kappa() -> None:
    fewer = {key: words for key, words in TICKS.items() if key != ("P0", "T0")}
    rows = word_agreement(study(fewer), draws=0).words.set_index("word")
    x = ticked("Rough")
    x[0, 0] = np.nan
    assert rows.loc["Rough", "alpha"] == pytest.approx(krippendorff(x, "nominal").alpha, rel=1e-12)
    assert np.isnan(rows.loc["Rough", "kappa"])
    assert "differ in participants" in rows.loc["Rough", "note"]


def test_one_participant_has_nobody_to_agree_with() -> None:
    with pytest.raises(TooFew, match="two participants"):
        word_agreement(study({("P1", "T1"): "Rough", ("P1", "T2"): "Hard"}))


def test_nobody_ticks_anything() -> None:
    result = word_agreement(study({(f"P{p}", "T"): "" for p in range(3)}), draws=100)
    assert np.isnan(result.jaccard)
    assert "no two participants ticked a word" in result.note


def test_the_order_of_rows_changes_nothing() -> None:
    words, trials = tables(TICKS)
    mixed = gather_selections(words.sample(frac=1, random_state=1), trials.sample(frac=1, random_state=2), WORDS)
    again = word_agreement(mixed, draws=300, seed=1)
    pd.testing.assert_frame_equal(RESULT.words, again.words, check_exact=True)
    pd.testing.assert_frame_equal(RESULT.stimuli, again.stimuli, check_exact=True)
