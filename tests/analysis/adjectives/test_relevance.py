"""Relevance by each normalisation, by hand and by slow loops; what is drawn; what is refused."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import bootstrap

from palpate.analysis.adjectives.relevance import relevance
from palpate.analysis.adjectives.selections import gather_selections
from palpate.analysis.statistics.draws import generator
from palpate.analysis.statistics.refusals import BadOption, BadValue, TooFew
from tests.analysis.adjectives.tables import WORDS, random_ticks, study, tables

SMALL = {
    ("P1", "T1"): "Rough Hard",
    ("P1", "T2"): "Smooth",
    ("P2", "T1"): "Rough",
    ("P2", "T2"): "Smooth Soft",
    ("P3", "T1"): "Rough Hard",
    ("P3", "T2"): "",
}


def scores(normalisation: str, threshold: float = 0.5, **options: object) -> pd.DataFrame:
    result = relevance(study(SMALL), normalisation, threshold, draws=200, **options)  # type: ignore[arg-type]
    return result.set_index("word")


@pytest.mark.parametrize(
    ("normalisation", "expected"),
    [
        ("share_of_trials", {"Rough": 3 / 6, "Hard": 2 / 6, "Smooth": 2 / 6, "Soft": 1 / 6, "Vague": 0}),
        ("share_of_maximum", {"Rough": 1, "Hard": 2 / 3, "Smooth": 2 / 3, "Soft": 1 / 3, "Vague": 0}),
        ("any_stimulus", {"Rough": 1, "Hard": 2 / 3, "Smooth": 2 / 3, "Soft": 1 / 3, "Vague": 0}),
    ],
)
def test_each_normalisation_by_hand(normalisation: str, expected: dict[str, float]) -> None:
    result = scores(normalisation)
    assert result["relevance"].to_dict() == expected
    assert result.index.tolist() == ["Rough", "Smooth", "Hard", "Soft", "Vague"]  # ties stand as offered
    assert (result["kept"] == (result["relevance"] >= 0.5)).all()
    assert result["ticks"].tolist() == [3, 2, 2, 1, 0]
    assert result["participants"].tolist() == [3, 2, 2, 1, 0]
    assert result["stimuli"].tolist() == [1, 1, 1, 1, 0]


def test_a_share_of_exactly_the_threshold_is_kept() -> None:
    ticks = {(f"P{p}", "T"): "Rough" if p < 1 else "" for p in range(5)}
    assert relevance(study(ticks), "share_of_trials", 0.2, draws=0)["kept"].tolist()[0]  # 1 of 5 is 0.2
    thirds = {(f"P{p}", "T"): "Rough" if p < 3 else "" for p in range(10)}
    assert relevance(study(thirds), "any_stimulus", 0.3, draws=0)["kept"].tolist()[0]


def test_a_word_never_ticked_counts_with_zero_and_says_so() -> None:
    vague = scores("share_of_trials").loc["Vague"]
    assert (vague["relevance"], vague["ci_low"], vague["ci_high"], vague["kept_chance"]) == (0, 0, 0, 0)
    assert vague["note"] == "never ticked: every draw gives 0"


@pytest.mark.parametrize("normalisation", ["share_of_trials", "share_of_maximum", "any_stimulus"])
def test_a_draw_is_a_study_with_these_participants(normalisation: str) -> None:
    """Percentile limits and the chance of being kept, from a slow loop over the same draws."""
    ticks, people, draws = random_ticks(7, 4), 7, 100
    result = relevance(study(ticks), normalisation, 0.5, draws=draws, seed=3).set_index("word")  # type: ignore[arg-type]
    rng, slow = generator(3, "relevance"), []
    for counts in rng.multinomial(people, [1 / people] * people, size=draws):
        drawn = {
            (f"{who}x{copy}", what): words
            for (who, what), words in ticks.items()
            for copy in range(counts[int(who[1:])])
        }
        table = relevance(study(drawn), normalisation, 0.5, draws=0)  # type: ignore[arg-type]
        slow.append(table.set_index("word")["relevance"].loc[list(WORDS)])
    for word, column in zip(WORDS, np.array(slow).T, strict=True):
        assert result.loc[word, ["ci_low", "ci_high"]].tolist() == pytest.approx(np.quantile(column, [0.025, 0.975]))
        assert result.loc[word, "kept_chance"] == pytest.approx((column >= 0.5).mean())


def test_bca_limits_are_those_of_scipy() -> None:
    """SciPy draws its own samples: close, not equal. The skew makes BCa differ from percentile by more than that."""
    rng = np.random.default_rng(0)
    chance = rng.beta(0.3, 1.2, 30)
    ticks = {(f"P{p}", f"T{s}"): "Rough" if rng.random() < chance[p] else "" for p in range(30) for s in range(20)}
    ours = {
        kind: relevance(study(ticks), "share_of_trials", 0.5, draws=20_000, interval=kind)
        .set_index("word")
        .loc["Rough"]  # type: ignore[arg-type]
        for kind in ("bca", "percentile")
    }
    shares = study(ticks).ticked[:, :, 0].mean(axis=1)
    theirs = bootstrap((shares,), np.mean, n_resamples=20_000, method="BCa", random_state=1).confidence_interval
    assert ours["bca"]["ci_low"] == pytest.approx(theirs.low, abs=0.004)
    assert ours["bca"]["ci_high"] == pytest.approx(theirs.high, abs=0.004)
    assert abs(ours["percentile"]["ci_high"] - theirs.high) > 0.008


def test_rows_and_repeated_rows_change_nothing_and_the_seed_alone_decides() -> None:
    words, trials = tables(random_ticks(8, 5))
    plain = relevance(gather_selections(words, trials, WORDS), "share_of_trials", 0.5, seed=1)
    doubled = gather_selections(
        pd.concat([words, words.iloc[:7]]).sample(frac=1, random_state=2),
        pd.concat([trials, trials.iloc[:3]]).sample(frac=1, random_state=3),
        WORDS,
    )
    again = relevance(doubled, "share_of_trials", 0.5, seed=1)
    pd.testing.assert_frame_equal(plain, again, check_exact=True)
    other = relevance(doubled, "share_of_trials", 0.5, seed=2)
    assert other["relevance"].tolist() == plain["relevance"].tolist()
    assert other["kept_chance"].tolist() != plain["kept_chance"].tolist()


def test_meeting_a_stimulus_again_counts_each_trial_once() -> None:
    words, trials = tables(SMALL)
    again = pd.concat([trials, trials.assign(trial=trials["trial"] + 10)])
    result = relevance(gather_selections(words, again, WORDS), "share_of_trials", 0.5, draws=0).set_index("word")
    assert result.loc["Rough", "relevance"] == 3 / 12
    anywhere = relevance(gather_selections(words, again, WORDS), "any_stimulus", 0.5, draws=0).set_index("word")
    assert anywhere.loc["Rough", "relevance"] == 1


def test_one_participant_has_relevance_and_no_interval() -> None:
    result = relevance(study({("P1", "T1"): "Rough"}), "share_of_trials", 0.5)
    assert result.loc[0, "relevance"] == 1
    assert np.isnan(result.loc[0, "ci_low"])
    assert "two participants" in result.loc[0, "note"]


def test_mistakes_are_refused_by_name() -> None:
    words, trials = tables(SMALL)
    with pytest.raises(BadValue, match="'Ruogh' .did you mean 'Rough'"):
        gather_selections(words.replace("Rough", "Ruogh"), trials, WORDS)
    with pytest.raises(BadValue, match="not among the trials"):
        gather_selections(words, trials[trials["participant"] != "P1"], WORDS)
    with pytest.raises(BadValue, match="two stimuli, 'T1' and 'T2'"):
        gather_selections(words, trials.assign(trial=1), WORDS)
    with pytest.raises(BadOption, match="offered twice: 'Rough'"):
        gather_selections(words, trials, (*WORDS, "Rough"))
    with pytest.raises(BadOption, match="normalisation='normalized'"):
        scores("normalized")
    with pytest.raises(BadOption, match="threshold=50"):
        scores("share_of_trials", 50)
    with pytest.raises(TooFew, match="no word was ticked"):
        relevance(study({("P1", "T1"): "", ("P2", "T1"): ""}), "share_of_maximum", 0.5)


def test_without_the_offered_words_those_ticked_are_all_there_are() -> None:
    words, trials = tables(SMALL)
    assert gather_selections(words, trials).words == ["Hard", "Rough", "Smooth", "Soft"]
