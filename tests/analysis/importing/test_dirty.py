"""Property: however a clean table was written, the import gives that table; what is not clean is refused by name."""

from __future__ import annotations

import tempfile
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.importing.dialects import TableRefused, read_sheet
from palpate.analysis.importing.number_texts import NoNumber, number
from palpate.analysis.ratings.rating_files import load_ratings, save_ratings
from tests.analysis.tables_for_tests import Foreign, Record, imported
from tests.examples import examples

AWKWARD = ("None", "null", "NULL", "nan", "N/A", "True", "1", "01", "1e3", "é", "Größe", "a,b", "a;b", 'say "hm"', "-")
texts = st.one_of(
    st.sampled_from(AWKWARD),
    st.text(st.characters(codec="cp1252", exclude_categories=("Cc", "Cs")), min_size=1, max_size=6),
).filter(lambda text: text == text.strip() and text not in ("", "NA", "NaN"))
# Three decimals or more would make a comma doubtful; that has its own test.
values = st.one_of(
    st.integers(-10, 10).map(str),
    st.integers(-1000, 1000).map(lambda n: f"{n / 100:.2f}"),
    st.sampled_from(["0.1", "-0.0", "1e9", "1000000000.25", "2.50E-3", "+3.5"]),
)


@st.composite
def clean_tables(draw: st.DrawFn) -> Foreign:
    people, items, cars = (draw(st.lists(texts, min_size=2, max_size=3, unique=True)) for _ in range(3))
    records = [(*cell, draw(values)) for cell in product(people, items, cars)]
    return Foreign(tuple(records))


@st.composite
def dirt(draw: st.DrawFn) -> dict[str, object]:
    delimiter = draw(st.sampled_from([",", ";", "\t", "|"]))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "cp1252", "utf-16"]))
    note = draw(st.sampled_from([None, "two\nlines; and, a\r\nthird", 'a "quote"']))
    return {
        "delimiter": delimiter,
        "decimal": draw(st.sampled_from([".", ","])),
        "line_end": draw(st.sampled_from(["\n", "\r\n", "\r"])),
        "encoding": encoding,
        "note": note,
        "trailing": draw(st.booleans()),
        "row_numbers": draw(st.booleans()),
        "blank_lines": draw(st.booleans()),
        "empty_rows": draw(st.integers(0, 2)),
        "sep_line": draw(st.booleans()),
        "quoted": draw(st.booleans()),
        "map_keys": {} if encoding.startswith("utf-8") else {"encoding": encoding},
    }


@given(table=clean_tables(), dirty=dirt())
@settings(max_examples=examples(150), deadline=None)
def test_dirt_does_not_change_the_table(table: Foreign, dirty: dict[str, object]) -> None:
    with tempfile.TemporaryDirectory() as name:
        ratings = imported(Path(name), table.also(**dirty))
        rows = [tuple(row) for row in ratings.table[["participant", "attribute", "car", "value"]].values.tolist()]
        assert rows == [(*labels, float(value)) for *labels, value in table.records]
        assert all(type(label) is str for row in rows for label in row[:3])
        assert sum(line.rows for line in ratings.exclusions) == dirty["empty_rows"]
        save_ratings(ratings, Path(name) / "saved")
        again = load_ratings(Path(name) / "saved")
        assert again.table.equals(ratings.table)
        assert [str(v) for v in again.table["value"]] == [str(v) for v in ratings.table["value"]]


@given(table=clean_tables(), data=st.data())
@settings(max_examples=examples(60), deadline=None)
def test_a_bad_value_anywhere_is_refused_with_its_line(table: Foreign, data: st.DataObject) -> None:
    row = data.draw(st.integers(0, len(table.records) - 1))
    bad = data.draw(st.sampled_from(sorted(REFUSED_VALUES)))
    with tempfile.TemporaryDirectory() as name, pytest.raises(TableRefused) as refusal:
        imported(Path(name), with_value(table, row, bad), decimal=".")
    assert f"table.csv: line {row + 2}" in str(refusal.value)
    assert REFUSED_VALUES[bad] in str(refusal.value)


REFUSED_VALUES = {
    "": "1 missing value ",
    "NA": "1 missing value ",
    "NaN": "1 missing value ",
    "nan": "not finite",
    "inf": "not finite",
    "-Infinity": "not finite",
    "1e999": "too large",
    "1e-999": "too small",
    "1,5": "written with ',' where the decimal mark is '.'",
    "1.234.567": "thousands separators",
    "1,234.5": "thousands separators",
    "1 234": "thousands separators",
    "1'234": "thousands separators",
    "1_000": "thousands separators",
    " 5": "say trim: true",
    "\t": "the cell is empty",
    "five": "no number",
    "5 cm": "a number with a unit",
    "٣": "digits of another script",
    "0x1f": "a hexadecimal number",
    "None": "no number",
}


