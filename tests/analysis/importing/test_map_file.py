"""What a column map can say, and what is refused where it says nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from palpate.analysis.importing.dialects import TableRefused
from palpate.analysis.importing.map_file import MapRefused, read_map
from palpate.analysis.importing.tables import import_table
from palpate.analysis.ratings.dataset import Crossing, Exclusion, Scale
from palpate.analysis.ratings.design import check_ratings
from tests.analysis.tables_for_tests import COLUMNS, Foreign, imported, write_map

CLEAN = "who,item,car,score\nP1,soft,K3,1\nP1,soft,K8,2\nP2,soft,K3,3\nP2,soft,K8,4\n"


def values(ratings: Any) -> list[float]:
    listed: list[float] = ratings.table["value"].tolist()
    return listed


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "the file is empty"),
        ("\n\n", "holds only blank lines"),
        ("who,item,car,score\n", "no row is a rating"),
        ("who,item,car,score,who\nP1,a,b,1,P1\n", "the column 'who' stands 2 times"),
        ("who,item,car,scores\nP1,a,b,1\n", "no column 'score' among 4 .*did you mean 'scores'"),
        ("who:item:car:score\nP1:a:b:1\n", "no column 'who' among 1"),
        (CLEAN + "P3,soft,K3,1,5\n", "line 6 has 5; an unquoted decimal comma"),
        (CLEAN.replace("\n", ",\n").replace("score,", "score"), "all rows end with a ','"),
        ("who,item,car,score,\nP1,soft,K3,1,5\n", "line 2: '5' is in column 5, which has no name"),
        (CLEAN + '"P3,soft,K3,1\n', "line 6: .*is a quote not closed"),
        (CLEAN + '"P3"x,soft,K3,1\n', "line 6: .*is a quote not closed"),
        (CLEAN + "P3,,K3,1\n", "line 6: 'item' is '', which means missing"),
        (CLEAN + "P3,soft,K3 ,1\n", "line 6: 'car' is 'K3 ': blanks around it; say trim: true"),
        (CLEAN + "NA,soft,K3,1\n", "line 6: 'who' is 'NA', which means missing"),
    ],
)
def test_a_table_that_is_no_clean_table_is_refused_by_name(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(TableRefused, match=reason):
        imported(tmp_path, text)


@pytest.mark.parametrize(
    ("data", "keys", "reason"),
    [
        (CLEAN.encode().replace(b"K3", b"caf\xe9"), {}, r"line 2: byte 0xe9 \(byte 31 of the file\).*cp1252"),
        (b"\xef\xbb\xbf" + CLEAN.encode(), {"encoding": "cp1252"}, "the mark of UTF-8, not of cp1252"),
        (CLEAN.encode("utf-16"), {"encoding": "latin-1"}, "the mark of UTF-16"),
        (CLEAN.encode("utf-16"), {"encoding": "utf-8"}, "byte 0xff .byte 1 of the file. is not utf-8"),
        (CLEAN.encode("utf-16-le"), {}, "NUL characters as utf-8-sig; .*encoding: utf-16"),
    ],
)
def test_an_encoding_is_never_guessed(tmp_path: Path, data: bytes, keys: dict[str, Any], reason: str) -> None:
    with pytest.raises(TableRefused, match=reason):
        imported(tmp_path, data, **keys)


def test_several_encodings_are_tried_in_the_declared_order_and_the_report_says_which(tmp_path: Path) -> None:
    ratings = imported(tmp_path, CLEAN.encode().replace(b"K3", b"caf\xe9"), encoding=["utf-8-sig", "cp1252"])
    assert ratings.levels("car") == ("café", "K8")[::-1]
    assert ratings.inputs[1].note == "4 rows, cp1252, delimiter ','"


@pytest.mark.parametrize(
    ("scores", "delimiter", "expected"),
    [
        (["1,5", "2,25", "3", "1,234"], ";", [1.5, 2.25, 3.0, 1.234]),
        (["1.5", "2.25", "3", "1.234"], ";", [1.5, 2.25, 3.0, 1.234]),
        (["1.234", "2.345", "3.456", "4.567"], ",", [1.234, 2.345, 3.456, 4.567]),
        (["0,123", "0,5", "1", "2"], "\t", [0.123, 0.5, 1.0, 2.0]),
    ],
)
def test_the_decimal_mark_is_found_where_it_cannot_be_mistaken(
    tmp_path: Path, scores: list[str], delimiter: str, expected: list[float]
) -> None:
    assert values(imported(tmp_path, _scored(scores, delimiter))) == expected


@pytest.mark.parametrize(
    ("scores", "delimiter", "reason"),
    [
        (["1,234", "2", "3", "4"], ";", "'1,234' can be a thousand or a fraction"),
        (["1.234", "2", "3", "4"], ";", "'1.234' can be a thousand or a fraction"),
        (["1,234", "2", "3", "4"], ",", "'1,234' can be a thousand or a fraction"),
        (["1.5", "2,5", "3", "4"], ";", "'1.5' and '2,5' are in one column"),
        (["1.234,5", "2", "3", "4"], ";", "thousands separators"),
    ],
)
def test_a_decimal_mark_that_can_be_mistaken_is_requested(
    tmp_path: Path, scores: list[str], delimiter: str, reason: str
) -> None:
    with pytest.raises(TableRefused, match=reason):
        imported(tmp_path, _scored(scores, delimiter))


def test_the_decimal_mark_that_the_map_says_decides(tmp_path: Path) -> None:
    scores = ["1,234", "2", "3", "4"]
    assert values(imported(tmp_path, _scored(scores, ";"), decimal=","))[0] == 1.234
    with pytest.raises(TableRefused, match=r"line 2: 'score' is '1,234': written with ',' where"):
        imported(tmp_path, _scored(scores, ";"), decimal=".")


def _scored(scores: list[str], delimiter: str) -> Foreign:
    cells = [("P1", "K3"), ("P1", "K8"), ("P2", "K3"), ("P2", "K8")]
    records = [(who, "soft", car, score) for (who, car), score in zip(cells, scores, strict=True)]
    return Foreign(tuple(records), delimiter=delimiter)


def test_missing_values_are_dropped_only_on_request_and_then_counted(tmp_path: Path) -> None:
    holed = CLEAN.replace("K8,2", "K8,").replace("K3,3", "K3,-99")
    with pytest.raises(
        TableRefused, match=r"2 missing values in 'score': table.csv: line 3 '', table.csv: line 4 '-99'"
    ):
        imported(tmp_path, holed, missing=["", "-99"])
    ratings = imported(tmp_path, holed, missing=["", "-99"], missing_value="drop")
    assert values(ratings) == [1.0, 4.0]
    assert ratings.exclusions == (Exclusion("rows", "P1", "no value", 1), Exclusion("rows", "P2", "no value", 1))
    missing = check_ratings(ratings).of("missing")
    assert missing is not None and missing.count == 2


def test_duplicates_are_settled_only_as_declared(tmp_path: Path) -> None:
    doubled = CLEAN + "P1,soft,K8,4\nP1,soft,K8,6\n"
    with pytest.raises(TableRefused, match=r"line 3 \(2\), table.csv: line 6 \(4\), table.csv: line 7 \(6\)"):
        imported(tmp_path, doubled)
    scale = {"from": 0, "to": 10, "step": 1}
    mean = imported(tmp_path, doubled, duplicates="mean", scale=scale)
    assert values(mean) == [1.0, 4.0, 3.0, 4.0]
    assert mean.scale == Scale(0, 10), "a mean may stand between the steps"
    assert mean.exclusions == (Exclusion("averaged", "P1", "3 ratings averaged into 1 cell", 3, 1),)
    first = imported(tmp_path, doubled, duplicates="first", scale=scale)
    assert values(first) == [1.0, 2.0, 3.0, 4.0]
    assert first.scale == Scale(0, 10, 1)
    assert first.exclusions == (Exclusion("repeated", "P1", "not the first rating of its cell (1 cell)", 2),)


def test_a_kept_column_is_not_averaged_away(tmp_path: Path) -> None:
    text = "who,item,car,score,hand\nP1,soft,K3,1,left\nP1,soft,K3,2,right\n"
    with pytest.raises(TableRefused, match="leave 'hand' out of keep"):
        imported(tmp_path, text, duplicates="mean", columns={**COLUMNS, "keep": ["hand"]})


def test_items_of_one_cell_are_distinguished_by_the_stimulus(tmp_path: Path) -> None:
    text = "who,item,car,score,door\nP1,soft,K3,1,left\nP1,soft,K3,2,right\nP2,soft,K3,1,left\nP2,soft,K3,2,right\n"
    ratings = imported(tmp_path, text, columns={**COLUMNS, "stimulus": "door"})
    assert len(ratings.table) == 4
    assert check_ratings(ratings).ok


def test_a_value_off_the_scale_is_refused_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(TableRefused, match=r"1 value is not on the scale from 1 to 3: table.csv: line 5 4;"):
        imported(tmp_path, CLEAN, scale={"from": 1, "to": 3})
    with pytest.raises(TableRefused, match=r"2 values are not on the scale from 0 to 10 in steps of 2"):
        imported(tmp_path, CLEAN, scale={"from": 0, "to": 10, "step": 2})


def test_rows_are_chosen_by_conditions_and_the_others_counted(tmp_path: Path) -> None:
    text = (
        "who,item,car,score,phase,rt\nP1,soft,K3,9,try,1\nP1,soft,K3,1,main,1\nP2,soft,K3,2,main,1\nP2,soft,K8,,main,\n"
    )
    where = {"phase": {"is": ["main"]}, "rt": {"not_empty": True}}
    ratings = imported(tmp_path, text, where=where)
    assert values(ratings) == [1.0, 2.0]
    assert ratings.exclusions == (
        Exclusion("rows", "table.csv", "phase is not 'main'", 1),
        Exclusion("rows", "table.csv", "rt is empty", 1),
    )
    with pytest.raises(TableRefused, match="no row has 'mian' in 'phase'; did you mean 'main'"):
        imported(tmp_path, text, where={"phase": {"is": ["mian"]}})


def test_levels_are_renamed_ordered_and_the_others_refused(tmp_path: Path) -> None:
    columns = {**COLUMNS, "within": {"car": {"column": "car", "levels": {"K8": "big", "K3": "small"}}}}
    ratings = imported(tmp_path, CLEAN, columns=columns)
    assert ratings.levels("car") == ("big", "small")
    assert ratings.crossings == (Crossing({}, {"car": ("big", "small")}),)
    columns["within"] = {"car": {"column": "car", "levels": ["K8", "K33"]}}
    with pytest.raises(TableRefused, match="line 2: 'K3' is not a level of 'car'; did you mean 'K33'"):
        imported(tmp_path, CLEAN, columns=columns)


def test_a_declared_level_that_nobody_rated_is_missing(tmp_path: Path) -> None:
    columns = {**COLUMNS, "within": {"car": {"column": "car", "levels": ["K3", "K8", "MQ4"]}}}
    missing = check_ratings(imported(tmp_path, CLEAN, columns=columns)).of("missing")
    assert missing is not None and missing.count == 2


def test_a_participant_is_in_one_group(tmp_path: Path) -> None:
    text = CLEAN.replace("score", "score,sex").replace(",1\n", ",1,f\n").replace(",2\n", ",2,f\n")
    text = text.replace(",3\n", ",3,m\n").replace(",4\n", ",4,m\n")
    columns = {**COLUMNS, "between": {"sex": "sex"}}
    ratings = imported(tmp_path, text, columns=columns)
    assert ratings.between == ("sex",)
    assert check_ratings(ratings).ok
    with pytest.raises(TableRefused, match=r"line 5: participant 'P2' is 'f' in 'sex', but 'm' at table.csv: line 4"):
        imported(tmp_path, text.replace("4,m", "4,f"), columns=columns)


def test_a_row_in_two_loops_at_once_is_refused(tmp_path: Path) -> None:
    text = "who,score,pre.n,post.n\nP1,1,0,\nP1,2,,0\nP2,3,0,0\n"
    columns = {"participant": "who", "value": "score", "attribute_is": "soft"}
    with pytest.raises(TableRefused, match="line 4: the row belongs to pre and post of 'phase' at once"):
        imported(tmp_path, text, columns=columns, loop={"phase": {"pre": "pre.n", "post": "post.n"}})


def test_trimming_is_done_only_on_request(tmp_path: Path) -> None:
    padded = CLEAN.replace(",", " , ")
    with pytest.raises(TableRefused):
        imported(tmp_path, padded)
    assert imported(tmp_path, padded, trim=True).table.equals(imported(tmp_path, CLEAN).table)


def test_files_are_taken_in_natural_order_from_the_folder_that_is_named(tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir()
    for number in (10, 2, 1):
        (data / f"{number}.csv").write_text(f"who,item,car,score\nP{number},soft,K3,{number}\n")
    ratings = import_table(write_map(tmp_path, files="*.csv"), data)
    assert [source.name for source in ratings.inputs] == ["map.yaml", "1.csv", "2.csv", "10.csv"]
    assert values(ratings) == [1.0, 2.0, 10.0]
    assert values(import_table(write_map(tmp_path, files="*.csv"), data / "2.csv")) == [2.0]
    with pytest.raises(TableRefused, match=r"no file matches '\*\.txt'; the folder holds: 1\.csv"):
        import_table(write_map(tmp_path, files="*.txt"), data)
    with pytest.raises(TableRefused, match="no such file or folder"):
        import_table(write_map(tmp_path), tmp_path / "elsewhere")


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ({"colums": COLUMNS}, "colums: unknown key; did you mean 'columns'"),
        ({"columns": {**COLUMNS, "particpant": "x"}}, "columns.particpant: unknown key; did you mean 'participant'"),
        ({"columns": {**COLUMNS, "within": {"car": {"column": "car", "level": ["a"]}}}}, "did you mean 'levels'"),
        ({"columns": {**COLUMNS, "attribute_is": "soft"}}, "either attribute .* or attribute_is"),
        ({"columns": {"participant": "who", "value": "score"}}, "either attribute .* or attribute_is"),
        ({"columns": {**COLUMNS, "within": {"value": "car"}}}, "within: the name 'value' has a special meaning"),
        ({"columns": {**COLUMNS, "within": {"car": {"column": "car", "contains": {"a": "b"}}}}}, "under between"),
        ({"columns": None}, "columns: this key is required"),
        ({"name": "../elsewhere"}, "a name of letters, digits"),
        ({"files": "/etc/table.csv"}, "a path relative to the map"),
        ({"files": []}, "at least 1 item"),
        ({"format": "wide"}, "found 'wide', input should be 'long' or 'psychopy'"),
        ({"encoding": "utf-9"}, "'utf-9' is not an encoding"),
        ({"encoding": "hex"}, "'hex' is not an encoding"),
        ({"decimal": ";"}, "found ';', input should be '.' or ','"),
        ({"scale": {"from": 10, "to": 1}}, "the first end must be the lower one"),
        ({"scale": {"from": 1, "top": 10}}, "scale.top: unknown key; did you mean 'to'"),
        ({"where": {"car": {"is": ["K3"], "not_empty": True}}}, "either is: .* or not_empty"),
        ({"where": {"car": {"is": [1.5]}}}, "found 1.5, input should be a valid string"),
        ({"duplicates": "median"}, "input should be 'refuse', 'mean' or 'first'"),
    ],
)
def test_a_mistake_in_the_map_is_named_with_its_key(tmp_path: Path, keys: dict[str, Any], reason: str) -> None:
    with pytest.raises(MapRefused, match=reason) as refusal:
        read_map(write_map(tmp_path, **keys))
    assert str(refusal.value).startswith("map.yaml: ")


def test_a_mistake_in_the_map_is_named_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "map.yaml"
    path.write_text("name: x\nfiles: a.csv\ncolumns:\n  participant: who\n  value: score\n  atribute: item\n")
    with pytest.raises(MapRefused, match=r"map.yaml: line 6: columns.atribute: unknown key; did you mean 'attribute'"):
        read_map(path)
    path.write_text("name: x\nname: y\n")
    with pytest.raises(MapRefused, match="line 2: the key 'name' appears twice"):
        read_map(path)
    path.write_text("- a\n")
    with pytest.raises(MapRefused, match="keys and values are expected"):
        read_map(path)


def test_antonyms_and_categories_name_attributes_of_the_table(tmp_path: Path) -> None:
    ratings = imported(tmp_path, CLEAN, antonyms={"soft": "hard"}, categories={"soft": "physical"})
    assert (ratings.antonyms, ratings.categories) == ({"soft": "hard"}, {"soft": "physical"})
    with pytest.raises(MapRefused, match="antonyms: 'Soft' is not an attribute of the table; did you mean 'soft'"):
        imported(tmp_path, CLEAN, antonyms={"Soft": "Hard"})
