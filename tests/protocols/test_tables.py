"""The one reader of tables: encodings, delimiters, decimal commas, gaps, and a line in every message."""

import math
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.protocols.tables import (
    DELIMITERS,
    RecordError,
    TableError,
    TableFormat,
    commonest_delimiter,
    has_text,
    read_lines,
    read_table,
    split_line,
    split_records,
    table_text,
)

PLAIN = TableFormat()
EVERYTHING = TableFormat(
    encodings=("utf-16", "utf-8-sig", "cp1252"), delimiters=DELIMITERS, strip=True, blank_above=True, counted=has_text
)


@pytest.fixture
def table(tmp_path):
    """Write a table and open it."""

    def opened(content, columns=(), layout=PLAIN):
        path = tmp_path / "table.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_table(path, columns, layout)

    return opened


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("delimiter", DELIMITERS)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_numbers_are_the_same_however_they_are_written(table, encoding, delimiter, end):
    point = "." if delimiter == "," else ","
    rows = ["", " Kraft °,a ".replace(",", delimiter), "", f"1{point}5{delimiter}-2e3", f'"3"{delimiter} 4 ', " "]
    read = table(end.join(rows).encode(encoding), ("a", "Kraft °"), EVERYTHING).numbers(("a", "Kraft °"))
    assert {name: column.tolist() for name, column in read.items()} == {"a": [-2000.0, 4.0], "Kraft °": [1.5, 3.0]}


def test_rows_are_texts_by_name_with_the_last_line_of_each(table):
    rows = list(table('id,text\n\na,"two\nlines"\nb, \n', ("id",)).rows())
    assert [(row.line, dict(row.cells)) for row in rows] == [
        (4, {"id": "a", "text": "two\nlines"}),
        (5, {"id": "b", "text": " "}),
    ]
    assert rows[0].where.endswith("table.csv, line 4") and rows[0]["id"] == "a"


def test_gaps_are_nan_and_every_row_has_its_line(table):
    opened = table("t,x\n0,1\n\n1,\n2\n3,nan\n")
    read = opened.numbers(("t", "x"), gaps=True, finite=False)
    assert read["t"].tolist() == [0, 1, 2, 3] and [math.isnan(x) for x in read["x"]] == [False, True, True, True]
    assert opened.lines.tolist() == [2, 4, 5, 6]


def test_a_mistake_far_down_is_reported_with_its_line_and_column(table):
    lines = [f"{number},{number}" for number in range(5000)]
    lines[3000] = "1,inf"
    content = "\n".join(["t,x", *lines]) + "\n"
    with pytest.raises(TableError, match=r"line 3002: x is 'inf', a finite number"):
        table(content).numbers(("t", "x"))
    assert math.isinf(table(content).numbers(("x",), finite=False)["x"][3000])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", r"no column 'x'; found an empty file"),
        (b"t,X\n", r"no column 'x'; found t, X"),
        (b"t,x\n1,\xe9\n", r"not a text file in UTF-8 \(invalid continuation byte\)"),
        (b"t,x\n1,soon\n", r"line 2: x is 'soon', a finite number"),
        (b"t,x\n1,2\n3\n", r"line 3: x is '', a finite number"),
        (b't,x\n1,"2"3\n', r"line 2: ',' expected after '\"'"),
    ],
)
def test_what_cannot_be_read_is_refused(table, content, message):
    with pytest.raises(TableError, match=message):
        table(content, ("x",), TableFormat(strict=True)).numbers(("x",))


def test_a_row_of_another_width_and_a_number_of_a_row_are_refused(table):
    with pytest.raises(TableError, match="line 2: 3 cells, 2 columns are expected"):
        list(table("a,b\n1,2,3\n").rows())
    (row,) = table("a,b\n1,x\n").rows()
    assert row.number("a") == 1
    with pytest.raises(TableError, match="line 2: b is 'x', a finite number is expected"):
        row.number("b")


def test_a_format_has_its_own_error_and_words(table, tmp_path):
    mine = TableFormat(
        error=LookupError, twice=lambda wrong: f"{wrong.column} twice", unreadable=lambda wrong: f"no: {wrong.reason}"
    )
    with pytest.raises(LookupError, match="a twice"):
        table("a,a\n", ("a",), mine)
    with pytest.raises(LookupError, match="no: No such file or directory"):
        read_table(tmp_path / "none.csv", (), mine)
    with pytest.raises(FileNotFoundError):
        read_table(tmp_path / "none.csv", (), TableFormat(unreadable=None))


def test_of_two_columns_of_one_name_the_last_counts_unless_refused(table):
    assert table("a,a\n1,2\n", ("a",)).numbers(("a", "a"))["a"].tolist() == [2]


def test_records_know_where_they_begin_and_end():
    assert [(record.first, record.line) for record in split_records(['a,"b\n', 'c"\n', "\n", "d\n"])] == [
        (1, 2), (3, 3), (4, 4)
    ]  # fmt: skip
    with pytest.raises(RecordError) as refused:
        list(split_records(["a\n", '"b\n', "c\n"], strict=True))
    assert (refused.value.first, refused.value.line) == (2, 3)


def test_the_commonest_delimiter_is_taken_and_the_first_where_there_is_none():
    assert [commonest_delimiter(line) for line in ("a;b,c;d", "a\tb", "a")] == [";", "\t", ","]


def test_what_is_written_reads_back(tmp_path):
    texts = [["id", 'a "b", c'], ["1", "two\nlines"], ["", "e\u0301"]]
    (tmp_path / "t.csv").write_text(table_text(texts[0], texts[1:]), encoding="utf-8", newline="")
    table = read_table(tmp_path / "t.csv")
    assert [table.header, *table.records()] == texts
    assert read_lines(tmp_path / "t.csv")[-1] == ",e\u0301" and split_line('"a,b",c') == ["a,b", "c"]


def test_tables_are_read_without_numpy():
    code = "import sys, palpate.protocols.tables; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[2], check=False).returncode == 0
