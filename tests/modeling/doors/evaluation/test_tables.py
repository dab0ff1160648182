from dataclasses import replace

import numpy as np
import pytest

from palpate.modeling.doors.evaluation.evaluate import forward_choice, inverse_choice
from palpate.modeling.doors.evaluation.tables import (
    AVERAGE,
    OVERALL,
    THESIS,
    cell_rows,
    cells_table,
    prediction_rows,
    printed,
    printed_waveforms,
    variant_rows,
    waveform_rows,
    waveform_table,
)
from palpate.modeling.doors.results import MethodResults
from palpate.modeling.doors.scores import mae, r2, rmse
from tests.modeling.doors.small_evaluation import small_data


def gathered(direction="forward", off=0.0):
    data = small_data()
    actual = 50 + 5 * data.rating if direction == "forward" else data.force_N + 20.0
    return MethodResults(direction, "some", "grouped", data, np.arange(len(data)) % 3, actual, actual + off,
                    np.full((len(data), 7), 10.0), ())  # fmt: skip


@pytest.mark.parametrize("measure", ["mae", "rmse", "r2"])
def test_the_margins_that_the_thesis_printed_are_the_means_of_the_cells_typed_in_here(measure):
    thesis, digits = printed(measure), 0.0101  # some are rounded, others cut off
    for attribute, value in thesis.by_attribute.items():
        assert np.mean([v for (a, _), v in thesis.cells.items() if a == attribute]) == pytest.approx(value, abs=digits)
    for door, value in thesis.by_door.items():
        assert np.mean([v for (_, d), v in thesis.cells.items() if d == door]) == pytest.approx(value, abs=digits)


def test_table_5_6_as_printed():
    thesis = printed_waveforms()
    assert thesis.by_door["K3"] == {"mae": 0.537, "mae_sd": 0.302, "rmse": 0.654, "rmse_sd": 0.329}
    assert thesis.overall("mae") == pytest.approx(0.578, abs=5e-4)


def test_scores_by_hand():
    actual, predicted = np.array([[0.0, 10.0], [4.0, 20.0]]), np.array([[1.0, 10.0], [4.0, 14.0]])
    assert mae(actual, predicted) == pytest.approx(7 / 4)
    assert rmse(actual, predicted) == pytest.approx(np.sqrt(37 / 4))
    assert r2(actual, predicted) == pytest.approx(1 - 37 / (8 + 50))


def test_r2_of_ratings_that_do_not_vary_is_no_number():
    assert r2(np.full((5, 1), 60.0), np.full((5, 1), 61.0)) is None


def test_a_constant_shift_is_every_cell_and_every_margin():
    rows = cell_rows(gathered(off=3.0), "mae")
    assert [row["attribute"] for row in rows] == [*small_data().attributes, AVERAGE]
    assert all(row[name] == pytest.approx(3.0) for row in rows for name in ("BC3", "FORD", "K8", AVERAGE))


def test_the_thesis_own_table_stands_below_with_its_provenance():
    rows = cells_table([gathered(off=1.0)], "mae")
    theirs = [row for row in rows if row["method"] == THESIS]
    assert "private data, other people" in THESIS
    assert theirs[0]["BC3"] == 5.0
    assert theirs[-1]["FORD"] == 2.81
    assert "G90" not in theirs[0]


def test_other_attributes_get_no_numbers_of_the_thesis():
    gathered_results = gathered()
    other = replace(gathered_results, data=replace(gathered_results.data, attributes=tuple("abcdefg")))
    assert not [row for row in cells_table([other], "mae") if row["method"] == THESIS]


def test_waveforms_by_door_by_variant_and_over_all():
    gathered_results = gathered("inverse", off=np.repeat([1.0, 2.0, 3.0], 5)[:, None])
    rows = {row["door"]: row for row in waveform_rows(gathered_results)}
    assert rows["FORD"]["mae"] == pytest.approx(2.0)
    assert rows["FORD"]["mae_sd"] == pytest.approx(0.0, abs=1e-9)
    assert rows[OVERALL]["mae"] == pytest.approx(2.0)
    assert [row["mae"] for row in waveform_rows(gathered_results, "variants")] == pytest.approx([2.0] * 6)
    assert [row["door"] for row in waveform_table([gathered_results]) if row["method"] == THESIS] == [
        "BC3",
        "FORD",
        "K8",
    ]


def test_variants_and_predictions_name_every_stimulus():
    gathered_results = gathered(off=2.0)
    assert [row["variant"] for row in variant_rows(gathered_results)] == ["g0", "g1", "g4", "g8", "g12"]
    rows = prediction_rows(gathered_results, np.full((15, 7), 4.0))
    assert len(rows) == 15 * 7
    assert rows[0]["low"] == pytest.approx(rows[0]["predicted"] - 4)


def forward(method, error):
    return {"method": method, "title": method.title(), "mae": error}


def test_a_baseline_that_beats_the_network_by_more_than_five_percent_becomes_the_default_in_plain_words():
    choice = forward_choice([forward("mean", 13.0), forward("forest", 3.0), forward("network", 3.3)])
    assert choice.method == "forest"
    beaten = "The network of the thesis is beaten: MAE 3.30 against 3.00 of Forest, 10% more; 5% was allowed."
    assert choice.of_ours == (beaten,)


def test_the_least_error_decides_however_little_less_it_is_and_of_equals_the_first():
    choice = forward_choice([forward("ridge", 2.85), forward("gaussian_process", 2.81), forward("network", 2.9)])
    assert choice.method == "gaussian_process"
    assert "the least MAE: 2.81" in choice.why
    behind = (
        "The network of the thesis is 3.2% behind the best other method: MAE 2.90 against 2.81 of Gaussian_Process."
    )
    assert choice.of_ours == (behind,)
    assert forward_choice([forward("ridge", 2.85), forward("forest", 2.85)]).method == "ridge"
    assert inverse_choice([inverse("network", 4.04), inverse("generator", 4.0)]).method == "generator"


def test_a_method_that_no_rig_can_be_given_is_no_default():
    choice = inverse_choice([inverse("search", 1.0), inverse("generator", 4.0)])
    assert choice.method == "generator"


def inverse(method, loop, corners=0.0):
    return {"method": method, "title": method, "loop_fresh": loop, "loop_judge": loop, "unplayable": 0,
            "corners_unplayable": corners, "waveform_mae": 9.0}  # fmt: skip


def test_a_method_that_leaves_the_limits_at_a_corner_is_not_the_default_however_small_its_loop_error():
    choice = inverse_choice([inverse("nearest", 3.0, corners=4.0), inverse("network", 8.0), inverse("generator", 4.0)])
    assert choice.method == "generator"
    assert "beaten" in choice.of_ours[0]
    assert inverse_choice([inverse("nearest", 3.0, corners=4.0)]).why.startswith("No method stays within the limits")
