"""A missing cell is never averaged away: the tests that need it are refused, or its participant is left out."""

from __future__ import annotations

import contextlib
import json
import sqlite3
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from palpate.analysis.first_look.analysis import analyse_ratings
from palpate.analysis.first_look.page import report_html
from palpate.analysis.first_look.page_tests import comparisons, refusals
from palpate.analysis.first_look.results import statistics_json
from palpate.analysis.first_look.study_statistics import questions_of, study_statistics
from palpate.analysis.ratings.dataset import Crossing, DataRefused, Exclusion, Ratings
from palpate.analysis.ratings.design import cell_faults, check_ratings, without_incomplete
from palpate.analysis.ratings.reading import read_ratings
from tests.analysis.ratings_for_tests import add_session, add_study, database, definition, small_ratings, stimuli_of
from tests.analysis.synthetic_ratings import door_ratings, reasoning
from tests.commands_for_tests import run_command


def without(ratings: Ratings, **where: str) -> Ratings:
    """The ratings without the rows that have these levels."""
    dropped = pd.Series(True, index=ratings.table.index)
    for column, level in where.items():
        dropped &= ratings.table[column] == level
    assert dropped.any()
    return replace(ratings, table=ratings.table[~dropped].reset_index(drop=True))


def answered_tests(ratings: Ratings) -> dict[tuple[str, str, str], bool]:
    """Which tests were made, by kind, scope and attribute."""
    tests = study_statistics(ratings).tests
    return {(test.question.kind, test.question.scope, test.attribute): bool(test.rows) for test in tests}


@pytest.mark.parametrize(
    "cell",
    [
        {"participant": "P100", "car": "FORD"},  # the means over cars would be those of two
        {"participant": "P100", "car": "FORD", "variant": "g7"},
        {"participant": "P100", "variant": "g7"},
    ],
)
def test_a_missing_cell_stops_every_test_that_would_average_over_it(cell: dict[str, str]) -> None:
    done_by_key = answered_tests(without(door_ratings(people=3, attributes=2), **cell))
    assert all(done_by_key[key] == (key[1] == "group 2") for key in done_by_key)


def test_only_the_attribute_with_the_missing_cell_is_refused() -> None:
    done_by_key = answered_tests(
        without(door_ratings(people=3, attributes=2), participant="P100", attribute="Damped", variant="g3")
    )
    assert {attribute for (_, _, attribute), done in done_by_key.items() if not done} == {"Damped"}
    assert done_by_key["crossed", "group 2", "Damped"] and not done_by_key["between", "all participants", "Damped"]


def test_a_level_that_nobody_rated_but_the_design_declares_stops_the_tests() -> None:
    ratings = reasoning(people=6)
    crossing = Crossing({}, {"inference": ("MP", "MT", "AC", "DA", "XX"), "plausibility": ("plausible", "implausible")})
    assert not any(answered_tests(replace(ratings, crossings=(crossing,))).values())
    assert all(answered_tests(ratings).values())


def test_a_repeat_that_was_not_given_is_missing_too() -> None:
    ratings = reasoning(people=4)
    twice = pd.concat([ratings.table, ratings.table], ignore_index=True)
    once_less = replace(ratings, table=twice.drop(index=[3]).reset_index(drop=True), repeats=2)
    assert not any(answered_tests(once_less).values())
    assert (
        "0 lacks 1 of 8 cells (inference MT, plausibility implausible)" in study_statistics(once_less).tests[0].refused
    )


def test_an_item_of_a_cell_that_one_participant_did_not_rate_is_missing() -> None:
    rows = [
        (f"P{p}", "Soft", level, float(p * 3 + i + len(level)))
        for p in range(4)
        for level in ("x", "yy")
        for i in range(3)
    ]
    table = pd.DataFrame(rows, columns=["participant", "attribute", "level", "value"])
    table["stimulus"] = [f"{level}{i % 3}" for i, level in enumerate(table["level"])]
    ratings = small_ratings([], table=table, attributes=("Soft",))
    test = study_statistics(ratings).tests[0]
    assert test.rows and test.ratings_per_cell == (3, 3)
    incomplete = replace(ratings, table=table.drop(index=[4]).reset_index(drop=True))
    missing = check_ratings(incomplete).of("missing")
    assert missing is not None and missing.listed[0].text() == "P0, attribute Soft, level yy: 2 of 3 ratings"
    assert not any(answered_tests(incomplete).values())


