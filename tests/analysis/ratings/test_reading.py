"""Ratings from a collected database: every session is in the table or in the exclusion ledger."""

from __future__ import annotations

from typing import Any

import pytest
from sqlalchemy import Engine, create_engine, text

from palpate.analysis.ratings.dataset import DataRefused, Exclusion, Scale
from palpate.analysis.ratings.describe import describe
from palpate.analysis.ratings.design import check_ratings
from palpate.analysis.ratings.reading import read_ratings
from tests.analysis.ratings_for_tests import add_session, add_study, database, definition, stimuli_of, value_of


@pytest.fixture
def lab() -> Engine:
    engine = database()
    add_study(engine, "d1", definition())
    for number in range(1, 4):
        for group in ("1", "2"):
            add_session(engine, f"P{group}0{number}", group, stimuli_of(group))
    return engine


def test_each_counting_answer_is_one_row_in_the_order_of_participants_trials_and_attributes(lab: Engine) -> None:
    ratings = read_ratings(lab, "doors")
    assert len(ratings.table) == 6 * 6 * 2
    first = ratings.table.iloc[0]
    assert (first["participant"], first["attribute"], first["stimulus"]) == ("P101", "Easy", "BC3_g0")
    for row in ratings.table.to_dict("records"):
        assert row["value"] == value_of(row["participant"], row["stimulus"], row["attribute"])
        assert row["revised"] is True
    assert ratings.table["value"].dtype == "float64"
    assert ratings.exclusions == ()


def test_the_data_set_says_what_the_study_says(lab: Engine) -> None:
    ratings = read_ratings(lab, "doors")
    assert (ratings.within, ratings.between) == (("car", "variant"), ("group",))
    assert ratings.attributes == ("Easy", "Pleasant")
    assert ratings.scale == Scale(-10, 10, 1)
    assert ratings.antonyms == {"Easy": "Hard", "Pleasant": "Unpleasant"}
    assert ratings.categories == {"Easy": "physical", "Pleasant": "emotional"}
    assert ratings.levels("variant") == ("g0", "g2", "g10")
    assert ratings.inputs[0].sha256 == "d1"
    assert len(ratings.inputs) == 1 + 6
    assert check_ratings(ratings).ok, check_ratings(ratings).text()


def test_a_connection_will_do_as_well_as_an_engine(lab: Engine) -> None:
    with lab.connect() as connection:
        assert len(read_ratings(connection, "doors").table) == 72


def test_the_study_names_its_factors_itself_where_it_does() -> None:
    engine = database()
    add_study(engine, "d1", definition(analysis={"within": ["variant"], "pooled": "variant", "families": "family"}))
    add_session(engine, "P1", "1", stimuli_of("1"))
    ratings = read_ratings(engine, "doors")
    assert (ratings.within, ratings.pooled, ratings.families) == (("variant",), "variant", "family")
    assert ratings.levels("family") == ("original", "amplitude"), "as they come along the variants"
    described = describe(ratings, ["category", "family"])
    assert described["family"].tolist() == ["original", "amplitude"] * 2
    assert check_ratings(ratings).ok, "the cells owed are the stimuli, whatever the tests will average"


def test_stimuli_that_no_columns_cross_are_a_factor_themselves() -> None:
    engine = database()
    stimuli = [{"id": name, "columns": {"file": f"{name}.csv", "kind": "a"}} for name in ("wood", "felt", "tin")]
    add_study(engine, "d1", definition(stimuli=[{**s, "columns": {"kind": "a"}} for s in stimuli], groups={}))
    add_session(engine, "P1", None, ["wood", "felt", "tin"])
    ratings = read_ratings(engine, "doors")
    assert ratings.within == ("stimulus",)
    assert ratings.levels("stimulus") == ("wood", "felt", "tin")
    assert check_ratings(ratings).cells_expected == 6


def test_practice_is_left_out_with_a_line(lab: Engine) -> None:
    add_session(lab, "P109", "1", ["BC3_g0", "FORD_g2", *stimuli_of("1")], practice=2)
    ratings = read_ratings(lab, "doors")
    assert ratings.exclusions == (
        Exclusion("practice", "P109, session doors/P109/1", "practice trials do not count", 4),
    )
    assert check_ratings(ratings).ok


def test_an_interrupted_session_is_left_out_with_a_line(lab: Engine) -> None:
    add_session(lab, "P109", "1", stimuli_of("1"), answered=4)
    ratings = read_ratings(lab, "doors")
    assert "P109" not in ratings.participants
    assert ratings.exclusions == (
        Exclusion("session", "P109, session doors/P109/1", "interrupted after 4 of 6 trials", 8),
    )
    assert len(ratings.inputs) == 1 + 7, "a file that was read is an input even if nothing of it is used"


def test_an_interrupted_session_that_is_kept_has_its_missing_cells_named(lab: Engine) -> None:
    add_session(lab, "P109", "1", stimuli_of("1"), answered=4)
    report = check_ratings(read_ratings(lab, "doors", include_incomplete=True))
    missing = report.of("missing")
    assert missing is not None and missing.count == 4
    assert missing.listed[0].text() == "P109, attribute Easy, car FORD, variant g2"


