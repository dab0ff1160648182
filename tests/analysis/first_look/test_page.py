"""The report needs nothing but itself, runs nothing that a name says, and is the same twice."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from palpate.analysis.first_look.analysis import Analysis, analyse_ratings
from palpate.analysis.first_look.page import report_html, save_figures, write_report
from palpate.analysis.first_look.results import statistics_json, write_results
from palpate.analysis.ratings.dataset import Exclusion, Input
from palpate.analysis.ratings.describe import describe
from palpate.analysis.reports.csv_files import csv_text
from palpate.analysis.reports.tables import fixed, p_cell, share
from palpate.protocols.wording import count, phrase
from tests.analysis.synthetic_ratings import door_ratings, reasoning, renamed

EVIL = "<script>alert('x')</script>\"&"


class Reader(HTMLParser):
    """The tags, attributes and texts of a page."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        if not self.tags or self.tags[-1][0] != "style":
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).split())


@pytest.fixture(scope="module")
def doors() -> Analysis:
    return analyse_ratings(door_ratings(people=3, attributes=3), "Opening a door")


@pytest.fixture(scope="module")
def html(doors: Analysis) -> str:
    return report_html(doors)


def words(html: str) -> str:
    return Reader(html).text


def test_the_page_loads_nothing(html: str) -> None:
    reader = Reader(html)
    assert not {"script", "link", "iframe", "object", "embed", "img", "image", "base"} & {tag for tag, _ in reader.tags}
    for tag, attributes in reader.tags:
        for name in ("src", "href", "xlink:href", "data", "action", "poster"):
            value = attributes.get(name)
            assert value is None or value.startswith("#"), (tag, name, value)
    assert "@import" not in html and not re.findall(r"url\((?!#)", html)


def test_links_within_the_page_and_ids_fit(html: str) -> None:
    reader = Reader(html)
    ids = [attributes["id"] for _, attributes in reader.tags if attributes.get("id")]
    assert len(ids) == len(set(ids))
    links = {a["href"] for tag, a in reader.tags if tag == "a" and a.get("href")}
    assert links and {link[1:] for link in links if link} <= set(ids)
    used = {m for m in re.findall(r'xlink:href="#([^"]+)"|url\(#([^)]+)\)', html) for m in m if m}
    assert used <= set(ids)


def test_a_name_is_shown_and_never_run() -> None:
    ratings = renamed(door_ratings(people=2, attributes=2), "Hard-to-pull", EVIL)
    ratings = renamed(renamed(ratings, "P100", EVIL + "P"), "FORD", EVIL + "F")
    ratings = replace(ratings, exclusions=(Exclusion("session", EVIL, EVIL, 3),), inputs=(Input(EVIL, "d" * 64, EVIL),))
    page = report_html(analyse_ratings(ratings, EVIL))
    assert "<script" not in page
    assert "script" not in {tag for tag, _ in Reader(page).tags}
    assert words(page).count("<script>alert('x')</script>") >= 5


def test_nothing_on_the_page_is_nan_or_a_p_of_zero(html: str) -> None:
    text = words(html)
    assert not re.search(r"\b(nan|none|inf)\b", text, re.IGNORECASE)
    assert not re.search(r"p = (0|\.0+)\b", text)


@pytest.mark.long
@pytest.mark.parametrize("value", [0.1, 7.0, 100.0])
def test_constant_ratings_are_reported_not_computed(value: float) -> None:
    ratings = door_ratings(people=2, attributes=1)
    flat = replace(ratings, table=ratings.table.assign(value=value), scale=None)
    analysis = analyse_ratings(flat)
    text = words(report_html(analysis))
    assert "undefined" in text
    assert not re.search(r"\b(nan|inf)\b", text, re.IGNORECASE)
    assert "NaN" not in statistics_json(analysis) and "Infinity" not in statistics_json(analysis)


@pytest.mark.long
def test_exclusions_are_listed_and_their_absence_is_reported(doors: Analysis, html: str) -> None:
    assert "P199, session s9 interrupted after 3 of 45 trials 21" in words(html)
    without = replace(doors, ratings=replace(doors.ratings, exclusions=()))
    assert "Nothing was left out." in words(report_html(without))
    assert "Nothing was left out." not in words(html)


def test_every_input_stands_with_its_hash(doors: Analysis, html: str) -> None:
    text = words(html)
    for source in doors.ratings.inputs:
        assert f"{source.name} {source.note}".strip() in text and source.sha256 in text


@pytest.mark.long
def test_simulated_answers_carry_a_banner_and_real_ones_do_not(doors: Analysis, html: str) -> None:
    assert "no person gave these answers" in words(html)
    real = replace(doors, ratings=replace(doors.ratings, simulated=False))
    assert "no person gave these answers" not in words(report_html(real))


def test_the_table_behind_the_figure_is_describes(doors: Analysis, html: str) -> None:
    text = words(html)
    for row in describe(doors.ratings, ("attribute", "variant"), kind="over participants").to_dict("records"):
        shown = f"{row['attribute']} {row['variant']} {fixed(row['mean'])} {fixed(row['sd'])} {row['n']}"
        assert text.count(shown) == 2  # behind each of the two figures


