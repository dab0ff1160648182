import csv
import json
import re

import numpy as np
import pytest

from palpate.modeling.evaluate.outputs import REPORT, RESULTS
from palpate.modeling.textures.evaluation.evaluate import evaluate_methods
from palpate.modeling.textures.evaluation.figures import free_beginning
from palpate.modeling.textures.evaluation.outputs import default_of, tables, write_all
from palpate.modeling.textures.evaluation.report import report_html
from palpate.modeling.textures.evaluation.tables import printed_errors, printed_times, printed_variant, start_of
from tests.modeling.textures import small_evaluation as small

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(scope="module")
def evaluation(tmp_path_factory):
    recordings = small.recordings(5.0, ("cloth", "b <i>x</i>"))
    domain, options = small.domain(
        tmp_path_factory.mktemp("work"), recorded=recordings, methods_of=("ar", "foten", "foten_generative")
    )
    return evaluate_methods(domain, options)


@pytest.fixture(scope="module")
def folder(evaluation, tmp_path_factory):
    place = tmp_path_factory.mktemp("evaluated")
    write_all(evaluation, place)
    return place


def test_the_page_needs_nothing_else_and_escapes_names(folder):
    page = (folder / REPORT).read_text(encoding="utf-8")
    assert "b &lt;i&gt;x&lt;/i&gt;" in page
    assert "b <i>x" not in page
    assert not re.search(r'(src|href)="(?!#|data:)', page)
    for words in (
        "Running free",
        "One step ahead",
        "Table 4.1, MAE",
        "Table 4.3, time",
        "Figure 4.6",
        "Figure 4.7",
        "The rule",
    ):
        assert words in page


def test_the_page_says_what_was_reached_and_how_the_one_step_network_failed(evaluation):
    page = report_html(evaluation)
    assert "nothing to go by" in page  # it was a quick run
    assert "Keeps all limits on 0 of 2 textures" in page
    assert re.search(r"Against AR</b><span>Nearer on \d of 2", page)


def test_the_thesis_numbers_are_set_apart_and_are_the_best_of_nothing(folder):
    page = (folder / REPORT).read_text(encoding="utf-8")
    line = re.search(r"<tr>(<td[^>]*>The baseline, thesis</td>.*?)</tr>", page)[1]
    assert "0.410" in line
    assert set(re.findall(r'class="([^"]*)"', line)) == {"theirs"}
    assert re.search(r'<td class="best">0\.\d{3}</td>', page)


def test_table_4_3_holds_errors_and_times_side_by_side(evaluation):
    for row in tables(evaluation)["table_4_3"]:
        assert row["felt_dB"] is not None
        assert row["mae"] is not None
        assert row["median_us"] > 0
    assert {row["runtime"] for row in tables(evaluation)["table_4_3"]} >= {"NumPy"}


def test_tables_json_and_figures_hold_the_same_numbers(evaluation, folder):
    content = json.loads((folder / RESULTS).read_text())
    for name, rows in tables(evaluation).items():
        if name != "learning_curves":
            assert len(content["tables"][name]) == len(rows)
        with (folder / "tables" / f"{name}.csv").open(newline="") as lines:
            assert len(list(csv.DictReader(lines))) == len(rows)
    rows = {(row["texture"], row["method"]): row for row in content["tables"]["free_running"]}
    assert rows["cloth", "truth"]["cycle"] is not None
    assert rows["cloth", "another realisation"]["smoothed_gfc"] > 0.9
    assert rows["cloth", "foten_generative"]["level"] > 2 * rows["cloth", "foten"]["level"]
    assert "cloth" in {row["texture"] for row in content["tables"]["textures"]}
    for name in content["files"]:
        assert (folder / name).is_file()
    assert "figures/free_waves.png" in content["files"]


def test_figure_4_6_stands_beside_the_same_method_running_free(evaluation, folder):
    assert "Running free, in time" in (folder / REPORT).read_text(encoding="utf-8")
    assert (folder / "figures/figure_4_6_free.png").is_file() and (folder / "figures/figure_4_6.png").is_file()
    rows = {(row["texture"], row["method"]): row for row in tables(evaluation)["warm_up"]}
    for texture, (truth, simulated) in free_beginning(evaluation, "foten").items():
        drive, start = evaluation.drives[texture], start_of(evaluation.drives[texture])
        assert len(truth) == len(simulated) == 400 and np.array_equal(truth, drive.truth[start:][:400])
        assert drive.speed[start] > 10 and drive.force[start] > 0.15
        assert not ((drive.speed[:start] > 10) & (drive.force[:start] > 0.15)).any()
        level = np.sqrt(np.mean(simulated[100:].astype(float) ** 2) / np.mean(truth[100:] ** 2))
        assert rows[texture, "foten"]["level_next_300"] == pytest.approx(level)
    assert ("cloth", "foten_generative") in rows


def test_what_an_earlier_evaluation_wrote_and_this_one_does_not_is_removed(evaluation, tmp_path):
    write_all(evaluation, tmp_path, drawings=True)
    (tmp_path / "mine.txt").write_text("kept")
    paths = write_all(evaluation, tmp_path, drawings=False)
    assert not list((tmp_path / "figures").glob("*"))
    assert (tmp_path / "mine.txt").is_file()
    assert paths[-1] == tmp_path / REPORT


def test_a_lab_trains_what_its_own_whole_evaluation_of_the_same_recordings_chose(evaluation, tmp_path):
    recordings = tuple(evaluation.domain.recordings.values())
    folder = tmp_path / "evaluated" / "textures"
    write_all(evaluation, folder, drawings=False)
    content = json.loads((folder / RESULTS).read_text())
    content["default"]["method"] = "hapinf"

    def chosen(**changed):
        (folder / RESULTS).write_text(json.dumps({**content, **changed}))
        return default_of(tmp_path, recordings)

    assert chosen() == "foten_generative"  # a quick one says nothing
    assert chosen(quick=False) == "hapinf"
    assert chosen(quick=False, data={}) == "foten_generative"
    assert chosen(quick=False, data=7) == "foten_generative"
    assert default_of(tmp_path / "nowhere", recordings) == "foten_generative"


def test_the_thesis_numbers_stand_beside_ours():
    cells, mean = printed_errors("foten", "mae")
    assert (cells["steel_mesh"], mean) == (0.16, 0.148)
    assert printed_errors("ar", "gfc")[0]["plastic_mesh"] == 88.79
    assert printed_variant("ten_mfcc")["mae"] == 0.276
    assert printed_times("gan")["epoch_s"] == 85.71
    assert printed_errors("foten_generative", "mae") is printed_times("ar") is None
