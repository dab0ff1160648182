"""Intervals, slopes, jackknife and order effects against R 4.2.2 (tests/analysis/data/r/describing.R)."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.ratings.categories import category_cells, category_differences, overall
from palpate.analysis.ratings.disagreement import disagreement
from palpate.analysis.ratings.normalisation import normalised
from palpate.analysis.ratings.order_effects import order_effect
from palpate.analysis.ratings.trends import trends
from palpate.analysis.ratings.within_intervals import mean_intervals

FOLDER = Path(__file__).parents[1] / "data" / "r"
R = json.loads((FOLDER / "describing.json").read_text())


def reference_table(name: str) -> pd.DataFrame:
    from palpate.analysis import reference

    return pd.read_csv(Path(next(iter(reference.__path__))) / "csv" / f"{name}.csv", dtype={"subject": str})


def close(value: float, expected: float) -> None:
    assert value == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", list(R["intervals"]))
def test_every_interval_is_that_of_the_papers_formula_in_r(name: str) -> None:
    expected = R["intervals"][name]
    by = [expected["by"]] if isinstance(expected["by"], str) else expected["by"]
    between = expected["between"]
    options = {"by": [*between, *by], "between": between, "subject": "subject"}
    data = reference_table(name)
    intervals = {method: mean_intervals(data, "y", method=method, **options)
             for method in ("cousineau_morey", "loftus_masson", "between")}  # fmt: skip
    for place, row in intervals["cousineau_morey"].iterrows():
        group = row[between[0]] if between else "all"
        cell = "|".join(row[name] for name in by)
        r = expected["cells"][group][cell]
        assert row["n"] == r["n"]
        for column in ("mean", "sd", "sd_interval", "half"):
            close(row[column], r[column])
        close(row["ci_high"] - row["ci_low"], 2 * r["half"])
        close(intervals["loftus_masson"]["half"][place], expected["loftus_masson"][group])
        close(intervals["between"]["half"][place], expected["student"][group][cell])


def sleep() -> pd.DataFrame:
    data = reference_table("sleepstudy")
    families = ["reference", *(name for name in ("early", "middle", "late") for _ in range(3))]
    return data.assign(family=[families[day] for day in data["days"]])


def demand_test(row: pd.Series, expected: dict[str, float]) -> None:
    for column in ("n", "mean", "sd", "ci_low", "ci_high", "t", "df", "p"):
        close(row[column], expected[column])


@pytest.mark.parametrize("numeric", [None, "days"])
def test_slopes_and_differences_from_the_reference_are_lm_and_t_test(numeric: str | None) -> None:
    result = trends(sleep(), "y", level="day", family="family", subject="subject", numeric=numeric)
    assert result.reference == "d0"
    assert result.slopes["family"].tolist() == ["early", "middle", "late"]
    for _, row in result.slopes.iterrows():
        demand_test(row, R["trends"]["slopes"][row["family"]])
        close(row["p_corrected"], R["trends"]["slopes_holm"][row["family"]])
    for _, row in result.levels.iterrows():
        demand_test(row, R["trends"]["against"][row["level"]])
        close(row["p_corrected"], R["trends"]["against_holm"][row["level"]])
    assert set(result.slopes["family_size"]) == {3}
    assert set(result.levels["family_size"]) == {9}


def test_a_family_fixed_beforehand_has_the_declared_size() -> None:
    options = {"level": "day", "family": "family", "subject": "subject", "correction": "bonferroni", "size": 5}
    result = trends(sleep(), "y", **options)
    for _, row in result.slopes.iterrows():
        close(row["p_corrected"], R["trends"]["slopes_bonferroni"][row["family"]])
        assert row["family_size"] == 5


def hours() -> tuple[pd.DataFrame, dict[str, str]]:
    data = reference_table("obk_long").rename(
        columns={"subject": "participant", "phase": "attribute", "hour": "stimulus", "y": "value"}
    )
    return data, {"pre": "physical", "post": "physical", "fup": "emotional"}


def test_spread_between_participants_and_its_jackknife_are_r_s() -> None:
    data, categories = hours()
    result, expected = disagreement(data, categories, ("physical", "emotional")), R["categories"]
    assert (result.n, result.cells, result.note) == (16, (10, 5), "")
    for name, value in (("first", "sd_physical"), ("second", "sd_emotional"), ("ratio", "ratio"), ("low", "low"),
                        ("high", "high"), ("t", "t"), ("p", "p")):  # fmt: skip
        close(getattr(result, name), expected[value])


def test_the_difference_of_category_means_is_a_paired_t_test() -> None:
    data, categories = hours()
    cells = overall(category_cells(data, categories, ("stimulus",)))
    ((_, difference),) = category_differences(cells, ("physical", "emotional"))
    expected = R["categories"]["difference"]
    for name, value in (("mean", "mean"), ("low", "ci_low"), ("high", "ci_high"), ("t", "t"), ("p", "p")):
        close(getattr(difference, name), expected[value])


def test_drift_bins_and_carry_over_rest_on_r_s_fit_of_participants_stimuli_and_position() -> None:
    data = pd.read_csv(FOLDER / "describing_order.csv")
    effect = order_effect(data, bins=4, carry_over=True)
    for sample, name in ((effect.slope, "drift"), (effect.carry_over, "carried")):
        expected = R["order"][name]
        for ours, theirs in (("mean", "mean"), ("low", "ci_low"), ("high", "ci_high"), ("p", "p")):
            assert getattr(sample, ours) == pytest.approx(expected[theirs], rel=1e-9)
    assert [(block.first, block.last) for block in effect.bins] == [(1, 2), (3, 4), (5, 6), (7, 8)]
    for number, block in enumerate(effect.bins):
        expected = R["order"]["bins"][str(number + 1)]
        assert block.mean == pytest.approx(expected["mean"], rel=1e-9)
        assert (block.high - block.low) / 2 == pytest.approx(expected["half"], rel=1e-9)


def test_z_within_a_participant_is_r_s_scale() -> None:
    data = reference_table("ergoStool").rename(columns={"subject": "participant", "y": "value"})
    z, scale = normalised(data, None, "z_within_participant")
    assert scale is None
    np.testing.assert_allclose(z["value"][z["participant"] == "1"], R["z_of_subject_1"], rtol=1e-13)
    assert math.isclose(z["value"].sum(), 0, abs_tol=1e-12)
