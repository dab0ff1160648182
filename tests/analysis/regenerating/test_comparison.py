"""What was committed is compared number by number, and a difference is reported with its place."""

import json

import pytest

from palpate.analysis.regenerating.comparison import NothingCommitted, difference_lines, differences
from palpate.analysis.regenerating.outputs import MARK

STATISTICS = {"tests": [{"name": "a", "outcome": "Hard", "seconds": 1.0, "results": [{"F": 3.25, "p": 0.01, "n": 4}]}]}
TEXTS = {"tables/ratings.csv": "who,value\nP001,3.0\n", "tests/a.csv": "F,p\n3.25,0.01\n"}


def texts(**changes):
    whole = json.loads(json.dumps(STATISTICS))
    whole["tests"][0]["results"][0].update(changes)
    return {"statistics.json": json.dumps(whole), **TEXTS}


@pytest.fixture
def committed(tmp_path):
    for name, text in texts().items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def test_the_same_is_the_same(committed):
    assert differences(texts(), committed) == []


def test_times_and_versions_are_free(committed):
    other = json.loads(texts()["statistics.json"])
    other["tests"][0]["seconds"] = 7.5
    other["software"] = {"numpy": "9"}
    assert differences({**TEXTS, "statistics.json": json.dumps(other)}, committed) == []


def test_what_outcomes_mean_is_compared_where_it_was_committed(committed):
    meant = json.loads(texts()["statistics.json"]) | {"outcomes": [{"name": "Hard", "low": "Hard", "high": "Soft"}]}
    now = {**TEXTS, "statistics.json": json.dumps(meant)}
    assert differences(now, committed) == []
    meant["outcomes"][0]["high"] = "Mild"
    (committed / "statistics.json").write_text(json.dumps(meant))
    (difference,) = differences(now, committed)
    assert difference.where == "outcomes[Hard].high" and (difference.committed, difference.found) == (
        '"Mild"',
        '"Soft"',
    )


@pytest.mark.parametrize("value", [3.25 * (1 + 5e-10), 3.25 * (1 - 5e-10)])
def test_a_number_may_differ_by_a_billionth(committed, value):
    assert differences(texts(F=value), committed) == []


@pytest.mark.parametrize("change", [{"F": 3.25 * (1 + 2e-9)}, {"p": None}, {"n": 5}, {"more": 1.0}, {"F": True}])
def test_more_is_reported_by_name(committed, change):
    (difference,) = differences(texts(**change), committed)
    assert difference.file == "statistics.json"
    assert difference.where.startswith("tests[a Hard].results[0].")


def test_a_tidy_table_is_compared_to_the_letter_and_a_test_by_number(committed):
    near = {**texts(), "tests/a.csv": "F,p\n3.2500000001,0.01\n"}
    assert differences(near, committed) == []
    other = {**texts(), "tables/ratings.csv": "who,value\nP001,3.0000000000001\n"}
    (difference,) = differences(other, committed)
    assert (difference.file, difference.where) == ("tables/ratings.csv", "line 2")


def test_files_that_come_or_go_are_reported(committed):
    remaining = {name: text for name, text in texts().items() if name != "tests/a.csv"}
    assert [difference.text() for difference in differences(remaining, committed)] == [
        "tests/a.csv: the file: committed present, found no longer written"
    ]
    assert [difference.found for difference in differences({**texts(), "tests/b.csv": "x\n"}, committed)] == [
        "made now"
    ]


def test_a_small_p_is_no_rounding_and_a_small_other_number_is(committed):
    for name, texts_of_p in (("tests/p.csv", "F,p\n3.0,{}\n"), ("tests/q.csv", 'outcome,F,p\n"a, b",3.0,{}\n')):
        (committed / name).write_text(texts_of_p.format("1e-14"))
        (difference,) = differences({**texts(), name: texts_of_p.format("2e-14")}, committed)
        assert difference.file == name
        assert differences({**texts(), name: texts_of_p.format("1.0000000001e-14")}, committed) == []
        (committed / name).unlink()
    (committed / "statistics.json").write_text(texts(p=1e-14, F=1e-14)["statistics.json"])
    assert [difference.where for difference in differences(texts(p=3e-14, F=3e-14), committed)] == [
        "tests[a Hard].results[0].p"
    ]


def test_a_result_called_seconds_is_a_result(committed):
    (committed / "statistics.json").write_text(texts(seconds=2.5)["statistics.json"])
    (difference,) = differences(texts(seconds=2.75), committed)
    assert difference.where == "tests[a Hard].results[0].seconds"


def test_a_listed_picture_that_is_gone_is_reported_and_anothers_table_is_not(committed):
    names = [*texts(), "figures/a.png", "report.html"]
    (committed / MARK).write_text(json.dumps({"files": names}))
    (committed / "report.html").touch()
    (committed / "tables" / "mine.csv").write_text("x\n")
    (difference,) = differences(texts(), committed)
    assert difference.text() == "figures/a.png: the file: committed listed, found not there"


def test_a_table_of_another_length_or_line_ending_is_reported(committed):
    assert differences({**texts(), "tests/a.csv": "F,p\n3.25,0.01\n1.0,0.5\n"}, committed)[0].where == "lines"
    (committed / "tables" / "ratings.csv").write_bytes(b"who,value\r\nP001,3.0\r\n")
    assert differences(texts(), committed)[0].where == "line endings"


def test_a_damaged_file_is_reported(committed):
    (committed / "statistics.json").write_text("{")
    assert "no JSON" in differences(texts(), committed)[0].committed


def test_nothing_committed_is_refused(tmp_path):
    with pytest.raises(NothingCommitted, match="regenerate once without --check"):
        differences(texts(), tmp_path)


def test_many_differences_are_counted(committed):
    many = {**texts(), **{f"tests/x{n}.csv": "a\n" for n in range(50)}}
    lines = difference_lines(differences(many, committed))
    assert len(lines) == 21
    assert lines[-1] == "... and 30 more"
