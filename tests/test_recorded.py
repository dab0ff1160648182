"""CI replays recorded sessions, and regenerates their tables (exactly) and statistics (to 1e-9)."""

import csv
import json
from pathlib import Path

import pytest
from sqlalchemy import text

from palpate.analysis import rm_anova
from palpate.analysis.ratings.describe import describe
from palpate.analysis.ratings.reading import read_ratings
from palpate.protocols.events import Ask
from palpate.protocols.simulated_participants.perceiver import Perceiver
from palpate.protocols.tasks import Task
from palpate.studies.collecting.collect import collect, open_database
from palpate.studies.sessions.record import read
from palpate.studies.sessions.replay import recompiled, replay

HERE = Path(__file__).resolve().parent / "recorded"
LEDGERS = sorted((HERE / "sessions").glob("*.sqlite"))
STATISTICS = json.loads((HERE / "expected" / "statistics.json").read_text())


def ledger(participant):
    return HERE / "sessions" / f"doors_small_{participant}_s1.sqlite"


@pytest.fixture(scope="module")
def database():
    engine = open_database("sqlite://")
    assert [result.what for result in collect(LEDGERS, engine)] == ["new"] * 12
    yield engine
    engine.dispose()


@pytest.mark.parametrize("path", LEDGERS, ids=lambda path: path.stem)
def test_a_recorded_session_repeats_event_by_event(path):
    before = path.read_bytes()
    result = replay(path)
    assert result.complete and result.events == len(read(path).events)
    assert path.read_bytes() == before


def lefts(record):
    return sum(e.kind == "trial_ended" and e.value["as"] == "left" for e in record.events)


def lapses(record):
    plan = recompiled(record)
    person = Perceiver(plan)
    return [(t.number, a.name) for t in plan.trials for a in t.form.attributes if person.lapses(Ask(t.form, t), a)]


def test_every_outcome_is_among_them():
    assert len(LEDGERS) == 12
    plain, interrupted, lapsed, revised = (read(ledger(who)) for who in ("P001", "P002", "P004", "P006"))
    assert (lefts(plain), lapses(plain), len(plain.run_notes)) == (0, [], 3)
    assert [s.value.get("because") for s in interrupted.run_notes if s.kind == "closed"] == [
        "interrupted by SIGTERM", "complete",
    ]  # fmt: skip
    assert lapses(lapsed) == [(4, "Easy-to-pull")]
    assert lefts(revised) == 2


def test_the_tables_are_exactly_the_expected(database):
    with (HERE / "expected" / "ratings.csv").open(newline="") as file:
        header, *expected = list(csv.reader(file))
    with database.connect() as connection:
        query = f"SELECT {', '.join(header)} FROM ratings ORDER BY session, trial, attribute"
        rows = [["" if cell is None else str(cell) for cell in row] for row in connection.execute(text(query))]
    assert rows == expected
    assert len(rows) == 12 * 7 * 3


@pytest.mark.parametrize("attribute", sorted(STATISTICS))
def test_the_statistics_are_the_expected(database, attribute):
    """Expected: pingouin 0.7.0 rm_anova; F also statsmodels 0.15.0 AnovaRM."""
    ratings = read_ratings(database, "doors_small").only(attribute)
    table = rm_anova(ratings.table, dv="value", within=["car", "variant"], subject="participant").set_index("Source")
    for source in ("car", "variant", "car:variant"):
        for name, expected in STATISTICS[attribute][source].items():
            assert table.loc[source, name] == pytest.approx(expected, rel=1e-9), (source, name)


@pytest.mark.parametrize("attribute", sorted(STATISTICS))
def test_means_and_sds_are_the_expected(database, attribute):
    """Expected: pandas 3.1 mean and std."""
    table = describe(read_ratings(database, "doors_small").only(attribute), ["attribute", "variant"])
    means = {row.variant: {"mean": row.mean_, "sd": row.sd, "n": row.n} for row in renamed(table)}
    assert means == {level: pytest.approx(values, rel=1e-9) for level, values in STATISTICS[attribute]["means"].items()}


def renamed(table):
    return table.rename(columns={"mean": "mean_"}).itertuples()


def test_a_changed_task_makes_the_replay_fail_and_says_how(monkeypatch, run_palpate):
    from palpate.protocols.tasks import steps

    def hasty(trial):
        return steps.outcome_of((yield steps.Ask(trial.form, trial)))

    monkeypatch.setattr("palpate.protocols.runner.TASKS", {"slider_rating": Task("", hasty)})
    output = run_palpate("replay", ledger("P001"), status=1)
    assert "DIFFERS" in output
    assert "event 4 (request, trial 1): $.back: not recorded, now false" in output
