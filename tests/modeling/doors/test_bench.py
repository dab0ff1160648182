from pathlib import Path

import pytest

pytest.importorskip("torch")

from analysis.measuring.rows import MEASURED, measure
from modeling.doors.bench import AREA, cases
from tests.modeling.doors.evaluated_small import SIDE, small_rated, wanted


@pytest.fixture(scope="module")
def rows():
    """The rows of two cheap methods: each case is measured while the models lie there, as the bench does."""
    asked = wanted("mean ridge", "nearest", folds=2, quick=True)
    return [measure(case) for case in cases(True, SIDE, asked, small_rated())]


def test_every_figure_is_measured(rows):
    assert {row.area for row in rows} == {AREA}
    assert [(row.case, row.method, row.note) for row in rows if row.outcome != MEASURED] == []
    assert {"force to feeling", "feeling to force", "128 corners", "a prediction", "training"} <= {
        row.case for row in rows
    }


def test_the_methods_stand_beside_the_noise_ceiling_and_ridge_beats_the_mean(rows):
    error = {row.method: row.error for row in rows if row.case == "force to feeling"}
    assert error["palpate, ridge"] < error["mean"]
    assert 0 < error["a perfect predictor (noise ceiling)"] < error["mean"]


def test_the_waveforms_floors_stand_beside_the_methods(rows):
    error = {row.method: row.error for row in rows if row.error_kind.startswith("waveform")}
    assert any(name.startswith("floor") for name in error)
    assert error["nearest"] > 1.0


def test_answers_have_a_median_and_a_99th_percentile(rows):
    slow = [row for row in rows if "99th" in row.error_kind]
    assert {row.case for row in slow} == {"a prediction", "a slider's move to its profile"}
    assert all(row.seconds is not None and 1e3 * row.seconds <= 10 * row.error for row in slow)


def test_nothing_stays_behind(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    left = cases(True, SIDE, wanted("mean", folds=2, quick=True), small_rated())
    next(left)
    left.close()
    assert list(Path(tmp_path).iterdir()) == []
