"""Pairs that a study presented, as scales: the numbers of the same answers as a table of one's own, and refusals."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError
from scipy.special import ndtri

from palpate.analysis.plans import kinds
from palpate.analysis.plans.answers import Answer, Selected
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.regenerating.plan_check import answers_of_study
from palpate.analysis.statistics.refusals import StatisticsError
from palpate.protocols.study import Study
from tests.protocols.tasks.test_pairs import study as study_of_pairs
from tests.studies.procedures.tracks_for_tests import study as study_of_tracks

VALUES = {"A": 0.0, "B": 0.4, "C": 0.9, "D": 1.3}
SAME_DIFFERENT = {"design": "same_different", "seconds": 2.0}


def of_pairs(ties: bool = False, **columns: Any) -> pd.DataFrame:
    """Rows of `choices` of three people who compared each two of four stimuli in both orders five times.

    The first interval has an advantage of 0.3 logits.
    """
    rng = np.random.default_rng(11)
    rows = []
    for n in range(3):
        for trial, (one, two) in enumerate(list(permutations(VALUES, 2)) * 5, start=1):
            first = rng.random() < 1 / (1 + np.exp(VALUES[two] - VALUES[one] - 0.3))
            chosen = "equal" if ties and rng.random() < 0.15 else "1" if first else "2"
            rows.append({"participant": f"P{n}", "group": "ab"[n % 2], "trial": trial, "stimulus": one, "other": two,
                         "chosen": chosen})  # fmt: skip
    known: dict[str, Any] = {
        "track": "main", "procedure": "pairs", "design": "forced_choice", "alternatives": 2, "target": None,
        "level": np.nan, "standard": np.nan, "correct": np.nan, "hit": np.nan, "catch": "none",
    }  # fmt: skip
    return pd.DataFrame(rows).assign(**{**known, **columns})


def own_table(choices: pd.DataFrame) -> pd.DataFrame:
    """The same answers as somebody would write them down, row by row."""
    rows = []
    for row in choices.to_dict("records"):
        pair = (row["stimulus"], row["other"])
        winner, loser = pair[::-1] if row["chosen"] == "2" else pair
        rows.append({"participant": row["participant"], "group": row["group"], "winner": winner, "loser": loser,
                     "tie": str(row["chosen"] == "equal"), "first": pair[0]})  # fmt: skip
    return pd.DataFrame(rows)


def answer(test: str, data: pd.DataFrame, /, **settings: Any) -> Answer:
    kind = kinds.TESTS[test]
    given = Selected(data, pd.DataFrame(), (), {}, seed=3, draws=99)
    return kind.answer(given, kind.settings.model_validate({"name": "x", "test": test, **settings}))


@pytest.mark.parametrize(
    ("test", "ties", "settings", "own"),
    [
        ("bradley_terry", False, {}, {}),
        ("bradley_terry", False, {"first": "stimulus", "reference": "B"}, {"first": "first", "reference": "B"}),
        ("bradley_terry", True, {"first": "stimulus"}, {"first": "first", "tie": "tie"}),
        ("thurstone", False, {}, {}),
        ("thurstone", False, {"method": "least_squares"}, {"method": "least_squares"}),
    ],
)
def test_choices_answer_as_the_same_comparisons_in_a_table_of_ones_own(
    test: str, ties: bool, settings: dict[str, Any], own: dict[str, Any]
) -> None:
    choices = of_pairs(ties)
    of_choices = answer(test, choices, source="choices", **settings)
    of_table = answer(test, own_table(choices), table="t", **own)
    assert of_choices == of_table
    assert (of_choices.participants, of_choices.values) == (3, len(choices))
    assert len(of_choices.more["triads"]) == 4


def test_the_interval_has_an_effect_of_its_own() -> None:
    (effect,) = answer("bradley_terry", of_pairs(), source="choices", first="stimulus").more["effects"]
    assert effect["effect"] == "position"
    assert float(effect["ci_low"] or 0) < 0.3 < float(effect["ci_high"] or 0)
    with pytest.raises(ValidationError, match="first: stimulus is expected"):
        answer("bradley_terry", of_pairs(), source="choices", first="other")


def test_standard_errors_are_over_participants_unless_the_plan_takes_choices_for_independent() -> None:
    people = answer("bradley_terry", of_pairs(), source="choices")
    each = answer("bradley_terry", of_pairs(), source="choices", independent="choices")
    assert people.kinds["se"] == "standard error, each of 3 people left out in turn"
    assert each.kinds["se"] == "standard error, inverse information"
    assert [row["value"] for row in people.rows] == [row["value"] for row in each.rows]
    assert "t" in people.more["differences"][0] and "z" in each.more["differences"][0]
    notes = [any("count as independent" in note for note in one.notes) for one in (people, each)]
    assert notes == [False, True]


def test_a_stimulus_beside_itself_says_nothing() -> None:
    choices = of_pairs()
    same = choices.iloc[:2].assign(other=choices["stimulus"])
    both = answer("bradley_terry", pd.concat([choices, same], ignore_index=True), source="choices")
    assert both.rows == answer("bradley_terry", choices, source="choices").rows
    assert any("2 pair(s) of a stimulus with itself left out" in note for note in both.notes)


@pytest.mark.parametrize("test", ["bradley_terry", "thurstone"])
@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"procedure": "questplus", "other": None}, "here a procedure chose levels"),
        ({"design": "oddity"}, "these are of design oddity"),
        ({"chosen": "3"}, "'chosen' has '3'; 1, 2 or equal is expected"),
    ],
)
def test_other_choices_have_no_scale(test: str, columns: dict[str, Any], message: str) -> None:
    with pytest.raises(DataRefused, match=message):
        answer(test, of_pairs(**columns), source="choices")
    with pytest.raises(DataRefused, match="here a procedure chose levels"):
        answer(test, of_pairs().drop(columns="other"), source="choices")


def test_thurstone_has_no_ties() -> None:
    with pytest.raises(DataRefused, match="has no ties, and .* pairs were equal; ask bradley_terry"):
        answer("thurstone", of_pairs(ties=True), source="choices")


@pytest.mark.parametrize(
    ("test", "message"),
    [
        ("psychometric", "pairs of stimuli have no levels"),
        ("binomial_mixed_model", "pairs of stimuli have no levels"),
        ("dprime", "no answer to a forced choice between two stimuli is correct"),
    ],
)
def test_tests_of_levels_refuse_pairs(test: str, message: str) -> None:
    with pytest.raises((DataRefused, StatisticsError), match=message):
        answer(test, of_pairs(), source="choices")


def test_same_different_pairs_have_a_sensitivity() -> None:
    """Independent observations: d' = 2 z((1 + root(2 p - 1)) / 2), p of an unbiased observer (Macmillan & Creelman
    2005, equation 9.7).
    """
    hits = [True] * 40 + [False] * 10 + [True] * 10 + [False] * 40
    table = of_pairs().head(100).assign(
        participant="P0", design="same_different", target=["different"] * 50 + ["same"] * 50,
        chosen=["different" if hit else "same" for hit in hits], hit=np.array(hits, dtype=float),
    )  # fmt: skip
    (row,) = answer("dprime", table, model="independent_observation", correction="none").rows
    share = 0.8
    assert row["dprime"] == pytest.approx(2 * ndtri((1 + np.sqrt(2 * share - 1)) / 2), abs=1e-6)


def problems(study: Study, test: str, **settings: Any) -> list[str]:
    known = {"name": "x", "test": test, "source": "choices", **settings}
    request = kinds.TESTS[test].settings.model_validate(known)
    return [f"{problem.path} {problem.message}" for problem in answers_of_study(study, ()).problems(request)]


def test_the_study_tells_which_tests_its_choices_answer() -> None:
    forced, levels = study_of_pairs(), study_of_tracks()
    different = study_of_pairs(pairs={"same": 1}, intervals=SAME_DIFFERENT)
    for test in ("bradley_terry", "thurstone"):
        assert problems(forced, test) == []
        assert "this study has a `procedure`, not `pairs`" in problems(levels, test)[0]
        assert "have the design same_different" in problems(different, test)[0]
    for test in ("psychometric", "binomial_mixed_model"):
        assert "pairs of stimuli have no levels" in problems(forced, test)[0]
    assert "no answer to a forced choice between two stimuli is correct" in problems(forced, "dprime")[0]
    assert problems(levels, "psychometric") == problems(levels, "dprime") == problems(different, "dprime") == []
