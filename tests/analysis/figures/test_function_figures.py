"""Figures of psychometric functions and of tracks, from the answer of their test."""

from __future__ import annotations

from functools import cache

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.figures.track import _reversals
from palpate.analysis.plans.answers import Answer
from palpate.analysis.plans.kinds import FIGURES
from palpate.analysis.ratings.dataset import DataRefused
from tests.analysis.choices.collected_for_tests import tracks
from tests.analysis.choices.test_collected import answer as of_plan
from tests.analysis.figures.specimens import answer, data_of, draw_svg, inputs_of


@cache
def functions() -> Answer:
    return of_plan("psychometric", tracks(), function="weibull_db", lapse=(0, 0.05))


def test_every_function_has_a_panel_with_shares_a_curve_and_a_threshold_or_an_inequality() -> None:
    data = data_of(FIGURES["psychometric"], inputs_of(answers={"f": functions()}), tests=("f",))
    table = pd.DataFrame(list(data.rows))
    assert table["panel"].nunique() == 6
    assert set(table["shows"]) == {"level", "curve", "threshold"}
    guesser = table[(table["panel"] == "P002, f250") & (table["shows"] == "threshold")].iloc[0]
    assert np.isnan(guesser["level"])
    assert guesser["note"].startswith("threshold above")
    curve = table[table["shows"] == "curve"]
    assert ((curve["low"] <= curve["share"] + 1e-9) & (curve["share"] <= curve["high"] + 1e-9)).mean() > 0.95
    svg, drawn = draw_svg(FIGURES["psychometric"], data)
    assert len(drawn.marks) == int((table["shows"] == "level").sum()) + 5
    assert drawn.figure.get_size_inches().tolist() == pytest.approx([3 * 2.75 + 0.4, 2 * 2.25 + 0.35])
    assert svg


def test_a_track_shows_each_trial_and_the_reversals_of_staircases() -> None:
    data = data_of(FIGURES["track"], inputs_of(answers={"f": functions()}), tests=("f",), columns=2)
    table = pd.DataFrame(list(data.rows))
    trials = table[table["shows"] == "trial"]
    assert sorted(set(trials["panel"])) == ["P001, f160", "P001, f250", "P002, f160", "P002, f250"]
    assert (trials.groupby("panel")["n"].max() == 64).all()
    assert trials[trials["reversal"].notna()]["panel"].str.contains("f160").all()
    notes = table[table["shows"] == "threshold"].set_index("panel")["note"]
    assert notes["P002, f250"].startswith("threshold above")
    assert (notes == "").sum() == 3
    drawn = draw_svg(FIGURES["track"], data)[1]
    assert len(drawn.marks) == 4 * 64
    words = [text.get_text() for axes in drawn.figure.axes for text in axes.texts]
    assert words == [notes["P002, f250"]]


def test_a_posterior_has_a_density_and_an_estimate_or_an_inequality_for_each_function() -> None:
    data = data_of(FIGURES["posterior"], inputs_of(answers={"f": functions()}), tests=("f",))
    table = pd.DataFrame(list(data.rows))
    assert table["panel"].nunique() == 6
    for _, own in table[table["shows"] == "density"].groupby("panel"):
        for name in ("density", "prior_density"):
            assert np.trapezoid(own[name], own["level"]) == pytest.approx(1, abs=0.02)
    thresholds = table[table["shows"] == "threshold"].set_index("panel")
    assert thresholds.loc["P002, f250", "note"].startswith("threshold above")
    assert (thresholds["note"] == "").sum() == 5
    drawn = draw_svg(FIGURES["posterior"], data)[1]
    assert len(drawn.marks) == 5
    low, high = drawn.figure.axes[0].get_xlim()
    assert low > -40 and high < 10


def test_reversals_are_the_last_trials_at_a_level_where_moves_turn() -> None:
    """Levitt 1971: down to 1, up to 3, down again."""
    assert _reversals([3, 2, 1, 1, 2, 3, 2]) == {3: "valley", 5: "peak"}


def test_other_tests_have_no_function() -> None:
    with pytest.raises(DataRefused, match="must name a test of kind psychometric"):
        data_of(FIGURES["track"], inputs_of(answers={"f": answer([{"a": 1}])}), tests=("f",))
