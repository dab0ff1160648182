from pathlib import Path

import pytest

from benchmarks.attributes.folds import whole_folds
from benchmarks.attributes.material import random_material
from benchmarks.attributes.methods import AREA, cases
from palpate.analysis.measuring.rows import MEASURED, REFUSED, measure
from palpate.modeling.attributes.methods import Method
from tests.modeling.attributes import small_evaluation as small

pytestmark = pytest.mark.long

METHODS = {
    name: Method(name, method.title, method.fit, method.sees, restore=method.restore)
    for name, method in {**small.METHODS, "ann": Method("ann", "Refusing", small.fit_refusing)}.items()
}


@pytest.fixture(scope="module")
def rows():
    few = {name: METHODS[name] for name in ("mean", "ridge", "hv_net", "ann")}
    return [measure(case) for case in cases(True, few, {}, workers=1)]


def test_every_method_has_its_error_beside_the_times_of_training_and_of_50_predictions(rows):
    assert {row.area for row in rows} == {AREA}
    trained = {row.method: row for row in rows if row.case == "attributes of a texture left out"}
    predictions = {row.method: row for row in rows if row.case.startswith("50 predictions")}
    assert set(predictions) == {row.method for row in rows if row.case.startswith("a texture of 110 segments")}
    assert set(predictions) == {"mean", "ridge", "hv_net"}
    assert set(trained) == {*predictions, "ann"}
    assert trained["ann"].outcome == REFUSED
    for name, row in predictions.items():
        assert row.outcome == MEASURED and row.seconds > 0
        assert row.error == trained[name].error
    assert predictions["ridge"].error < predictions["mean"].error


def test_nothing_stays_behind(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    left = cases(True, {"mean": METHODS["mean"]}, {}, workers=1)
    next(left)
    left.close()
    assert list(Path(tmp_path).iterdir()) == []


def test_simulated_textures_are_the_same_ones_each_time():
    one, again, other = random_material(4, 3, 2), random_material(4, 3, 2), random_material(4, 3, 2, seed=1)
    assert (one.textures[2].touch["dwt"] == again.textures[2].touch["dwt"]).all()
    assert (one.textures[2].touch["dwt"] != other.textures[2].touch["dwt"]).all()
    assert {kind: rows.shape for kind, rows in one.textures[0].sight.items()} == {"resnet": (2, 2048), "glcm": (2, 256)}


def test_a_full_run_leaves_eight_of_the_textures_out():
    rows = [measure(case) for case in cases(False, {"mean": METHODS["mean"]}, {}, workers=1)]
    assert rows[0].n == 8 and rows[0].input.startswith("16 made-up textures, 8 left out")


@pytest.mark.needs("distributed")
def test_two_folds_of_a_whole_study_err_the_same_one_after_another_and_by_dask_workers(monkeypatch):
    monkeypatch.setattr("benchmarks.attributes.methods.TEXTURES", 6)
    monkeypatch.setattr("benchmarks.attributes.folds.WHOLE", 6)
    monkeypatch.setattr("benchmarks.attributes.folds.WHOLE_SEGMENTS", 12)
    few = {name: METHODS[name] for name in ("mean", "visuo_tactile")}
    every = [case for case in cases(False, few, {}, workers=1) if case.case.startswith("2 folds of a study")]
    alone, by_dask = (measure(case) for case in every)
    ours = "palpate, visuo_tactile"
    assert [alone.method, by_dask.method] == [f"{ours}, one after another", f"{ours}, 2 Dask workers"]
    assert alone.outcome == MEASURED and alone.runs == 1
    assert 0 < alone.error < 50 and alone.seconds > 0 and by_dask.seconds > 0
    assert by_dask.error == alone.error
    assert alone.input == "6 made-up textures, 12 segments, 10 pictures each"


def test_a_method_that_refuses_the_folds_of_a_study_is_reported_as_refusing(monkeypatch):
    monkeypatch.setattr("benchmarks.attributes.folds.WHOLE", 6)
    monkeypatch.setattr("benchmarks.attributes.folds.WHOLE_SEGMENTS", 12)
    refusing = {"visuo_tactile": Method("visuo_tactile", "Refusing", small.fit_refusing)}
    assert measure(next(whole_folds(refusing, {}))).outcome == REFUSED
    assert list(whole_folds({"mean": METHODS["mean"]}, {})) == []
