"""The report is one file that says all, reads nothing from outside, and holds no name as markup."""

import re
from html.parser import HTMLParser

import pytest

from palpate.analysis.ratings.dataset import Exclusion
from palpate.analysis.regenerating.page import left_out, parts_of, seconds_text
from tests.analysis.regenerating.small_lab import HOSTILE, TITLE, page_of, small_study

UNCLOSED = {"meta", "link", "br", "path", "use", "rect", "image", "circle"}


class Read(HTMLParser):
    """A page's elements, its attributes and the text that a person reads."""

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.attributes, self.words = [], [], [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in UNCLOSED:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"script", "style"} & set(self.open):
            self.words.append(data)

    @property
    def text(self):
        return "\n".join(self.words)


@pytest.fixture(scope="module")
def read(page):
    return Read(page)


def test_facts_come_first_then_figures_results_tests_data_and_provenance(page, read):
    places = [page.index(f'<section id="{name}"') for name in ("figures", "results", "tests", "data", "provenance")]
    assert [page.index('<dl class="facts">'), *places] == sorted([page.index('<dl class="facts">'), *places])
    assert read.open == []


def test_a_name_is_never_read_as_markup(page, read):
    assert read.tags.count("script") == 1
    assert "alert" not in page.split("<script>")[1].split("</script>")[0]
    assert "<i>hard" not in page and "<b>fast" not in page
    assert HOSTILE in read.text and TITLE in read.text
    assert any(value == HOSTILE for _, name, value in read.attributes if name == "data-key")


def test_a_page_reads_nothing_from_outside(read):
    addresses = [value for _, name, value in read.attributes if name in ("src", "href", "action", "xlink:href")]
    assert addresses and all(value.startswith(("#", "data:")) for value in addresses)
    (policy,) = [v for _, n, v in read.attributes if n == "content" and "default-src" in v]
    assert "default-src 'none'" in policy and "script-src 'sha256-" in policy and "unsafe-eval" not in policy


def test_no_number_is_nan_and_no_p_is_zero(read):
    assert re.findall(r"\b(?:nan|NaN|None|inf|-inf)\b", read.text) == []
    assert re.findall(r"p = 0?\.?0+(?!\d)", read.text) == []


def test_an_undefined_number_is_a_dash_that_says_why(page):
    table = page.split('id="test-levels"')[1].split("<h3")[0]
    row = next(line for line in table.splitlines() if line.startswith("<tr><td>Constant"))
    assert "<td>– ¹</td>" in row
    assert re.search(r'<p class="note">¹ F is undefined: the residual has no variation', table)


def test_what_was_refused_says_why(read):
    assert "Not answered: " in read.text
    assert read.text.count("no column 'no_such_column'") >= 2


def test_each_column_says_what_it_is(page, read):
    meanings = {value for tag, name, value in read.attributes if (tag, name) == ("th", "title")}
    assert "partial eta squared" in meanings
    assert "What the columns are" in read.text and "partial_eta_squared" in read.text
    assert ">η²p</th>" in page


def test_rows_in_another_order_give_the_same_page(page, tmp_path, monkeypatch):
    from tests.analysis.regenerating import small_lab

    whole = small_lab.small_set()
    other = whole.table.sample(frac=1.0, random_state=7).reset_index(drop=True)
    monkeypatch.setattr(small_lab, "small_set", lambda: small_lab.replace(whole, table=other))
    results = [text.split('<section id="results"')[1].split('<section id="data"')[0]
               for text in (page, page_of(small_study(tmp_path)))]  # fmt: skip
    assert results[0] == results[1]


def test_the_ledger_is_counted_by_reason():
    lines = [Exclusion("practice", f"P{n}", "practice trials do not count", 7) for n in range(16)]
    shown = left_out([Exclusion("nothing", "nobody", "a session must be whole", 0), *lines])
    assert list(shown.reasons.rows) == [
        ("a session must be whole", "met nothing", "0", "0"),
        ("practice trials do not count", "practice", "16", "112"),
    ]
    assert len(shown.lines.rows) == 16


def test_results_stand_below_each_other_but_brackets_stay_whole():
    assert parts_of("a: F = 1, p = .5; b: F = 2") == ("a: F = 1, p = .5;", "b: F = 2")
    assert parts_of("12 of 15 differ (p < .05; Holm; 15)") == ("12 of 15 differ (p < .05; Holm; 15)",)


@pytest.mark.parametrize(("seconds", "text"), [(0.01, "less than 0.1 s"), (1.26, "1.3 s"), (134.2, "134 s")])
def test_seconds_are_reported_with_the_digits_that_mean_something(seconds, text):
    assert seconds_text(seconds) == text
