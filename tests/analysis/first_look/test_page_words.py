"""What the report says holds for the data that it is about: groups, stimuli, averages, exclusions, figures."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from palpate.analysis.first_look.analysis import analyse_ratings
from palpate.analysis.first_look.page import report_html, save_figures
from palpate.analysis.first_look.page_data import facts
from palpate.analysis.first_look.results import write_results
from palpate.analysis.ratings.dataset import Exclusion, Ratings
from palpate.analysis.ratings.reading import read_ratings
from tests.analysis.ratings_for_tests import add_session, add_study, database, definition, small_ratings, stimuli_of
from tests.analysis.synthetic_ratings import door_ratings, reasoning
from tests.analysis.tables_for_tests import imported

APART = "Groups are not a factor of these tests."
MERGED = (Exclusion("averaged", "3 participants", "20 ratings of each averaged into 4 cells", 60, 12),)


def report_text(ratings: Ratings) -> str:
    """The words of the report, without its markup and figures."""
    html = re.sub(r"<svg.*?</svg>|<style>.*?</style>", "", report_html(analyse_ratings(ratings)), flags=re.DOTALL)
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", html)).split())


def between_only(people: int = 8) -> Ratings:
    """One rating of each participant, two groups, nothing within."""
    rows = [(f"P{i}", "Soft", "x", float(i * i % 7)) for i in range(people)]
    table = small_ratings(rows).table.drop(columns=["level"]).assign(sex=["ab"[i % 2] for i in range(people)])
    return small_ratings([], table=table, attributes=("Soft",), within=(), between=("sex",))


def test_a_table_without_within_factors_has_a_report(tmp_path: Path) -> None:
    analysis = analyse_ratings(between_only())
    text = report_text(between_only())
    assert "The effect of sex on each attribute" in text and "F(1, 6)" in text
    assert "No factor varies within participants" in text and "Within participants no factor" in text
    assert "Factors within participants:" not in text
    assert save_figures(analysis, tmp_path) == [] and not list(tmp_path.iterdir())
    assert len(write_results(analysis, tmp_path)) == 6


def test_a_table_without_any_factor_has_a_report() -> None:
    text = report_text(replace(between_only(), between=()))
    assert "No test was made: the data set has no factor to compare." in text and "1.75 (1.58)" in text


def test_the_doors_confound_groups_with_cars_and_the_page_says_so() -> None:
    text = report_text(door_ratings(people=2, attributes=1))
    assert (
        "The groups met different levels of car (group 1: BC3, FORD and G90; group 2: K3, K8 and MQ4), so that an"
        " effect of the group may be one of these levels as well as one of the people." in text
    )
    assert "The groups met the same" not in text and "felt" not in text.split("Results", 1)[1]


def test_groups_with_the_same_stimuli_are_not_reported_to_differ() -> None:
    text = report_text(reasoning())
    assert "The groups met the same levels of inference and plausibility." in text
    assert "different levels" not in text and "stimuli that they felt" not in text


def test_the_tables_and_the_methods_say_that_groups_are_no_factor() -> None:
    text = report_text(door_ratings(people=2, attributes=1))
    pooled = text.index("Each participant has one value for each variant")
    assert APART in text[pooled : pooled + 200]
    pairs = text.index("Levels of augmentation, compared")
    assert APART in text[pairs : pairs + 400]
    assert f"{APART} These are the analysis of variant and the pairs of augmentation" in text
    assert APART not in report_text(replace(reasoning(), between=()))


@pytest.mark.long
def test_the_pairs_say_how_many_ratings_a_mean_rests_on() -> None:
    text = report_text(door_ratings(people=2, attributes=1))
    assert (
        "A participant's value is the mean of 3 ratings for original, 9 for amplitude, position, perturbation and"
        " plateau, 6 for bump: the levels' means rest on unequal numbers." in text
    )
    assert "A participant's value at a level is the mean of 2 ratings." in report_text(reasoning())


@pytest.mark.long
def test_averaged_ratings_are_not_described_as_neither_repeated_nor_replaced() -> None:
    plain, merged = report_text(reasoning()), report_text(replace(reasoning(), exclusions=MERGED))
    assert "nothing is missing, repeated or off the scale" in plain and "No value is replaced or imputed" in plain
    assert "nothing is missing or off the scale. A cell that held several ratings holds their mean" in merged
    assert "repeated or" not in merged and "No value is replaced" not in merged
    assert "60 ratings that shared cells are replaced by 12 means" in merged
    assert "Averaged 60 into 12" in merged and "Left out nothing" in merged and "Left out 60" not in merged


def test_a_scale_that_was_not_declared_was_not_checked() -> None:
    text = report_text(replace(reasoning(), scale=None))
    assert "off the scale" not in text and "on the rating scale" not in text and "on the range of the data" in text


@pytest.mark.long
def test_what_an_import_merged_is_counted_as_merged(tmp_path: Path) -> None:
    rows = [(p, c, s) for p in ("P1", "P2", "P3") for c in ("K3", "K8") for s in range(4)]
    text = "who,item,car,score\n" + "".join(f"{p},soft,{c},{len(p) + s + int(c[1])}\n" for p, c, s in rows)
    ratings = imported(tmp_path, text, duplicates="mean")
    assert "Averaged 24 into 6" in report_text(ratings) and "Left out nothing" in report_text(ratings)
    first = imported(tmp_path, text, duplicates="first")
    assert "Left out 18 repeated ratings" in report_text(first) and "Averaged" not in report_text(first)


def session_study(**changes: Any) -> Ratings:
    """A simulated study whose stimuli say where they come from."""
    stored = definition()
    for place, stimulus in enumerate(stored["stimuli"]):
        stimulus["columns"]["source"] = "measured" if place < 5 else "simulated"
    engine = database()
    add_study(engine, "d1", stored)
    for number in range(1, 4):
        for group in ("1", "2"):
            add_session(engine, f"P{group}0{number}", group, stimuli_of(group), seed=number, **changes)
    return read_ratings(engine, "doors")


@pytest.mark.long
def test_measured_and_simulated_stimuli_and_seeds_are_reported() -> None:
    text = report_text(session_study(simulated=True))
    assert "Stimuli 12: 5 measured, 7 simulated" in text and "Simulation seeds 1, 2, 3" in text
    real = report_text(session_study())
    assert "Stimuli 12: 5 measured, 7 simulated" in real and "Simulation seed" not in real
    assert "Stimuli" not in report_text(door_ratings(people=2, attributes=1)).split("Results")[0]


def test_the_report_says_what_was_planned_and_what_came() -> None:
    engine = database()
    add_study(engine, "d1", definition(participants={"per_group": 4, "sessions": 2}, minutes=5))
    for who, group, number in (
        ("P101", "1", 1),
        ("P101", "1", 2),
        ("P102", "1", 1),
        ("P201", "2", 1),
        ("P201", "2", 3),
    ):
        add_session(engine, who, group, stimuli_of(group), number=number)
    shown = dict(facts(read_ratings(engine, "doors")))
    assert shown["Done of planned"] == "1 of 8 (group 1: 1 of 4, group 2: 0 of 4)"
    assert (shown["Session 1 done"], shown["Session 2 done"]) == ("3", "1")
    assert shown["Minutes, real and planned"] == "1 (1 to 1); 5 planned"
    assert "Done of planned" not in dict(facts(session_study()))


def test_captions_say_how_many_people_and_what_the_spread_is() -> None:
    text = report_text(door_ratings(people=2, attributes=1))
    assert "Bars are means over 4 participants, whiskers ± 1 standard deviation across participants" in text
    assert "Points are means over 4 participants, on the rating scale. Their spread is not drawn here." in text
    assert "as many ratings" not in text


@pytest.mark.long
def test_a_mean_that_rests_on_fewer_ratings_is_reported_under_the_figure() -> None:
    ratings = door_ratings(people=2, attributes=1)
    incomplete = replace(ratings, table=ratings.table.drop(index=[0]).reset_index(drop=True))
    assert report_text(incomplete).count("Not every participant's mean rests on as many ratings: 2 to 3.") == 2


@pytest.mark.long
def test_one_reason_stands_once() -> None:
    ratings = door_ratings(people=2)
    table = ratings.table
    dropped = (table["participant"] == "P100") & (table["car"] == "FORD")
    text = report_text(replace(ratings, table=table[~dropped].reset_index(drop=True)))
    assert text.count("P100 lacks 15 of 45 cells") == 1 and "(all 7 attributes)" in text
    assert text.count("not tested; the reason is given below") == 7


@pytest.mark.parametrize("end", ["K3", "K8"])
def test_a_single_pair_has_no_plural(end: str) -> None:
    rows = [(f"P{p}", "Soft", level, float(p * (1 + (level == end)))) for p in range(1, 5) for level in ("K3", "K8")]
    text = report_text(small_ratings(rows))
    assert "1 pair below" in text.replace("of 1 pair below", "1 pair below") and "1 pairs" not in text
    assert not re.search(r"(?<!d \+ )\b1 (ratings|participants|cells|sessions|values)\b", text)


def test_the_table_of_a_study_without_crossed_stimuli_lists_each_stimulus_once() -> None:
    rows = [(f"P{p}", "Soft", level, float(p + len(level))) for p in range(3) for level in ("a", "bb", "ccc")]
    ratings = small_ratings(rows)
    assert isinstance(ratings.table, pd.DataFrame)
    assert "a 2.00 (1.00) 3 bb 3.00 (1.00) 3 ccc 4.00 (1.00) 3" in report_text(ratings)