def test_two_sessions_of_one_person_are_not_averaged() -> None:
    ratings = door_ratings(people=2, attributes=1)
    again = ratings.table[ratings.table["participant"] == "P100"]
    twice = replace(ratings, table=pd.concat([ratings.table, again], ignore_index=True))
    done_by_key = answered_tests(twice)
    assert [key[1] for key, done in done_by_key.items() if done] == ["group 2"]


def test_levels_of_one_group_alone_are_refused_without_naming_a_python_argument() -> None:
    ratings = door_ratings(people=2, attributes=1)
    table = ratings.table.assign(variant=ratings.table["variant"].where(ratings.table["group"] == "1", "h"))
    lone = replace(ratings, table=table.drop_duplicates(["participant", "car", "variant"]), crossings=(), families="")
    reasons = " ".join(test.refused for test in study_statistics(lone).tests)
    assert "P100 was not to meet variant h, others were" in reasons
    assert "missing=" not in reasons and "aggregate=" not in reasons


def test_the_refusal_names_the_option_and_nothing_of_python() -> None:
    ratings = without(door_ratings(people=3, attributes=2), participant="P100", car="FORD")
    (line,) = refusals(analyse_ratings(ratings))
    assert line.endswith(
        "P100 lacks 15 of 45 cells (the first: car FORD, variant g0); find the ratings, or leave such participants out"
        " with --missing listwise"
    )
    assert line.startswith("car × variant, group 1 (all 2 attributes); variant, all participants (all 2 attributes);")
    assert "missing=" not in line and "aggregate" not in line


def test_listwise_leaves_incomplete_participants_out_with_a_line() -> None:
    ratings = without(door_ratings(people=3, attributes=2), participant="P100", car="FORD")
    complete = without_incomplete(ratings)
    assert complete.participants == tuple(name for name in ratings.participants if name != "P100")
    assert complete.exclusions == (
        *ratings.exclusions,
        Exclusion("participant", "P100", "incomplete: 30 cells missing", 60),
    )
    assert all(answered_tests(complete).values())
    whole = without(door_ratings(people=3, attributes=2), participant="P100")
    for ours, theirs in zip(study_statistics(complete).tests, study_statistics(whole).tests, strict=True):
        assert ours == theirs
    text = report_html(analyse_ratings(complete))
    assert "Every participant kept rated every cell" in text and "incomplete: 30 cells missing" in text


def test_listwise_changes_nothing_where_nothing_is_missing_and_refuses_to_leave_nobody() -> None:
    ratings = door_ratings(people=2, attributes=1)
    assert without_incomplete(ratings) is ratings
    one = without(door_ratings(people=1, attributes=1), variant="g3")
    with pytest.raises(DataRefused, match="nobody is left without incomplete participants: each of 2 participants"):
        without_incomplete(one)


def test_a_full_design_has_no_fault() -> None:
    assert cell_faults(door_ratings(people=2, attributes=2)).places == {}


def test_the_number_of_ratings_behind_a_value_stands_in_the_json() -> None:
    tests = json.loads(statistics_json(analyse_ratings(door_ratings(people=3, attributes=1))))["tests"]
    assert {test["kind"]: test["ratings_per_cell"] for test in tests} == {
        "crossed": [1, 1], "pooled": [3, 3], "between": [45, 45], "pairs": [3, 9],
    }  # fmt: skip
    assert tests[-1]["ratings_per_level"] == {
        "original": [3, 3], "amplitude": [9, 9], "position": [9, 9], "perturbation": [9, 9], "plateau": [9, 9],
        "bump": [6, 6],
    }  # fmt: skip


def test_pairs_are_in_the_order_of_the_study_earlier_minus_later() -> None:
    ratings = door_ratings(people=3, attributes=1)
    analysis = analyse_ratings(ratings)
    (shown,) = comparisons(analysis)
    order = ["original", "amplitude", "position", "perturbation", "plateau", "bump"]
    assert [row[0] for row in shown.table.rows] == [f"{a} − {b}" for i, a in enumerate(order) for b in order[i + 1 :]]
    means = ratings.table.groupby(["participant", "augmentation"])["value"].mean().unstack()
    for row in analysis.statistics.tests[-1].rows:
        difference = means[row["A"]] - means[row["B"]]
        assert row["mean_diff"] == pytest.approx(difference.mean(), rel=1e-9)
        assert row["dz"] == pytest.approx(difference.mean() / difference.std(), rel=1e-9)
        assert row["T"] == pytest.approx(row["dz"] * 6**0.5, rel=1e-9)
        assert row["ci_low"] < row["mean_diff"] < row["ci_high"]


