import csv
import dataclasses
import json
import re
import shutil

import numpy as np
import pytest
from scipy import stats

from palpate.modeling.attributes.evaluation.outputs import as_json, default_of, tables, write_all
from palpate.modeling.attributes.evaluation.report import banners, reached, report_html
from palpate.modeling.attributes.evaluation.tables import fold_rows, method_rows, number_of, printed, table_rows
from palpate.modeling.attributes.methods import Method
from palpate.modeling.attributes.resnet_weights import Weights
from palpate.modeling.evaluate.outputs import REPORT, RESULTS, evaluation_folder
from tests.modeling.attributes import small_evaluation as small

TIMES = {"recording": 2.0, "mfcc": 0.25, "hand": 0.5, "picture": 4.0, "glcm": 1.0}
NAMES = ["Rough-Smooth", "Flat-Bumpy", "Sticky-Slippery", "Hard-Soft"]


@pytest.fixture(scope="module")
def evaluation(tmp_path_factory):
    material = small.changed(small.material(), "T02", label="b <i>x</i>", notes=("odd <b>",), category="b_<i>y</i>")
    methods = {**small.METHODS, "ann": Method("ann", "Refusing", small.fit_refusing)}
    return small.evaluation(tmp_path_factory.mktemp("work"), material, methods, TIMES, ablations=True)


@pytest.fixture(scope="module")
def folder(evaluation, tmp_path_factory):
    place = tmp_path_factory.mktemp("evaluated")
    write_all(evaluation, place)
    return place


@pytest.fixture(scope="module")
def rows(evaluation):
    return {row["method"]: row for row in method_rows(evaluation)}


@pytest.mark.long
def test_errors_stand_beside_times_and_differences(evaluation, rows):
    off = np.abs(evaluation.predicted(evaluation.main("ridge")) - evaluation.rated())
    assert rows["ridge"]["mae"] == pytest.approx(off.mean())
    assert rows["ridge"]["within_jnd"] == pytest.approx((off <= 10).mean())
    assert rows["ridge"]["features_s"] == 7.75  # the recording is prepared once for both of its kinds
    assert rows["mean"]["features_s"] == 0.0
    assert rows["ridge"]["train_s"] == rows["ridge"]["answer_s"] == 1.0
    assert rows["visuo_tactile"]["features_s"] is None  # resnet was not timed
    assert rows["ann"]["mae"] is rows["ann"]["best_less"] is None
    assert rows["ann"]["refused"] == "this method has had enough."
    best = min((row for row in rows.values() if row["mae"] is not None), key=lambda row: row["mae"])
    assert best["best_less"] is None
    for row in rows.values():
        if row["mae"] is not None and row is not best:
            assert row["best_less"] == pytest.approx(row["mae"] - best["mae"])
            assert row["best_low"] < row["best_less"] < row["best_high"]
            assert row["best_chance"] == (row["best_low"] <= 0 <= row["best_high"])
    assert rows["mean"]["best_chance"] is False


def test_all_intervals_that_are_shown_hold_together(evaluation, rows):
    """Five methods answered; the best is not the thesis' network: 4 + 4 intervals, of which one stands twice."""
    mae = {name: np.abs(evaluation.predicted(evaluation.main(name)) - evaluation.rated()).mean(axis=1)
           for name, row in rows.items() if row["mae"] is not None}  # fmt: skip
    best, ours = min(mae, key=lambda name: mae[name].mean()), "visuo_tactile"
    assert len(mae) == 5
    pairs = {frozenset((name, other)) for name in mae for other in (best, ours) if name != other}
    assert len(pairs) == 7
    options = 1 - 0.05 / 7
    for name, own in mae.items():
        for column, other in (("best", best), ("ours", ours)):
            if name != other:
                ends = stats.ttest_rel(own, mae[other]).confidence_interval(options)
                assert (rows[name][f"{column}_low"], rows[name][f"{column}_high"]) == pytest.approx(tuple(ends))


def test_intervals_are_the_finite_sample_quantile_of_the_errors_of_textures_left_out(evaluation):
    intervals = as_json(evaluation)["intervals"]
    off = np.abs(evaluation.predicted(evaluation.main("ridge")) - evaluation.rated())
    # 12 textures: k = ceil(13 * 0.9) = 12, the greatest
    assert [intervals["half_width"]["ridge"][name] for name in NAMES] == pytest.approx(off.max(axis=0).tolist())
    assert intervals["coverage"] == 0.9
    assert "ann" not in intervals["half_width"]