def test_the_headline_is_the_pooled_tests_sentence(doors: Analysis, html: str) -> None:
    row = doors.statistics.tests[6].rows[0]
    df = f"{row['ddof1'] * row['eps']:.2f}, {row['ddof2'] * row['eps']:.2f}"
    assert f"Easy-to-pull – Hard-to-pull variant: F({df}) = {row['F']:.2f}" in words(html)


def test_a_missing_cell_is_on_the_page_with_the_tests_that_it_cost() -> None:
    ratings = door_ratings(people=2, attributes=1)
    incomplete = replace(ratings, table=ratings.table.drop(index=[0]).reset_index(drop=True))
    text = words(report_html(analyse_ratings(incomplete)))
    assert "1 missing cell:" in text and "P100, attribute Easy-to-pull, car BC3, variant g0" in text
    assert "the design asks for:" not in text and "were not made" in text
    assert (
        "Not tested car × variant, group 1; variant, all participants; group, between participants; pairs of"
        " augmentation: P100 lacks 1 of 45 cells (car BC3, variant g0); find the ratings, or leave such participants"
        " out with --missing listwise"
    ) in text
    assert text.count("P100 lacks") == 1


def test_an_imported_table_has_a_report_without_doors() -> None:
    text = words(report_html(analyse_ratings(reasoning())))
    assert "inference × plausibility" in text and "variant" not in text
    assert "Data set reasoning" in text


def test_everything_is_the_same_twice(tmp_path: Path) -> None:
    for run in ("a", "b"):
        analysis = analyse_ratings(door_ratings(people=2, attributes=2), "Doors")
        write_results(analysis, tmp_path / run)
        write_report(analysis, tmp_path / run / "report.html")
        save_figures(analysis, tmp_path / run)
    first = {path.name: path.read_bytes() for path in sorted((tmp_path / "a").iterdir())}
    second = {path.name: path.read_bytes() for path in sorted((tmp_path / "b").iterdir())}
    assert first == second
    tables = {"ratings.csv", "stimulus_means.csv", "variant_means.csv", "anova.csv", "pairwise.csv"}
    pictures = {"means.svg", "means.png", "trends.svg", "trends.png"}
    assert set(first) == {"report.html", "statistics.json", *tables, *pictures}


def test_the_json_holds_every_number_under_a_name_that_says_what_it_is(doors: Analysis) -> None:
    data = json.loads(statistics_json(doors))
    test = next(t for t in data["tests"] if t["kind"] == "pooled" and t["attribute"] == "Damped")
    row = doors.statistics.tests[7].rows[0]
    effect = test["results"][0]
    assert effect["partial_eta_squared"] == row["np2"] and effect["generalized_eta_squared"] == row["ng2"]
    assert effect["p"] == effect["p_greenhouse_geisser"] == row["p_GG_corr"]
    assert effect["correction"] == "Greenhouse-Geisser" and test["participants"] == 6
    assert data["exclusions"][0]["rows"] == 21 and data["inputs"][0]["sha256"] == "a" * 64
    assert data["simulated"] is True and len(data["means"]["levels"]) == 45


def test_an_undefined_number_is_null_with_its_reason(tmp_path: Path) -> None:
    ratings = door_ratings(people=2, attributes=1)
    analysis = analyse_ratings(replace(ratings, table=ratings.table.assign(value=3.0)))
    effect = json.loads(statistics_json(analysis))["tests"][0]["results"][0]
    assert effect["F"] is None and effect["p"] is None and "undefined" in effect["note"]
    write_results(analysis, tmp_path)
    assert "nan" not in (tmp_path / "anova.csv").read_text()


def test_csv_floats_read_back_as_they_were() -> None:
    value = 0.1 + 0.2
    lines = csv_text([{"a": value, "b": None, "c": True, "d": float("nan")}]).splitlines()
    assert lines[0] == "a,b,c,d" and float(lines[1].split(",")[0]) == value and lines[1].endswith(",,true,")


def test_numbers_as_the_page_writes_them() -> None:
    assert [fixed(v) for v in (1.005, -0.333, 0.0, None, float("nan"))] == ["1.00", "−0.33", "0.00", "–", "–"]
    assert [p_cell(v) for v in (0.0321, 1e-300, 5e-324, None)] == [".032", "< .001", "< .001", "–"]
    assert [share(v) for v in (0.5, 1e-5, 0.0, 1.0, None)] == [".500", "< .001", ".000", "1.000", "–"]
    assert [phrase(w) for w in ((), ("a",), ("a", "b"), ("a", "b", "c"))] == ["", "a", "a and b", "a, b and c"]
    assert (count(1, "rating"), count(1200, "rating")) == ("1 rating", "1,200 ratings")


def test_the_report_of_one_participant_says_what_it_cannot_say() -> None:
    ratings = reasoning(people=1)
    text = words(report_html(analyse_ratings(ratings)))
    assert "not tested" in text.lower() and not re.search(r"\bnan\b", text, re.IGNORECASE)