def with_value(table: Foreign, row: int, value: str) -> Foreign:
    records = list(table.records)
    records[row] = (*records[row][:3], value)
    return table.also(records=tuple(records))


@given(table=clean_tables(), data=st.data())
@settings(max_examples=examples(40), deadline=None)
def test_a_repeated_row_is_refused_with_both_lines(table: Foreign, data: st.DataObject) -> None:
    row = data.draw(st.integers(0, len(table.records) - 1))
    doubled = table.also(records=(*table.records, table.records[row]))
    with tempfile.TemporaryDirectory() as name, pytest.raises(TableRefused) as refusal:
        imported(Path(name), doubled)
    assert "1 cell holds several ratings" in str(refusal.value)
    assert f"line {row + 2} " in str(refusal.value)
    assert f"line {len(table.records) + 2} " in str(refusal.value)


@given(table=clean_tables(), data=st.data())
@settings(max_examples=examples(40), deadline=None)
def test_a_row_with_a_cell_too_few_or_too_many_is_refused_with_its_line(table: Foreign, data: st.DataObject) -> None:
    row = data.draw(st.integers(0, len(table.records) - 1))
    records: list[tuple[str, ...]] = list(table.records)
    records[row] = data.draw(st.sampled_from([records[row][:3], (*records[row], "x")]))
    with tempfile.TemporaryDirectory() as name, pytest.raises(TableRefused) as refusal:
        imported(Path(name), table.also(records=tuple(records), quoted=True))
    assert f"line {row + 2} has {len(records[row])}" in str(refusal.value)


def test_a_level_named_none_stays_a_level(tmp_path: Path) -> None:
    records: tuple[Record, ...] = (("None", "soft", "None", "1"), ("P2", "soft", "None", "2"))
    ratings = imported(tmp_path, Foreign(records))
    assert ratings.participants == ("None", "P2")
    assert ratings.levels("car") == ("None",)
    with pytest.raises(TableRefused, match=r"line 2: 'who' is 'None', which means missing"):
        imported(tmp_path, Foreign(records), missing=["", "None"])


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("0x10", "a hexadecimal number"), ("45%", "a percentage"), ("04.Mrz", "a date"), ("4-Mar", "a date"),
        ("2026-03-04", "a date"), ("3월4일", "a date"), ("\u0663", "digits of another script"),
        ("45 mm", "with a unit"), ("?", "only if nothing was rated there"), ("\u22123", "another minus sign"),
        ("=A1+1", "a formula"), ("#DIV/0!", "a spreadsheet's formula error"), ("#N/A", "a spreadsheet's formula error"),
        ("12:30", "a time"), (">5", "a bound"), ("~ 7", "a bound"), ("5?", "a guess"), ("$5", "with a unit"),
        ("\u00bd", "a fraction"), ("5/7", "a fraction"), ("3-4", "a range"), ("TRUE", "as 1 and 0"),
    ],
)  # fmt: skip
def test_each_kind_of_cell_that_is_no_number_has_its_own_advice(text, advice):
    with pytest.raises(NoNumber, match=advice):
        number(text, ".")


@pytest.mark.parametrize(
    ("data", "encoding", "message"),
    [
        (b"PK\x03\x04rest", "utf-8-sig", "is a workbook .*; open it .* save it as CSV in UTF-8"),
        (b'{"who": 1}', "utf-8-sig", "is a JSON file"),
        (b"\x89PNG\r\n\x1a\n", "utf-8-sig", "is a picture"),
        (b"$FL2@(#) SPSS", "utf-8-sig", "is an SPSS file"),
        ("who,v\nJörg,1\n".encode("utf-16-le"), "utf-8-sig", "encoding: utf-16"),
        ("who,v\nJörg,1\n".encode("cp1252"), "utf-8-sig", "encoding: cp1252 or latin-1"),
        (bytes(range(256)), "utf-8-sig", "no other encoding reads it either: open it"),
    ],
)
def test_what_a_file_is_decides_the_advice(tmp_path, data, encoding, message):
    path = tmp_path / "table.csv"
    path.write_bytes(data)
    with pytest.raises(TableRefused, match=message):
        read_sheet(path, "table.csv", encodings=[encoding], delimiter=None, required=["who"], trim=False)
