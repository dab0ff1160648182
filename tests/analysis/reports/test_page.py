"""A page from blocks: every name is escaped, only our own script runs, long tables are folded."""

import base64
import hashlib
import re

import pytest

from palpate.analysis.reports.page import (
    EVALUATION,
    REGENERATED,
    SHORT_CAPTION,
    STILL,
    Caption,
    Column,
    FigureBlock,
    Folded,
    Heading,
    Page,
    Points,
    Preformatted,
    Section,
    Sentences,
    TableBlock,
    Words,
    bold,
    caption,
    fill_in,
    italic,
    long_table,
    page_html,
    table,
)  # fmt: skip
from palpate.analysis.reports.tables import Head, text_table

HOSTILE = "<script>alert(1)</script>"


def page(*blocks, look=EVALUATION, **parts):
    section = Section("part", "A part", blocks)
    return page_html(
        Page(**{"title": "T", "lead": "", "banners": (), "facts": (), "sections": (section,), **parts}), look
    )


@pytest.mark.parametrize("look", [STILL, REGENERATED, EVALUATION])
def test_a_name_is_never_read_as_markup_in_any_block(look):
    grid = text_table((HOSTILE, Head(HOSTILE, meaning=HOSTILE)), [(HOSTILE, HOSTILE)], [HOSTILE])
    html = page(
        Words(HOSTILE), Words(fill_in("{} and {}", italic(HOSTILE), HOSTILE)),
        Heading(HOSTILE, HOSTILE, HOSTILE, HOSTILE),
        Points(((HOSTILE, HOSTILE), (HOSTILE, (HOSTILE, HOSTILE)))), Sentences((HOSTILE,)), Preformatted(HOSTILE),
        TableBlock(grid, HOSTILE, HOSTILE), Folded(HOSTILE, (TableBlock(grid, HOSTILE, folded=True),), HOSTILE),
        FigureBlock(HOSTILE, HOSTILE, Caption(HOSTILE, HOSTILE), "", HOSTILE, (Words(HOSTILE),)),
        look=look, title=HOSTILE, lead=HOSTILE, banners=[HOSTILE], facts=[(HOSTILE, HOSTILE)],
    )  # fmt: skip
    assert "<script>alert" not in html and html.count("&lt;script&gt;alert(1)") > 30


def test_a_page_runs_no_script_or_the_one_that_its_policy_names():
    assert "<script" not in page(look=STILL) and "script-src" not in page(look=STILL)
    html = page(look=EVALUATION)
    (code,) = re.findall(r"<script>(.*?)</script>", html, re.S)
    assert f"'sha256-{base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()}'" in html


def test_a_long_table_is_folded_and_left_to_its_file_on_paper():
    rows = [(str(n),) for n in range(61)]
    assert long_table(text_table(("n",), rows[:12]), "All") == (TableBlock(text_table(("n",), rows[:12])),)
    (folded,) = long_table(text_table(("n",), rows[:60]), "All", "n.csv")
    assert isinstance(folded, Folded) and folded.look == ""
    folded, words = long_table(text_table(("n",), rows), "All", "n.csv")
    assert folded.look == "long" and words == Words("The 61 rows stand in n.csv.", "on-paper note")


def test_bold_and_braces_in_a_name_are_kept():
    assert str(fill_in("{} is not drawn: {}", bold("{a}"), "no {b}")) == "<b>{a}</b> is not drawn: no {b}"


def test_a_long_caption_is_opened_at_the_end_of_a_sentence():
    text = " ".join(f"Sentence {n} is p < .05 and e.g. this long." for n in range(20))
    parts = caption(text)
    assert len(parts.first) <= SHORT_CAPTION and parts.first.endswith(".") and f"{parts.first} {parts.rest}" == text
    assert caption("Short. One.").rest == ""


def test_the_least_error_stands_out_and_a_column_without_numbers_is_left_out():
    rows = [{"method": "a", "mae": 2.0, "none": None}, {"method": "b", "mae": 1.0, "none": None}]
    columns = [Column("method", "method"), Column("mae", "MAE", "2", better="low"), Column("none", "nothing", "2")]
    section = table("t", rows, columns, ours="a")
    assert section.table.emphasis.cells == {(1, 1)}
    assert section.table.emphasis.rows == {0}
    assert [head.name for head in section.table.heads] == ["method", "MAE"]
