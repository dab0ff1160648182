"""Tables for a manuscript: a Word file that Word's rules allow, and LaTeX in which no letter is read as a command."""

import io
import re
import zipfile
from dataclasses import replace

import pytest
from docx import Document
from docx.enum.section import WD_ORIENT
from docx.oxml.ns import qn

from palpate.analysis.regenerating.outputs import write_documents
from palpate.analysis.regenerating.page import numbered_tables
from palpate.analysis.reports.latex import LETTERS, escaped, latex_text
from palpate.analysis.reports.tables import Head, NumberedTable, table_letters, text_table
from palpate.analysis.reports.word import UPRIGHT, allowed, word_bytes
from tests.analysis.regenerating.small_lab import HOSTILE, TITLE

NARROW = text_table(("who", Head("F", "number")), [("P001", "2.50"), ("P002", "−0.10")])
WIDE = text_table([Head(f"value {n}", "number") for n in range(24)], [[f"{n}.25" for n in range(24)]] * 3)


def tables(*grids):
    return [NumberedTable(n, f"t{n}", f"Table of {n}", table, ("A note.",)) for n, table in enumerate(grids, start=1)]


def opened(content):
    return Document(io.BytesIO(content))


@pytest.fixture(scope="module")
def word(small, tmp_path_factory):
    return write_documents(small, tmp_path_factory.mktemp("documents"))


def test_word_holds_every_table_with_its_number_and_its_rows(small, word):
    document = opened(word[0].read_bytes())
    expected = list(numbered_tables(small))
    assert len(document.tables) == len(expected)
    for table, shown in zip(document.tables, expected, strict=True):
        assert [cell.text for cell in table.rows[0].cells] == [head.name for head in shown.table.heads]
        assert len(table.rows) == 1 + len(shown.table.rows) + len(shown.table.groups)
        assert [cell.text for cell in table.rows[-1].cells] == list(shown.table.rows[-1])
    assert document.paragraphs[0].text == TITLE
    assert any(HOSTILE in cell.text for cell in document.tables[0]._cells)
    fields = document.element.body.findall(f".//{qn('w:fldSimple')}")
    assert [field.get(qn("w:instr")) for field in fields] == [r" SEQ Table \* ARABIC "] * len(expected)
    numbers = ["".join(t.text for t in field.iter(qn("w:t"))) for field in fields]
    assert numbers == [str(n) for n in range(1, len(expected) + 1)]


def test_heads_are_repeated_and_rows_stay_whole(word):
    for table in opened(word[0].read_bytes()).tables:
        first, *rest = table._tbl.findall(qn("w:tr"))
        assert first.find(f"{qn('w:trPr')}/{qn('w:tblHeader')}") is not None
        assert all(row.find(f"{qn('w:trPr')}/{qn('w:cantSplit')}") is not None for row in (first, *rest))
        assert all(row.find(f"{qn('w:trPr')}/{qn('w:tblHeader')}") is None for row in rest)


def test_every_row_is_as_wide_as_its_table_and_every_cell_ends_in_a_paragraph(word):
    """What Word demands of a table, or it calls the file damaged."""
    for table in opened(word[0].read_bytes()).tables:
        columns = len(table._tbl.tblGrid.findall(qn("w:gridCol")))
        for row in table._tbl.findall(qn("w:tr")):
            cells = row.findall(qn("w:tc"))
            spans = [cell.find(f"{qn('w:tcPr')}/{qn('w:gridSpan')}") for cell in cells]
            assert sum(1 if span is None else int(span.get(qn("w:val"))) for span in spans) == columns
            assert all(cell[-1].tag == qn("w:p") for cell in cells)


