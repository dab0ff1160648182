"""What forms other than sliders leave in the collected database, and which sessions are marked."""

import pytest
from sqlalchemy import text

from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.reading import read_ratings
from palpate.protocols.events import Aside, Ask, Confirm, Reply
from palpate.studies.collecting.collect import collect, open_database
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session import start
from palpate.studies.sessions.session_files import ledger_path, ledgers_in
from palpate.studies.simulation.rig import simulated
from tests.protocols.every_task import plan_of

pytestmark = pytest.mark.usefixtures("shared_grounds")


class Meddled:
    """A world, and an experimenter who does one thing at the n-th Ask."""

    def __init__(self, world, at, does):
        self.world, self.at, self.does, self.form_count = world, at, does, 0

    def now(self):
        return self.world.now()

    def perform(self, request):
        self.form_count += isinstance(request, Ask)
        if self.form_count == self.at and self.does is not None:
            aside, self.does = Aside(self.does), None
            return aside
        return self.world.perform(request)


def meddling(plan, lab, at, does):
    planned = simulated(plan.study, lab)

    def opened(plan, t_ns):
        return Rig(Meddled(planned.open(plan, t_ns).world, at, does), lambda: None)

    return RigPlan(planned.description, planned.check, opened)


@pytest.fixture
def engine():
    engine = open_database("sqlite://")
    yield engine
    engine.dispose()


def ran(lab, task, participant="P001", at=0, does=None, needs=(), **changes):
    plan = plan_of(task, participant, needs=needs, **changes)
    return start(lab, plan, meddling(plan, lab, at, does))


def rows(engine, query):
    with engine.connect() as connection:
        return [tuple(row) for row in connection.execute(text(query))]


def gather(lab, engine, withdrawn=()):
    return [result.what for result in collect(ledgers_in(lab), engine, withdrawn)]


def test_words_are_rows_and_a_revision_counts_alone(tmp_path, engine):
    ran(tmp_path, "adjective_selection", simulation={"latents": {"rough": {"intercept": 9}}, "revise_rate": 0.6})
    gather(tmp_path, engine)
    assert rows(engine, "SELECT DISTINCT form, kind FROM words WHERE trial IS NOT NULL AND kind = 'ticked'") == [
        ("adjectives", "ticked")
    ]
    stands = rows(
        engine,
        "SELECT trial, count(*) FROM words WHERE word = 'rough' AND form = 'adjectives' AND counts GROUP BY trial",
    )
    every = rows(engine, "SELECT count(*) FROM words WHERE word = 'rough'")
    assert stands == [(1, 1), (2, 1), (3, 1), (4, 1)] and every[0][0] > 4
    assert rows(engine, "SELECT status, trials_answered FROM sessions") == [("complete", 4)]


def test_forms_outside_trials_are_answers(tmp_path, engine):
    ran(tmp_path, "free_lexicon")
    gather(tmp_path, engine)
    answers = {item: (form, value, number) for form, item, value, number in
             rows(engine, "SELECT form, item, value, number FROM answers")}  # fmt: skip
    assert answers["agreed"] == ("consent", "true", None) and answers["remark"] == ("demographics", "null", None)
    assert answers["handedness"][1] in ("left", "right") and 18 <= answers["age"][2] <= 64
    assert 1 <= answers["Realism"][2] <= 7
    assert rows(engine, "SELECT DISTINCT form FROM words ORDER BY form") == [("lexicon",), ("suggestions",)]


def test_switches_are_counted_and_timed_and_similarity_is_a_rating(tmp_path, engine):
    ran(tmp_path, "similarity")
    gather(tmp_path, engine)
    switches = rows(engine, "SELECT trial, count(*), min(at_s) > 0 FROM switches GROUP BY trial")
    assert len(switches) == 4 and all(count >= 2 and positive for _, count, positive in switches)
    assert set(read_ratings(engine, "toy").table["attribute"]) == {"different"}


def test_tries_are_no_answers(tmp_path, engine):
    ran(tmp_path, "authoring")
    gather(tmp_path, engine)
    assert rows(engine, "SELECT count(*), sum(counts) FROM responses") == [(8, 8)]


