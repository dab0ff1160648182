"""Predicted against actual values, their errors by class, and the distributions of the errors."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.figures.class_heatmap import CLASS_HEATMAP
from palpate.analysis.figures.predicted import PREDICTED, grid_columns
from palpate.analysis.figures.violins import VIOLINS
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.refusals import BadValue
from tests.analysis.figures.specimens import data_of, draw_svg, inputs_of


def table() -> pd.DataFrame:
    """Errors 1, -3, 5, 0 for car A and 2, 2, -2, 4 for car B; the SD of the ratings is 4."""
    errors = [1, -3, 5, 0, 2, 2, -2, 4]
    actual = np.array([10.0, 20, 30, 40, 50, 60, 70, 80])
    return pd.DataFrame(
        {
            "stimulus": [f"s{i}" for i in range(8)],
            "attribute": ["x", "x", "y", "y"] * 2,
            "car": ["A"] * 4 + ["B"] * 4,
            "actual": actual,
            "predicted": actual + errors,
            "sd": 4.0,
        }
    )


def test_points_lie_within_half_and_one_sd_as_counted_by_hand() -> None:
    data = data_of(PREDICTED, inputs_of(table()), panels="car")
    assert [row["within_half_sd"] for row in data.rows] == [True, False, False, True, True, True, True, False]
    assert [row["within_one_sd"] for row in data.rows] == [True, True, False, True, True, True, True, True]
    text, drawn = draw_svg(PREDICTED, data)
    written = [t.get_text() for axes in drawn.figure.axes for t in axes.texts]
    assert written[0] == "± 0.5 SD: 50 %\n± 1 SD: 75 %"
    assert written[1] == "n = 4\nMAE 2.25\nRMSE 2.96"  # (1 + 3 + 5 + 0) / 4, sqrt(35 / 4)
    assert all(f'id="{mark.gid}"' in text for mark in drawn.marks)
    assert len(drawn.marks) == 8


def test_a_band_edge_counts_as_within_in_any_unit() -> None:
    inside = {"actual": [0.0], "predicted": [0.3], "stimulus": ["s"]}
    assert data_of(PREDICTED, inputs_of(pd.DataFrame(inside)), sd=0.6).rows[0]["within_half_sd"] is True
    for unit in (1.0, 0.1, 1e-9, 3e7):
        rows = data_of(
            PREDICTED, inputs_of(table().assign(**{n: table()[n] * unit for n in ("actual", "predicted", "sd")}))
        )
        assert [row["stimulus"] for row in rows.rows if not row["within_one_sd"]] == ["s2"]


def test_sds_of_rows_are_pooled_by_their_mean_square_and_the_caption_says_so() -> None:
    mixed = table().assign(sd=[3.0, 3.0, 5.0, 5.0] * 2)
    data = data_of(PREDICTED, inputs_of(mixed))
    assert data.rows[0]["sd"] == pytest.approx(math.sqrt(17.0), rel=1e-15)
    assert "root mean square of the column 'sd', all rows" in data.caption
    by_panel = data_of(PREDICTED, inputs_of(mixed), panels="attribute", band="panel")
    assert {row["panel"]: row["sd"] for row in by_panel.rows} == {"x": 3.0, "y": 5.0}


def test_without_an_sd_that_of_the_actual_values_stands_in_and_says_so() -> None:
    data = data_of(PREDICTED, inputs_of(table().drop(columns="sd")))
    assert data.rows[0]["sd"] == pytest.approx(np.std(table()["actual"], ddof=1), rel=1e-14)
    assert "not of single ratings" in data.caption
    alone = data_of(PREDICTED, inputs_of(table().drop(columns="sd").head(1)))
    assert alone.rows[0]["within_one_sd"] is None
    assert "Without bands" in alone.caption
    draw_svg(PREDICTED, alone)


def test_rows_without_a_value_are_counted_and_text_is_refused() -> None:
    gap = table().assign(predicted=[None, *table()["predicted"][1:]])
    assert "Not shown: 1 row without" in data_of(PREDICTED, inputs_of(gap)).caption
    with pytest.raises(BadValue, match="'predicted'"):
        data_of(PREDICTED, inputs_of(table().astype({"predicted": object}).replace({"predicted": {11.0: "eleven"}})))
    with pytest.raises(DataRefused, match="no column 'forecast'"):
        data_of(PREDICTED, inputs_of(table()), predicted="forecast")
    with pytest.raises(DataRefused, match="SD below 0"):
        data_of(PREDICTED, inputs_of(table().assign(sd=-1.0)))


def test_text_and_numbers_in_a_table_are_read_alike() -> None:
    typed = data_of(PREDICTED, inputs_of(table()), panels="car").rows
    assert data_of(PREDICTED, inputs_of(table().astype(str)), panels="car").rows == typed
    shuffled = table().sample(frac=1, random_state=3)
    assert data_of(PREDICTED, inputs_of(shuffled[sorted(shuffled)]), panels="car").rows == typed


@pytest.mark.parametrize(("panels", "columns"), [(1, 1), (4, 2), (6, 3), (7, 4), (15, 5), (16, 4), (90, 10)])
def test_panels_leave_few_places_empty(panels: int, columns: int) -> None:
    assert grid_columns(panels) == columns


def test_cells_and_margins_are_the_errors_of_their_own_predictions() -> None:
    data = data_of(CLASS_HEATMAP, inputs_of(table().iloc[:7]), by="car", measure="RMSE")
    errors = {(row["class"], row["attribute"]): row["value"] for row in data.rows}
    assert errors["A", "x"] == pytest.approx(math.sqrt(5.0), rel=1e-15)  # (1 + 9) / 2
    assert errors["B", "y"] == 2.0
    assert errors["B", None] == 2.0
    assert errors[None, None] == pytest.approx(math.sqrt(47 / 7), rel=1e-15)
    assert [row["n"] for row in data.rows if row["class"] is None] == [4, 3, 7]


def test_a_missing_cell_is_hatched_and_reported() -> None:
    data = data_of(CLASS_HEATMAP, inputs_of(table().iloc[:6]), by="car", order="error")
    assert "Hatched: 1 cell without a prediction" in data.caption
    assert data.words["classes"] == ["A", "B"]
    _, drawn = draw_svg(CLASS_HEATMAP, data)
    written = [t.get_text() for t in drawn.figure.axes[0].texts]
    assert written[:3] == ["2.00", "2.50", "2.00"]


def test_violins_tell_the_quartiles_of_absolute_errors() -> None:
    data = data_of(VIOLINS, inputs_of(table()), by="car", order="median")
    summaries = {row["level"]: row for row in data.rows if row["shows"] == "level"}
    assert [summaries["A"][name] for name in ("q1", "median", "q3", "mean")] == [0.75, 2.0, 3.5, 2.25]  # numpy 2.3
    assert sorted(row["value"] for row in data.rows if row["level"] == "B" and row["shows"] == "value") == [2, 2, 2, 4]
    signed = data_of(VIOLINS, inputs_of(table()), by="car", signed=True)
    assert min(row["value"] for row in signed.rows if row["shows"] == "value") == -3
    draw_svg(VIOLINS, data)


def test_a_huge_offset_changes_no_error() -> None:
    far = table().assign(actual=table()["actual"] + 2**30, predicted=table()["predicted"] + 2**30)
    near = data_of(VIOLINS, inputs_of(table()), by="car").rows
    assert data_of(VIOLINS, inputs_of(far), by="car").rows == near
    draw_svg(PREDICTED, data_of(PREDICTED, inputs_of(far)))