def test_a_wide_table_lies_on_a_turned_page_and_the_next_one_stands_again():
    assert table_letters(WIDE) > UPRIGHT >= table_letters(NARROW)
    document = opened(word_bytes("T", "", tables(NARROW, WIDE, WIDE, NARROW)))
    turned = [section.orientation == WD_ORIENT.LANDSCAPE for section in document.sections]
    assert turned == [False, True, False]
    assert all(
        (section.page_width > section.page_height) == side
        for section, side in zip(document.sections, turned, strict=True)
    )
    order = [element.tag for element in document.element.body if element.tag == qn("w:tbl") or
             element.find(f"{qn('w:pPr')}/{qn('w:sectPr')}") is not None]  # fmt: skip
    assert [tag == qn("w:tbl") for tag in order] == [True, False, True, True, False, True]


def test_word_is_the_same_twice_and_has_no_hour(small, word, tmp_path):
    again = write_documents(small, tmp_path)
    assert [file.read_bytes() for file in again] == [file.read_bytes() for file in word]
    with zipfile.ZipFile(word[0]) as file:
        assert {entry.date_time for entry in file.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_word_takes_any_letters():
    strange = "\x00\x0b\ufffe a & b < c > \"d\" 'e' 가 𝔸"
    table = text_table((strange, "b"), [(strange, "")])
    document = opened(word_bytes(strange, "", [NumberedTable(1, "t", strange, table, (strange,))]))
    assert document.tables[0].rows[1].cells[0].text == allowed(strange)


def test_latex_reads_no_letter_as_a_command():
    assert escaped("a & b_1 {c} 100 % $x^2$ #1 ~ \\b") == (
        r"a \& b\_1 \{c\} 100 \% \$x\textasciicircum{}2\$ \#1 \textasciitilde{} \textbackslash{}b"
    )
    assert escaped("--[x]*") == "-{}-{}{[}x{]}{*}"
    assert escaped("a\nb\tc\x07") == "a b c"
    assert escaped("η² = −.5, p ≤ .05 ¹²") == r"$\eta$$^2$ = $\relax-$.5, p $\leq$ .05 $^1$$^2$"


def test_latex_has_the_parts_of_every_table(small, word):
    text = word[1].read_text(encoding="utf-8")
    expected = list(numbered_tables(small))
    for name in ("begin{longtable}", "end{longtable}", "endfirsthead", "endhead", "endfoot", "caption"):
        assert text.count(f"\\{name}") == len(expected)
    labels = re.findall(r"\\label\{tab:([^}]*)\}", text)
    assert len(set(labels)) == len(expected)
    assert text.count(r"\begin{landscape}") == text.count(r"\end{landscape}")
    body = [line for line in text.splitlines() if line.endswith(r" \\") and " & " in line]
    rows = sum(len(shown.table.rows) + 2 for shown in expected if len(shown.table.heads) > 1)
    assert len(body) == rows
    assert "<script>" not in text


def test_braces_and_dollars_are_balanced_whatever_the_names(small, word):
    for text in (
        word[1].read_text(encoding="utf-8"),
        latex_text(HOSTILE, "", tables(text_table((HOSTILE, "{"), [("}", "$")]))),
    ):
        bare = re.sub(r"\\[\\{}$&%#_]", "", text)
        depth = 0
        for letter in bare:
            depth += {"{": 1, "}": -1}.get(letter, 0)
            assert depth >= 0
        assert depth == 0 and bare.count("$") % 2 == 0


def test_every_letter_that_tex_reads_otherwise_is_replaced():
    assert set("\\&%$#_{}~^<>|\"`'-[]*") <= set(LETTERS)


def test_letters_beyond_pdflatex_are_named():
    table = text_table(("word", "n"), [("부드러운", "3")])
    assert "% Holds letters that pdflatex does not know (lualatex does): 드 러 부 운" in latex_text(
        "T", "", tables(table)
    )
    assert "lualatex" not in latex_text("T", "", tables(NARROW))


def test_a_test_without_an_answer_is_still_a_table(small):
    refused = replace(
        small, answered=tuple(answered for answered in small.answered if answered.settings.name == "refused")
    )
    (table,) = numbered_tables(refused)
    assert "no_such_column" in " ".join(table.notes)
    assert opened(word_bytes("T", "", [table])).tables and latex_text("T", "", [table])