def test_tables_3_2_and_3_3_hold_every_method_with_the_thesis_beside(evaluation):
    for which, measure in (("mae", np.abs), ("rmse", np.square)):
        by_method = {row["method"]: row for row in table_rows(evaluation, which)}
        assert list(by_method)[:4] == ["mean", "ridge", "visuo_tactile", "visuo_tactile, thesis"]
        own = measure(evaluation.predicted(evaluation.main("visuo_tactile")) - evaluation.rated()).mean(axis=0)
        own = own if which == "mae" else np.sqrt(own)
        assert [by_method["visuo_tactile"][name] for name in NAMES] == pytest.approx(own.tolist())
        assert by_method["visuo_tactile"]["mean"] == pytest.approx(own.mean())
        assert by_method["ann, thesis"]["printed"] and by_method["ann"]["mean"] is None


def test_tables_3_4_and_3_5_tell_methods_and_features_apart(evaluation):
    assert {row["method"] for row in table_rows(evaluation, "same_features")} == {
        "hv_net", "hv_net, thesis", "ht_net", "ht_net, thesis",
    }  # fmt: skip
    kinds = [(row["method"], row["features"]) for row in table_rows(evaluation, "kinds") if not row["printed"]]
    assert {name for method, name in kinds if method == "hv_net"} == {"resnet", "glcm", "resnet+glcm"}
    assert {name for method, name in kinds if method == "ht_net"} == {"dwt+hand", "dft+hand", "mfcc+hand"}
    assert ("visuo_tactile", "mfcc+hand+resnet+glcm") in kinds
    theirs = {row["features"]: row for row in table_rows(evaluation, "kinds") if row["printed"]}
    assert theirs["dwt+hand"]["Flat-Bumpy"] == 46.8


def test_the_page_needs_nothing_else_and_escapes_names(folder):
    page = (folder / REPORT).read_text(encoding="utf-8")
    assert "b <i>" not in page and "odd <b>" not in page
    assert not re.search(r'(src|href)="(?!#|data:)', page)
    for words in (
        "Table 3.2, MAE",
        "Table 3.3, RMSE",
        "Table 3.4, RMSE",
        "Table 3.5, RMSE",
        "Figure 3.8",
        "Figure 3.9",
    ):
        assert words in page
    for words in ("The rule", "Not evaluated", "Simulated", "made up", "Bonferroni"):
        assert words in page


def test_the_page_says_which_method_is_the_default_and_what_was_reached(evaluation):
    page = report_html(evaluation)
    assert "Ridge has the least MAE" in page
    assert "is not the lowest" in page
    sentence = dict(reached(evaluation))["Fusion"]
    assert re.search(r"(?<!not )reached\.$|: not reached\.$", sentence)
    errors = [float(error) for error in re.findall(r"\d+\.\d\d", sentence)[:3]]
    assert sentence.endswith(": reached.") == (errors[0] < min(errors[1:]))


def test_the_best_is_marked_by_the_report_and_the_thesis_is_the_best_of_nothing(folder):
    page = (folder / REPORT).read_text(encoding="utf-8")
    line = re.search(r"<tr>(<td[^>]*>The thesis&#39; network, thesis</td>.*?)</tr>", page)[1]
    assert "5.23" in line
    assert "best" not in line
    assert re.search(r'<td class="best">\d+\.\d\d</td>', page)


def test_tables_json_and_figures_hold_the_same_numbers(evaluation, folder):
    content = json.loads((folder / RESULTS).read_text())
    for name, rows in tables(evaluation).items():
        with (folder / "tables" / f"{name}.csv").open(newline="") as lines:
            read = list(csv.DictReader(lines))
        assert len(read) == len(rows)
        if name != "predictions":
            assert len(content["tables"][name]) == len(rows)
    assert len(tables(evaluation)["predictions"]) == 5 * 12 * 4
    for name in ("figure_3_8", "figure_3_9", "scatter_3_8", "figure_3_9_visuo_tactile", "work_precision"):
        assert f"figures/{name}.png" in content["files"]
    for name in content["files"]:
        assert (folder / name).is_file()


def test_a_class_is_shown_in_words_and_its_id_is_left_to_the_tables(folder):
    page = (folder / REPORT).read_text()
    chart = (folder / "figures" / "figure_3_9.svg").read_text()
    assert "b &lt;i&gt;y&lt;/i&gt;" in page and "b_&lt;i" not in page
    assert "b &lt;i&gt;y" in chart and "b_&lt;i" not in chart


