"""CI replays one recorded session of each of the ten studies, and regenerates every table exactly."""

import csv
from collections import defaultdict

import pytest
from sqlalchemy import text

from palpate.studies.collecting.collect import collect, open_database
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import recompiled, replay
from tests.recorded.make_ten import COLUMNS, HERE, INTERRUPTED
from tests.studies.shipped import TEN

LEDGERS = {name: HERE / "ten" / f"{name}_P001_s1.sqlite" for name in TEN}


@pytest.fixture(scope="module")
def database():
    engine = open_database("sqlite://")
    assert [result.what for result in collect(list(LEDGERS.values()), engine)] == ["new"] * len(TEN)
    yield engine
    engine.dispose()


def test_every_study_has_a_recorded_session_and_nothing_else_lies_there():
    assert sorted((HERE / "ten").iterdir()) == sorted(LEDGERS.values())
    assert sum(path.stat().st_size for path in LEDGERS.values()) < 2_000_000


@pytest.mark.parametrize("name", TEN)
def test_a_recorded_session_repeats_event_by_event(name):
    before = LEDGERS[name].read_bytes()
    result = replay(LEDGERS[name])
    assert result.complete and result.events == len(read(LEDGERS[name]).events)
    assert LEDGERS[name].read_bytes() == before


@pytest.mark.parametrize("table", COLUMNS)
def test_the_tables_are_exactly_the_expected(database, table):
    """Expected: tests/recorded/make_ten.py, by sqlite3 and json from the ledgers."""
    with (HERE / "expected" / "ten" / f"{table}.csv").open(newline="") as file:
        header, *rows = list(csv.reader(file))
    order = "trial, attempt, attribute" if table == "responses" else "seq, " + {"words": "n", "switches": "n",
             "answers": "item", "streams": "block"}[table]  # fmt: skip
    with database.connect() as connection:
        query = f"SELECT {', '.join(header)} FROM {table} ORDER BY session, {order}"
        collected = [["" if cell is None else str(cell) for cell in row] for row in connection.execute(text(query))]
    assert collected == rows and len(rows) > 10


def kinds(name, kind):
    return [event.value for event in read(LEDGERS[name]).events if event.kind == kind]


def test_what_can_happen_to_a_session_is_among_them():
    for name in INTERRUPTED:
        because = [s.value.get("because") for s in read(LEDGERS[name]).run_notes if s.kind == "closed"]
        assert because == ["interrupted by SIGTERM", "complete"]
    assert [event["do"] for event in kinds("texture_similarity", "experimenter")] == ["pause", "note", "go_on"]
    assert [event["as"] for event in kinds("texture_adjectives", "trial_ended")].count("repeated") == 1
    assert kinds("door_matching", "experimenter") == [{"do": "repeat", "which": "this"}]
    assert [event["as"] for event in kinds("door_ratings", "trial_ended")].count("left") == 1


@pytest.mark.parametrize("name", TEN)
def test_a_session_explains_what_its_participant_agreed_to(name):
    record = read(LEDGERS[name])
    forms = recompiled(record).lab_forms
    assert forms.consent == "Do you agree?" and [q.name for q in forms.questions] == ["age", "handedness", "remark"]
    (agreed,) = [
        e.value["answers"] for e in record.events if e.kind == "reply" and "agreed" in e.value.get("answers", {})
    ]
    assert agreed == {"agreed": True}


def test_a_repeated_trial_counts_once():
    with (HERE / "expected" / "ten" / "words.csv").open(newline="") as file:
        rows = [
            row for row in csv.DictReader(file) if row["form"] == "adjectives" and row["session"].startswith("texture")
        ]
    attempts, counted = defaultdict(set), defaultdict(set)
    for row in rows:
        attempts[row["trial"]].add(row["attempt"])
        if row["counts"] == "1":
            counted[row["trial"]].add(row["attempt"])
    assert len(counted) == 50 and {len(attempt) for attempt in counted.values()} == {1}
    assert sum(len(attempt) > 1 for attempt in attempts.values()) == 1
