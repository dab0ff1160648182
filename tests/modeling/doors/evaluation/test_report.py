import json
import re
from dataclasses import replace

import pytest

from palpate.analysis.reports.tables import written
from palpate.modeling.doors.evaluation.evaluate import evaluate_doors
from palpate.modeling.doors.evaluation.inverse_section import inverse_section
from palpate.modeling.doors.evaluation.outputs import default_of, write_all
from palpate.modeling.doors.evaluation.report import report_html
from tests.modeling.doors.small_evaluation import options, small_data

pytestmark = pytest.mark.needs("torch")


@pytest.fixture(scope="module")
def evaluation():
    return evaluate_doors(small_data(simulated=True), None, options("mean ridge", "nearest", beside=True))


@pytest.fixture(scope="module")
def folder(evaluation, tmp_path_factory):
    where = tmp_path_factory.mktemp("evaluated")
    write_all(evaluation, where)
    return where


def test_the_page_needs_nothing_from_outside_and_runs_no_script_but_its_own(folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', page)[1]
    assert policy.startswith("default-src 'none'")
    assert "script-src 'sha256-" in policy
    assert page.count("<script") == 1
    links = re.findall(r'(?:src|href|xlink:href)="([^"#][^"]*)"', page)
    assert set(links) <= {"data:,"}


def test_the_page_says_what_a_reader_must_know(folder):
    page = (folder / "report.html").read_text(encoding="utf-8")
    for words in ("linear in columns of the stimulus table", "private data of other people", "Noise ceiling",
                  "Table 5.3", "Table 5.4", "Table 5.5", "Table 5.6", "Figure 5.12", "Figure 5.13", "Figure 5.14",
                  "leaky folds", "one door left out", "The measured door", "All corners"):  # fmt: skip
        assert words in page, words
    assert not re.search(r">\s*(nan|inf|None)\s*<", page, re.IGNORECASE)


def test_files_are_written_and_those_of_an_earlier_evaluation_go(evaluation, folder, tmp_path):
    content = json.loads((folder / "evaluation.json").read_text())
    assert {"tables/table_5_3_mae.csv", "figures/figure_5_12.svg", "figures/made_profiles.png", "report.html"} <= set(
        content["files"]
    )
    assert all((folder / name).stat().st_size for name in content["files"])
    earlier, outside = tmp_path / "out" / "figures" / "figure_9.svg", tmp_path / "outside.txt"
    earlier.parent.mkdir(parents=True)
    for path in (earlier, outside, tmp_path / "out" / "mine.txt"):
        path.write_text("there before")
    (tmp_path / "out" / "evaluation.json").write_text(json.dumps({"files": ["figures/figure_9.svg", "../outside.txt"]}))
    write_all(evaluation, tmp_path / "out", drawings=False)
    assert not earlier.exists()
    assert outside.exists()
    assert (tmp_path / "out" / "mine.txt").exists()


def test_names_from_the_data_are_escaped(evaluation):
    data = replace(evaluation.data, made_from=("<script>alert(1)</script>",))
    results = replace(evaluation.results, domain=replace(evaluation.results.domain, data=data))
    page = report_html(replace(evaluation, results=results))
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert(1)" in page


def test_a_labs_own_evaluation_decides_what_is_trained_but_only_for_the_very_same_data(evaluation, tmp_path):
    data = evaluation.data
    assert default_of(tmp_path, data, "inverse") == "generator"
    write_all(evaluation, tmp_path / "evaluated" / "doors", drawings=False)
    assert default_of(tmp_path, data, "inverse") == "generator", "it was not evaluated, so nothing speaks against it"
    file = tmp_path / "evaluated" / "doors" / "evaluation.json"
    content = json.loads(file.read_text())
    content["tables"]["methods_inverse"].append({"method": "generator"})
    file.write_text(json.dumps(content))
    assert default_of(tmp_path, data, "inverse") == "nearest"
    assert default_of(tmp_path, replace(data, rating=data.rating * 0.5), "inverse") == "generator"
    content["default"]["inverse"]["method"] = "search"
    file.write_text(json.dumps(content))
    assert default_of(tmp_path, data, "inverse") == "generator"
    file.write_text("{}")
    assert default_of(tmp_path, data, "inverse") == "generator"


def test_error_and_time_of_every_inverse_method_stand_in_one_table(evaluation):
    (row,) = (dict(row) for row in evaluation.inverse)
    without = replace(evaluation, inverse=({**row, "file_ms": None, "trained_ms": 1234.5, "note": "needs torch"},))
    tables = [block for block in inverse_section(without, ()).blocks if block.kind == "table"]
    (timed,) = (table for table in tables if table.title == "Error and time")
    cells = dict(zip([head.name for head in timed.table.heads], timed.table.rows[0], strict=True))
    assert cells["loop"] == written(row["loop_fresh"] or row["loop_judge"], "2")
    assert cells["without a file, ms"] == "1234"
    assert "needs torch" in timed.note