def test_classes_are_reported_with_a_row_over_all_attributes(evaluation):
    rows = [row for row in tables(evaluation)["classes"] if row["method"] == "ridge"]
    assert {row["class"] for row in rows} == {"wood", "foam", "mesh", "b_<i>y</i>"}
    whole = [row for row in rows if row["attribute"] == "all"]
    total = sum(row["mae"] * row["textures"] for row in whole) / 12
    assert total == pytest.approx(method_rows(evaluation)[1]["mae"])


def test_what_an_earlier_evaluation_wrote_and_this_one_does_not_is_removed(evaluation, folder, tmp_path):
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    (tmp_path / "mine.txt").write_text("kept")
    paths = write_all(evaluation, tmp_path, drawings=False)
    assert not list((tmp_path / "figures").glob("*"))
    assert (tmp_path / "mine.txt").is_file()
    assert paths[-1] == tmp_path / REPORT


@pytest.mark.long
def test_a_quick_evaluation_says_so_and_has_no_intervals(tmp_path):
    evaluation = small.evaluation(
        tmp_path, methods={name: small.METHODS[name] for name in ("mean", "ridge")}, quick=True
    )
    assert any("5 textures were left out" in line for line in banners(evaluation))
    assert as_json(evaluation)["intervals"]["half_width"] == {}
    assert all(row["half_width"] is None for row in method_rows(evaluation))
    write_all(evaluation, tmp_path / "out")
    short = small.evaluation(tmp_path, epochs=3)
    assert any("at most 3 epochs" in line for line in banners(short))


def test_early_stopping_and_the_held_out_textures_are_reported(tmp_path):
    watched = [row["held"] for row in fold_rows(small.evaluation(tmp_path / "own"))]
    assert watched == [""] * len(watched)
    stopped = small.evaluation(tmp_path / "asked", early_stopping=True)
    assert as_json(stopped)["early_stopping"] is True
    assert any("watched a tenth of the textures" in line for line in banners(stopped))
    for row, fold in zip(fold_rows(stopped), stopped.domain.folds.values(), strict=True):
        assert row["held"].split() == list(fold.held) != []
        assert row["known"] == len(stopped.material.textures) - 1


def test_textures_kept_apart_are_named(tmp_path):
    material = small.changed(small.material(), "T02", made_from=small.material().textures[0].made_from)
    evaluation = small.evaluation(tmp_path, small.changed(material, "T05", rated=None))
    lines = banners(evaluation)
    assert any("never divided: T01, T02." in line for line in lines)
    assert "Not used: T05: it was not rated." in lines


def test_a_lab_trains_what_its_own_whole_evaluation_of_the_same_textures_chose(tmp_path):
    evaluation = small.evaluation(tmp_path / "work")
    write_all(evaluation, evaluation_folder(tmp_path, "attributes"), drawings=False)
    default = default_of(tmp_path, evaluation.material)
    assert default.method == "ridge"
    assert re.fullmatch(r"this lab's evaluation of 12 textures: Ridge has the least MAE: \d+\.\d\d.*", default.why)
    other = default_of(tmp_path, small.changed(evaluation.material, "T01", category="other"))
    assert other.method == "visuo_tactile"
    assert "evaluation was of other textures, features or ratings: it does not decide" in other.why
    none = default_of(tmp_path / "nowhere", evaluation.material)
    assert (none.method, "this lab has no evaluation that can be read" in none.why) == ("visuo_tactile", True)


@pytest.mark.long
@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"quick": True, "tested": ["T01"]}, "this lab's evaluation was quick: it does not decide."),
        ({"epochs": 200}, "evaluation had --epochs 200: it"),
        ({"early_stopping": True}, "evaluation had --early-stopping: it"),
        ({"tested": ["T01"]}, "evaluation left 1 of 12 textures out: it"),
        ({"tables": {"methods": [{"method": "ridge"}]}}, "evaluation was without visuo_tactile: it"),
        ({"quick": True, "epochs": 3}, "evaluation was quick and had --epochs 3: it"),
        ({"tables": {}}, "is not as this version writes it: it"),
        ({"data": 7}, "is not as this version writes it: it"),
    ],
)
def test_an_evaluation_that_does_not_decide_what_is_trained_says_why(tmp_path, changed, message):
    evaluation = small.evaluation(tmp_path / "work")
    write_all(evaluation, evaluation_folder(tmp_path, "attributes"), drawings=False)
    results = evaluation_folder(tmp_path, "attributes") / RESULTS
    results.write_text(json.dumps({**json.loads(results.read_text()), **changed}))
    default = default_of(tmp_path, evaluation.material)
    assert default.method == "visuo_tactile"
    assert default.why.startswith("the shipped default, for this lab's evaluation ")
    assert message in default.why