def test_a_factor_that_the_study_leaves_out_is_averaged_over_only_where_it_is_complete() -> None:
    engine = database()
    add_study(engine, "d1", definition(analysis={"within": ["variant"], "pooled": "variant"}))
    for number in range(1, 4):
        for group in ("1", "2"):
            add_session(engine, f"P{group}0{number}", group, stimuli_of(group))
    ratings = read_ratings(engine, "doors")
    assert questions_of(ratings)[0].averaged_over == ("stimulus",)
    assert all(answered_tests(ratings).values())
    add_session(engine, "P109", "1", stimuli_of("1"), answered=5)
    done_by_key = answered_tests(read_ratings(engine, "doors", include_incomplete=True))
    assert {scope for (_, scope, _), done in done_by_key.items() if done} == {"group 2"}


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory: pytest.TempPathFactory) -> tuple[object, ...]:
    """A collected database of four simulated sessions; that of P004 ends before its last two trials."""
    folder = tmp_path_factory.mktemp("lab")
    simulate = ("--simulate", "--seed", 5, "--lab", folder)
    assert run_command("run", "door_ratings", "--participant", "P001..P004", *simulate)[0] == 0
    database = folder / "all.sqlite"
    assert run_command("collect", "--lab", folder, "--to", f"sqlite:///{database}")[0] == 0
    with contextlib.closing(sqlite3.connect(database)) as connection, connection:
        session = "SELECT session FROM sessions WHERE participant = 'P004'"
        last = f"session = ({session}) AND trial > 43"
        assert connection.execute(f"DELETE FROM responses WHERE {last}").rowcount > 0
        connection.execute(
            "UPDATE sessions SET status = 'interrupted', trials_answered = 43 WHERE participant = 'P004'"
        )
    return ("door_ratings", "--database", f"sqlite:///{database}", "--lab", folder)


def answer(*arguments: object) -> dict[str, Any]:
    code, out, _ = run_command(*arguments, "--json")
    assert code == 0
    return dict(json.loads(out))


@pytest.mark.long
def test_an_interrupted_session_that_is_included_is_named_and_stops_its_tests(interrupted: tuple[object, ...]) -> None:
    summary = answer("report", *interrupted, "--include-incomplete")
    assert (summary["participants"], summary["complete"], summary["interrupted_included"]) == (4, False, 1)
    page = Path(summary["files"][0]).read_text(encoding="utf-8")
    assert "1 interrupted session was included on request and is incomplete: P004, session" in page
    assert "43 of 45 trials" in page and "--missing listwise" in page and "missing=" not in page
    assert set(summary["headlines"].values()) == {"not tested; the reason is given below"}
    (line,) = summary["not_tested"]
    assert "P004 lacks 2 of 45 cells" in line and "group 1" not in line
    code, out, _ = run_command("analyse", *interrupted, "--include-incomplete", "--no-figures")
    assert code == 0 and "1 interrupted session was included" in out


@pytest.mark.long
def test_listwise_on_the_command_line_leaves_the_participant_out(interrupted: tuple[object, ...]) -> None:
    summary = answer("report", *interrupted, "--include-incomplete", "--missing", "listwise")
    assert (summary["participants"], summary["complete"], summary["left_out"]) == (3, True, 1)
    assert "lacks" not in " ".join(summary["not_tested"])
    page = Path(summary["files"][0]).read_text(encoding="utf-8")
    assert "incomplete: 14 cells missing" in page and "1 participant (301 ratings)" in page
    data = answer("analyse", *interrupted, "--include-incomplete", "--missing", "listwise", "--no-figures")
    stored = json.loads(Path(data["files"][0]).read_text(encoding="utf-8"))
    assert [exclusion["what"] for exclusion in stored["exclusions"]] == ["participant"]


def test_an_unknown_way_with_missing_cells_is_the_users_mistake() -> None:
    code, _, err = run_command("report", "door_ratings", "--missing", "mean")
    assert code == 2 and "'refuse', 'listwise'" in err
