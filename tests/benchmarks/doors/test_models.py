from pathlib import Path

import pytest

from benchmarks.doors.models import AREA, Trained, cases
from palpate.analysis.measuring.rows import MEASURED, measure
from tests.modeling.doors.small_evaluation import options, small_rated

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(scope="module")
def rows():
    """The rows of two cheap methods: each case is measured while the models lie there, as the bench does."""
    choice = options("mean ridge", "nearest", folds=2, quick=True)
    return [measure(case) for case in cases(True, choice, small_rated())]


def test_every_figure_is_measured(rows):
    assert {row.area for row in rows} == {AREA}
    assert [(row.case, row.method, row.note) for row in rows if row.outcome != MEASURED] == []
    assert {"force to feeling", "feeling to force", "128 corners", "a prediction"} <= {row.case for row in rows}


def test_the_methods_stand_beside_the_noise_ceiling_and_ridge_beats_the_mean(rows):
    error = {row.method: row.error for row in rows if row.case == "force to feeling"}
    assert error["ridge"] < error["mean"]
    assert 0 < error["a perfect predictor (noise ceiling)"] < error["mean"]


def test_the_waveforms_floors_stand_beside_the_methods(rows):
    error = {row.method: row.error for row in rows if row.error_kind.startswith("waveform")}
    assert any(name.startswith("floor") for name in error)
    assert error["nearest"] > 1.0


def test_answers_have_a_median_and_a_99th_percentile(rows):
    slow = [row for row in rows if "99th" in row.error_kind]
    assert {row.case for row in slow} == {"a prediction", "a slider's move to its profile"}
    assert all(row.seconds is not None and 1e3 * row.seconds <= 10 * row.error for row in slow)


def test_a_training_stands_with_its_methods_error_and_the_seconds_that_it_took(rows):
    error = {row.method: row.error for row in rows if row.case == "force to feeling"}
    trained = {row.method: row for row in rows if row.case == "training, force to feeling"}
    assert {name: row.error for name, row in trained.items()} == {name: error[name] for name in ("mean", "ridge")}
    assert all(row.runs == 1 and row.peak_MB is None for row in trained.values())
    assert trained["ridge"].seconds > trained["mean"].seconds > 0
    loop = {row.method: row.error for row in rows if row.error_kind.startswith("loop") and "fresh" in row.error_kind}
    trainings = {row.method: row for row in rows if row.case == "training, feeling to force"}
    assert trainings["nearest"].error == loop["nearest"] == trainings["all methods"].error
    assert trainings["all methods"].seconds > sum(row.seconds for row in trained.values())
    assert "both networks of the thesis" not in trainings


def test_a_method_without_a_file_has_the_time_of_its_trained_model(monkeypatch):
    monkeypatch.setattr(Trained, "model", lambda *_: None)
    choice = options("mean", "nearest", folds=2, quick=True)
    of_mean = [case for case in cases(True, choice, small_rated()) if case.method == "mean (no file)"]
    row = measure(of_mean[0])
    assert row.case == "force to feeling" and row.runs == 1 and 0 < row.seconds < 0.1


def test_nothing_stays_behind(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    left = cases(True, options("mean", folds=2, quick=True), small_rated())
    next(left)
    left.close()
    assert list(Path(tmp_path).iterdir()) == []