@pytest.mark.parametrize(("sense", "trained"), [("touch", "hv_net"), ("sight", "ht_net")])
def test_where_one_sense_has_nothing_the_branch_of_the_other_is_trained(tmp_path, sense, trained):
    material = small.material()
    for texture in material.textures:
        material = small.changed(material, texture.id, **{sense: {}})
    assert default_of(tmp_path, material).method == trained


def test_as_many_folds_as_there_are_textures_are_a_whole_evaluation(tmp_path):
    evaluation = small.evaluation(tmp_path / "work", folds=12)
    assert not any("were left out" in line for line in banners(evaluation))
    write_all(evaluation, evaluation_folder(tmp_path, "attributes"), drawings=False)
    assert default_of(tmp_path, evaluation.material).method == "ridge"
    small_one = small.evaluation(tmp_path / "work", folds=11)
    write_all(small_one, evaluation_folder(tmp_path, "attributes"), drawings=False)
    assert default_of(tmp_path, evaluation.material).method == "visuo_tactile"


def test_the_thesis_numbers_stand_as_its_tables_have_them():
    assert printed("mae", "visuo_tactile")["Flat-Bumpy"] == 4.48
    assert printed("rmse", "ann")["Hard-Soft"] == 32.19  # the text has 29.12
    assert printed("mae", "vision_cnn")["Flat-Bumpy"] == 19.63  # the text has 18.55
    assert printed("kinds", "hv_net", "resnet+glcm")["Rough-Smooth"] == 13.26  # the text has 10.11
    assert printed("same_features", "tactile_svm")["mean"] == pytest.approx((18.38 + 27.38 + 32.35 + 36.96) / 4)
    assert printed("mae", "ridge") is printed("kinds", "hv_net", "dft") is None
    assert [number_of(which) for which in ("mae", "rmse", "same_features", "kinds")] == ["3.2", "3.3", "3.4", "3.5"]


def test_other_attributes_have_no_thesis_beside_them(tmp_path):
    material = small.material()
    others = tuple(dataclasses.replace(pair, low=f"{pair.low}er") for pair in material.attributes)
    evaluation = small.evaluation(tmp_path, dataclasses.replace(material, attributes=others))
    assert not any(row["printed"] for row in table_rows(evaluation, "mae"))


def test_random_weights_of_resnet_stand_beside_every_number_that_rests_on_them(tmp_path):
    description = Weights().description
    evaluation = small.evaluation(tmp_path, dataclasses.replace(small.material(), weights=description), ablations=True)
    title, tables_with_title = "The thesis' network, random ResNet-50", []
    for name, rows in tables(evaluation).items():
        rest = [row for row in rows if row.get("method") == "visuo_tactile"]
        if rest and "title" in rest[0]:
            assert {row["title"] for row in rest} == {title}, name
            tables_with_title.append(name)
    assert {"methods", "attributes", "classes", "table_3_2", "table_3_3", "table_3_5", "predictions"} <= set(
        tables_with_title
    )
    kinds = {row["features"]: row["resnet"] for row in table_rows(evaluation, "kinds") if not row["printed"]}
    assert kinds["resnet"] == kinds["resnet+glcm"] == "random" and kinds["glcm"] is None
    printed_rows = [row for row in table_rows(evaluation, "mae") if row["printed"] and "resnet" in row["features"]]
    assert printed_rows and {row["resnet"] for row in printed_rows} == {"pre-trained"}
    page = report_html(evaluation)
    assert page.count("random ResNet-50") > 6 and f"Weights of ResNet-50: {description}" in " ".join(
        banners(evaluation)
    )
    given = dataclasses.replace(small.material(), weights="resnet50-0676ba61.pth, SHA-256 0676ba61")
    rows = {row["method"]: row for row in method_rows(small.evaluation(tmp_path / "given", given))}
    assert rows["visuo_tactile"]["resnet"] == "resnet50-0676ba61.pth" and rows["ridge"]["resnet"] is None
    assert rows["visuo_tactile"]["title"] == "The thesis' network"