@pytest.mark.long
def test_references_are_collected_apart_from_trials(tmp_path, engine):
    anchors = {"stimuli": [{"id": "A", "label": "This is 0.", "attribute": "Soft", "value": 0}], "rated": False}
    ran(tmp_path, "matching", anchors=anchors)
    assert gather(tmp_path, engine) == ["new"] and gather(tmp_path, engine) == ["unchanged"]
    [(block, stimulus, value, felt)] = rows(engine, "SELECT block, stimulus, value, felt FROM anchors")
    assert (block, stimulus, value) == ("main", "A", 0.0) and felt in (1, 2)
    assert rows(engine, "SELECT count(*) FROM trials WHERE stimulus = 'A'") == [(0,)]
    assert rows(engine, "SELECT count(*) FROM answers WHERE item = 'felt'") == [(0,)]


def test_a_recording_counts_as_done(tmp_path, engine):
    ran(tmp_path, "capture", needs=["tool"])
    gather(tmp_path, engine)
    assert rows(engine, "SELECT trials_answered, status FROM sessions") == [(4, "complete")]
    assert rows(engine, "SELECT DISTINCT status FROM trials") == [("captured",)]
    with pytest.raises(DataRefused, match="its task is capture, which gives no ratings"):
        read_ratings(engine, "toy")


def test_a_repeated_trial_s_first_answer_does_not_count(tmp_path, engine):
    last = {"do": "repeat", "which": "last"}
    ran(tmp_path, "matching", at=4, does=last, simulation={"latents": {}, "revise_rate": 0})
    gather(tmp_path, engine)
    assert rows(engine, "SELECT trial, attempt, counts FROM responses WHERE attribute = 'Soft' ORDER BY 1, 2") == [
        (1, 1, 0), (1, 2, 1), (2, 2, 1), (3, 1, 1), (4, 1, 1),
    ]  # fmt: skip
    assert rows(engine, "SELECT trial, attempts, status FROM trials ORDER BY 1")[:2] == [
        (1, 2, "answered"), (2, 2, "answered"),
    ]  # fmt: skip


def test_an_aborted_session_is_over_but_not_analysed(tmp_path, engine):
    result = ran(tmp_path, "matching", at=4, does={"do": "abort", "text": "felt unwell"})
    assert (result.status, result.complete, result.reason) == ("aborted", False, "aborted")
    ran(tmp_path, "matching", "P002")
    gather(tmp_path, engine)
    ratings = read_ratings(engine, "toy")
    assert sorted(set(ratings.table["participant"])) == ["P002"]
    assert any("aborted after 1 of 4 trials" in line for line in map(str, ratings.exclusions))


def test_a_withdrawn_participant_is_marked_also_afterwards_and_never_analysed(tmp_path, engine):
    ran(tmp_path, "matching")
    ran(tmp_path, "matching", "P002")
    assert gather(tmp_path, engine) == ["new", "new"]
    assert gather(tmp_path, engine, {"P001"}) == ["updated", "unchanged"]
    assert rows(engine, "SELECT participant, status FROM sessions ORDER BY 1") == [
        ("P001", "withdrawn"), ("P002", "complete"),
    ]  # fmt: skip
    ratings = read_ratings(engine, "toy", include_incomplete=True)
    assert sorted(set(ratings.table["participant"])) == ["P002"]


def test_a_confirmation_stands_at_the_start(tmp_path):
    plan = plan_of("matching", needs=[])
    planned = simulated(plan.study, tmp_path)
    confirmed = []

    class Confirming(Meddled):
        def perform(self, request):
            if isinstance(request, Confirm):
                confirmed.append(request)
                return Reply({"measured_mm": 127.0})
            return super().perform(request)

    rig = RigPlan(
        planned.description, planned.check,
        lambda plan, t_ns: Rig(Confirming(planned.open(plan, t_ns).world, 0, None), lambda: None),
        calibration={"px_per_mm": 3.6},
    )  # fmt: skip
    assert start(tmp_path, plan, rig).complete and len(confirmed) == 1
    assert ledger_path(tmp_path, "toy", "P001").exists()
