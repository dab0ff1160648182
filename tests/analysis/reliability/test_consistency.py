"""Cronbach's alpha against R's psych; reversed, constant and missing items."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.reliability.consistency import Alpha, cronbach_alpha
from palpate.analysis.statistics.references import reference_path, reference_values
from palpate.analysis.statistics.refusals import IncompleteCells, TooFew, UnknownColumn
from tests.analysis.reliability.tables import R, long, relative, wide


def alpha_of(values: np.ndarray, **options: object) -> Alpha:
    return cronbach_alpha(long(values), "y", "rater", "target", **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", R["sets"])
def test_every_number_is_that_of_psych(name: str) -> None:
    theirs, result = R["sets"][name]["alpha"], alpha_of(wide(name))
    pairs = [
        *((result.alpha, theirs["raw_alpha"]), (result.standardised, theirs["std_alpha"])),
        *((result.average_r, theirs["average_r"]), (result.ci_low, theirs["feldt_low"])),
        (result.ci_high, theirs["feldt_high"]),
    ]
    for column in ("alpha_if_dropped", "item_total", "item_rest", "mean", "sd"):
        order = result.items.sort_values("item", key=lambda names: names.astype(int))
        pairs += zip(order[column], theirs[column], strict=True)
    assert max(relative(ours, r) for ours, r in pairs) < 1e-12


def test_the_reference_of_attitude_and_its_interval() -> None:
    expected = reference_values("r_reference")["attitude_alpha"]
    table = pd.read_csv(reference_path("csv/attitude_wide.csv")).reset_index(names="case")
    result = cronbach_alpha(table.melt("case", var_name="item", value_name="y"), "y", "item", "case")
    assert relative(result.alpha, expected["raw_alpha"]) < 1e-14
    assert relative(result.ci_low, expected["feldt_low"]) < 1e-14
    assert relative(result.ci_high, expected["feldt_high"]) < 1e-14


@pytest.mark.parametrize(
    "entry", [e for e in reference_values("r_reference").values() if "cronbach" in e and e["csv"] == "md_15.1.csv"]
)
def test_alpha_is_the_consistency_icc_of_means(entry: dict[str, dict[str, float]]) -> None:
    rows = {row["type"]: row["ICC"] for row in entry["icc"]["rows"]}  # type: ignore[index, call-overload]
    assert relative(entry["cronbach"]["raw_alpha"], rows["ICC3k"]) < 1e-14


def test_an_offset_of_1e9_changes_no_digit_of_it() -> None:
    x = wide("tied")
    plain, far = alpha_of(x), alpha_of(x + 1e9 * np.arange(7))
    assert (plain.alpha, plain.standardised) == (far.alpha, far.standardised)
    assert plain.items["item_rest"].tolist() == far.items["item_rest"].tolist()


def test_a_reversed_item_is_noticed_and_can_be_turned() -> None:
    x = wide("USJudgeRatings")[:, 1:6].copy()
    straight = alpha_of(x)
    x[:, 2] = 10 - x[:, 2]
    result, turned = alpha_of(x), alpha_of(x, reverse=("2",))
    assert "runs against the other items" in result.items.loc[2, "note"]
    assert result.alpha < 0.5
    assert turned.alpha == pytest.approx(straight.alpha, rel=1e-13)
    with pytest.raises(UnknownColumn, match="reverse names 'x'"):
        alpha_of(x, reverse=("x",))


def test_a_constant_item_has_no_correlations_and_the_rest_is_right() -> None:
    x = np.column_stack((wide("attitude")[:, :3], np.full(30, 0.1)))
    result = alpha_of(x)
    assert np.isfinite(result.alpha)
    assert np.isnan(result.standardised)
    assert "3 does not vary" in result.note
    assert np.isnan(result.items.loc[3, "item_rest"])
    assert result.items.loc[3, "alpha_if_dropped"] == alpha_of(x[:, :3]).alpha


def test_where_nothing_varies_or_all_agree_the_note_says_so() -> None:
    assert "do not vary" in alpha_of(np.full((5, 3), 0.3)).note
    same = alpha_of(np.arange(5.0)[:, None] * np.ones((1, 3)))
    assert same.alpha == 1
    assert np.isnan(same.ci_low)
    assert "agree exactly" in same.note
    two = alpha_of(wide("attitude")[:, :2])
    assert two.items["alpha_if_dropped"].isna().all()
    assert "one item would be left" in two.items.loc[0, "note"]


def test_cases_of_several_columns_and_gaps() -> None:
    table = long(wide("attitude")).assign(day=lambda t: t["target"].astype(int) % 2, who=lambda t: t["target"])
    result = cronbach_alpha(table, "y", "rater", ["who", "day"])
    assert result.alpha == alpha_of(wide("attitude")).alpha
    with pytest.raises(IncompleteCells, match="who and day=\\('7', 1\\), rater='3'"):
        gap = table[~((table["target"] == "7") & (table["rater"] == "3"))]
        cronbach_alpha(gap, "y", "rater", ["who", "day"])
    assert cronbach_alpha(gap, "y", "rater", "target", missing="drop_cases").dropped == ("7",)
    with pytest.raises(TooFew, match="too few items"):
        cronbach_alpha(table[table["rater"] == "0"], "y", "rater", "target")