def test_a_kept_session_without_a_rating_is_not_forgotten(lab: Engine) -> None:
    add_session(lab, "P109", "1", stimuli_of("1"), answered=0, status="complete")
    assert read_ratings(lab, "doors").exclusions == (
        Exclusion("session", "P109, session doors/P109/1", "holds no rating", 0),
    )


def test_two_sessions_of_one_person_are_named_not_averaged(lab: Engine) -> None:
    add_session(lab, "P101", "1", stimuli_of("1"), number=2)
    report = check_ratings(read_ratings(lab, "doors"))
    duplicate = report.of("duplicate")
    assert duplicate is not None and duplicate.count == 12


def test_planned_repeats_are_no_duplicates() -> None:
    engine = database()
    add_study(engine, "d1", definition(order={"design": "williams", "repeats": 2}))
    add_session(engine, "P1", "1", stimuli_of("1") * 2)
    assert check_ratings(read_ratings(engine, "doors")).ok
    add_session(engine, "P2", "1", stimuli_of("1"))
    missing = check_ratings(read_ratings(engine, "doors")).of("missing")
    assert missing is not None and missing.count == 12
    assert missing.listed[0].found == "1 of 2 ratings"


def test_a_changed_study_needs_a_choice(lab: Engine) -> None:
    add_study(lab, "e2", definition(title="changed"))
    add_session(lab, "P109", "1", stimuli_of("1"), digest="e2")
    with pytest.raises(DataRefused, match=r"changed between participants: d1 \(6 sessions\), e2 \(1 session\)"):
        read_ratings(lab, "doors")
    ratings = read_ratings(lab, "doors", digest="d")
    assert len(ratings.participants) == 6
    assert ratings.exclusions[0].why == "recorded with another version of the study (e2)"
    with pytest.raises(DataRefused, match="0 versions begin with 'f'"):
        read_ratings(lab, "doors", digest="f")


def test_simulated_and_real_sessions_are_not_mixed(lab: Engine) -> None:
    add_session(lab, "P109", "1", stimuli_of("1"), simulated=True)
    with pytest.raises(DataRefused, match="1 simulated and 6 real"):
        read_ratings(lab, "doors")
    real = read_ratings(lab, "doors", simulated=False)
    assert (len(real.participants), real.simulated) == (6, False)
    assert real.exclusions[0].why == "a simulated session"
    simulated = read_ratings(lab, "doors", simulated=True)
    assert (simulated.participants, simulated.simulated, len(simulated.exclusions)) == (("P109",), True, 6)


def test_a_stimulus_column_that_takes_a_name_of_the_table_is_renamed() -> None:
    stimuli = [{"id": f"s{i}", "columns": {"group": f"g{i % 2}", "trial": f"t{i // 2}"}} for i in range(4)]
    engine = database()
    add_study(engine, "d1", definition(stimuli=stimuli, groups={}))
    add_session(engine, "P1", None, [f"s{i}" for i in range(4)])
    ratings = read_ratings(engine, "doors")
    assert ratings.within == ("stimulus.group", "stimulus.trial")
    assert ratings.table["trial"].tolist()[0] == 1


def _broken(engine: Engine, statement: str) -> Engine:
    with engine.begin() as connection:
        connection.execute(text(statement))
    return engine


@pytest.mark.parametrize(
    ("statement", "reason"),
    [
        ("UPDATE responses SET attribute = 'Easi' WHERE attribute = 'Easy'", "did you mean 'Easy'"),
        ("UPDATE trials SET stimulus = 'BC3_g9' WHERE trial = 1", "stimulus 'BC3_g9' is not in the study"),
        ("UPDATE responses SET value = 'soft' WHERE trial = 2", "answered with 'soft', a number is expected"),
        ("UPDATE sessions SET status = 'completed'", "did you mean 'complete'"),
        ("UPDATE sessions SET status = 'interrupted'", "no session is left to analyse"),
        ("DELETE FROM studies", "its definition d1 is not in the database"),
        ("UPDATE studies SET definition = '{}'", "the stored definition cannot be read"),
        ("DELETE FROM sessions", "holds no session"),
        ("DROP TABLE sessions", "not a collected database"),
    ],
)
def test_a_damaged_database_is_refused_by_name(lab: Engine, statement: str, reason: str) -> None:
    with pytest.raises(DataRefused, match=reason):
        read_ratings(_broken(lab, statement), "doors")


def test_a_database_of_something_else_is_refused() -> None:
    with pytest.raises(DataRefused, match="palpate collect"):
        read_ratings(create_engine("sqlite://"), "doors")


def test_a_study_that_was_misspelt_is_named(lab: Engine) -> None:
    with pytest.raises(DataRefused, match="did you mean 'doors'"):
        read_ratings(lab, "dors")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [((1, 1), "lower one"), ((0, 10, 0), "step must be above 0"), ((0, 10, -1), "step must be above 0")],
)
def test_an_impossible_scale_is_refused(arguments: Any, reason: str) -> None:
    with pytest.raises(DataRefused, match=reason):
        Scale(*arguments)


def test_a_step_that_is_no_binary_fraction_is_accepted() -> None:
    scale = Scale(0, 1, 0.1)
    assert all(scale.on_step(k / 10) for k in range(11))
    assert not scale.on_step(0.15)
