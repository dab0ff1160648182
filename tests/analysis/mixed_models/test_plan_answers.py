"""The plan's mixed models: settings, answers and the answer of a question about variance with gaps."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.plans.answers import Selected
from palpate.analysis.plans.families.mixed_model_answers import gaps_answer
from palpate.analysis.plans.kinds import TESTS
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.anova import rm_anova

LEVELS = {"car": ("K8", "BC3", "G90"), "variant": ("soft", "hard"), "group": ("1", "2")}


def selected(missing=(), repeats=1, n=12):
    rng = np.random.default_rng(12)
    p, c, v, _ = np.indices((n, 3, 2, repeats)).reshape(4, -1)
    # Large enough participant x factor variances that no estimate of them is negative.
    value = 50 + rng.normal(0, 8, n)[p] + rng.normal(0, 4, (n, 3))[p, c] + rng.normal(0, 4, (n, 2))[p, v]
    table = pd.DataFrame(
        {
            "participant": [f"P{i + 1:03d}" for i in p],
            "group": np.where(p < n // 2, "1", "2"),
            "stimulus": [f"S{i}{j}" for i, j in zip(c, v, strict=True)],
            "car": np.array(LEVELS["car"])[c],
            "variant": np.array(LEVELS["variant"])[v],
            "damping": [f"{1 + 2 * i + j}" for i, j in zip(c, v, strict=True)],
            "attribute": "Damped",
            "value": value + 2 * c + rng.normal(0, 2, len(p)),
        }
    )
    rows = table.drop(index=list(missing))
    return Selected(rows, rows[["participant", "stimulus"]], ("Damped",), LEVELS)


MIXED_MODEL = TESTS["mixed_model"]


def request(**settings):
    return MIXED_MODEL.settings(**{"name": "m", "test": "mixed_model", **settings})


def test_coefficients_against_the_studys_first_level_with_tables_beside():
    answer = MIXED_MODEL.answer(
        selected([3, 17]),
        request(fixed=["car"], numeric=["damping"], random={"participant": ["damping"], "stimulus": []}, levels=True),
    )
    effects = [row["effect"] for row in answer.rows]
    assert effects == ["(Intercept)", "car[BC3]", "car[G90]", "damping"]
    assert (answer.participants, answer.values) == (12, 70)
    assert [row["Source"] for row in answer.more["effects"]] == ["car", "damping"]
    assert [row["group"] for row in answer.more["variances"]] == ["participant", "participant", "stimulus", "Residual"]
    assert len(answer.more["random_effects"]) == 12 * 2 + 6
    assert answer.headline.startswith("car: F(2, ")
    plain = (float, int, str, bool, type(None))
    assert all(type(v) in plain for rows in (answer.rows, *answer.more.values()) for row in rows for v in row.values())
    numbers = {key for row in answer.rows for key, value in row.items() if isinstance(value, float)}
    assert numbers <= set(answer.kinds)


def test_gaps_on_complete_data_are_the_anova():
    """Two factors within participants: the error terms of the analysis of variance, F and df alike."""
    whole = selected(repeats=2)
    answer = gaps_answer(whole, ("car", "variant"), ())
    anova = rm_anova(whole.table, "value", ["car", "variant"], "participant", aggregate="mean").set_index("Source")
    for row in answer.rows:
        expected = anova.loc[row["Source"]]
        assert row["F"] == pytest.approx(expected["F"], rel=1e-6)
        assert (row["ddof1"], row["ddof2"]) == pytest.approx((expected["ddof1"], expected["ddof2"]), rel=1e-5)
    assert "Each participant's ratings in a cell (at most 2) were averaged first." in answer.notes


def test_gaps_keep_every_participant():
    answer = gaps_answer(selected([0, 8, 40]), ("car", "variant"), ("group",))
    assert [row["Source"] for row in answer.rows][:3] == ["car", "variant", "group"]
    assert len(answer.rows) == 7
    assert (answer.participants, answer.values) == (12, 69)
    assert all(0 < row["p_unc"] <= 1 for row in answer.rows)


def test_means_over_what_is_left_of_several_stimuli_are_refused():
    """A car's mean over two variants, one of them missing, would be compared with other cars' means over both."""
    with pytest.raises(DataRefused, match="in a cell of car x group rests on up to 2 stimuli, and some are missing"):
        gaps_answer(selected([0, 8, 40]), ("car",), ("group",))


def test_rows_without_a_value_are_counted():
    whole = selected()
    table = whole.table.assign(value=whole.table["value"].where(whole.table.index != 5))
    answer = MIXED_MODEL.answer(Selected(table, table, ("Damped",), LEVELS), request(fixed=["car"]))
    assert answer.notes[0] == "Left out: 1 row without a value."
    assert answer.values == 71


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"fixed": ["cra"]}, "did you mean 'car'?"),
        ({"random": {"participants": []}}, "did you mean 'participant'?"),
        ({"numeric": ["car"]}, "holds 'K8', no number"),
    ],
)
def test_a_wrong_column_is_refused_by_name(settings, words):
    with pytest.raises(DataRefused) as caught:
        MIXED_MODEL.answer(selected(), request(**settings))
    assert words in str(caught.value)


def test_a_model_without_random_effects_is_refused():
    with pytest.raises(ValueError, match="grouping factor"):
        request(fixed=["car"], random={})
