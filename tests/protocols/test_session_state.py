"""The fold of a session's events: which attempt counts, what is open, what comes next, as the runner itself has it."""

from contextlib import suppress

import pytest

from palpate.protocols.canonical import canonical
from palpate.protocols.event_shapes import EventShapes
from palpate.protocols.events import NS, Aside, Ask, Event, Fault, Reply, Sense
from palpate.protocols.runner import BROKEN_OFF, Recorded, run
from palpate.protocols.session_state import Pause, SessionState, active_ns, fold
from palpate.studies.console.status import status_of
from palpate.studies.sessions.tables import answers_of
from tests.protocols.every_task import PARTS
from tests.protocols.random_sessions import ABORT, FAULT, HEADER, Chance, go_on, plan_for, rough_session
from tests.protocols.worlds_for_tests import MemoryLog

SEEDS = (1, 2, 8)
FIRST_EVENTS = 160
"""Of a longer session, whose later trials go as the first ones."""
LAST_IN_A_REVISION = (0, 21)
"""Seeds of sessions in which the last trial is wished again while the present one is being revised."""
OK, TRY, BACK = {}, {"go": "try"}, Reply({"go": "back"})
THIS, LAST = (Aside({"do": "repeat", "which": which}) for which in ("this", "last"))
END = Aside(ABORT)
PLAIN = {"practice": None, "rest": None, "simulation": {"latents": {}, "revise_rate": 0}}
REFERENCES = {"anchors": {"stimuli": [{"id": "A", "label": "This is 0.", "attribute": "Soft", "value": 0}]}}


class Turns:
    """A world in which these turns come, one at each form or recording of a trial."""

    def __init__(self, plan, log, turns):
        self.chance, self.turns, self.log = Chance(plan, log, 0), iter(turns), log

    def now(self):
        return 1_000 * len(self.log.events)

    def perform(self, request):
        if not isinstance(request, Ask | Sense) or self.log.events[-1].trial is None:
            return self.chance.plain(request)
        turn = next(self.turns)
        if isinstance(turn, Reply | Aside | Fault):
            return turn
        reply = self.chance.plain(request)
        answered = {name: value for name, value in reply.value.items() if name != "go"}
        return Reply(answered | turn, reply.samples)


STANDS = {
    "an answer": ("matching", [OK, END], {1: ("answered", 1, 1), 2: ("started", 1, None)}),
    "a recording": ("capture", [OK, END], {1: ("captured", 1, 1), 2: ("started", 1, None)}),
    "left unanswered": ("matching", [OK, BACK, END], {1: ("started", 2, 1), 2: ("left", 1, None)}),
    "left in a revision": ("matching", [OK, OK, BACK, BACK, END],
                           {1: ("started", 2, 1), 2: ("answered", 2, 1), 3: ("left", 1, None)}),
    "revised": ("matching", [OK, BACK, OK, END], {1: ("answered", 2, 2), 2: ("started", 2, None)}),
    "this one again": ("matching", [OK, THIS, END], {1: ("answered", 1, 1), 2: ("started", 2, None)}),
    "this one again, in a revision": ("matching", [OK, BACK, THIS, END],
                                      {1: ("started", 3, None), 2: ("left", 1, None)}),
    "the last one again": ("matching", [OK, LAST, END], {1: ("started", 2, None), 2: ("repeated", 1, None)}),
    "the last one again, in a revision": ("matching", [OK, OK, BACK, LAST, END],
                                          {1: ("started", 2, None), 2: ("answered", 2, 1), 3: ("left", 1, None)}),
    "the last recording again": ("capture", [OK, LAST, END], {1: ("started", 2, None), 2: ("repeated", 1, None)}),
    "the last one again, in the first": ("matching", [LAST, END], {1: ("started", 2, None)}),
    "a fault": ("matching", [FAULT, END], {1: ("started", 2, None)}),
    "a fault in a recording": ("capture", [OK, FAULT, OK, END],
                               {1: ("captured", 1, 1), 2: ("captured", 2, 2), 3: ("started", 1, None)}),
    "a fault in a revision": ("matching", [OK, BACK, FAULT, END], {1: ("started", 3, 1), 2: ("left", 1, None)}),
    "a setting that was tried": ("authoring", [TRY, END], {1: ("started", 1, None)}),
    "a setting that was tried and left so": ("authoring", [TRY, OK, END],
                                             {1: ("answered", 1, 1), 2: ("started", 1, None)}),
}  # fmt: skip


@pytest.mark.parametrize("case", STANDS)
def test_which_attempt_of_a_trial_counts(case):
    task, turns, expected = STANDS[case]
    plan = plan_for(task, 0, **PLAIN)
    events = go_on(plan, [], lambda log: Turns(plan, log, turns))
    state = fold(events)
    counting = {attempt.trial: attempt.number for attempt in state.counting}
    assert {
        number: (trial.status, len(trial.attempts), counting.get(number)) for number, trial in state.trials.items()
    } == expected
    assert status_of(plan, state).done == counting.keys()
    rows = answers_of(plan, "s", events)
    assert {row["trial"]: row["attempt"] for row in rows.responses if row["counts"]} == (
        {} if task == "capture" else counting
    )
    stands = {row["trial"]: (row["status"], row["attempts"]) for row in rows.trials if row["status"] != "not met"}
    assert stands == {number: (status, attempts) for number, (status, attempts, _) in expected.items()}


@pytest.mark.parametrize(("which", "expected"), [(THIS, [1]), (LAST, [])])
def test_what_is_to_be_repeated_does_not_count_before_it_is_repeated(which, expected):
    """The session is aborted in the rest, or killed, before the trial is repeated: the wish is on record."""
    plan = plan_for("matching", 0, **PLAIN)
    events = go_on(plan, [], lambda log: Turns(plan, log, [OK, which, END]))
    wished = next(place for place, event in enumerate(events, start=1) if event.kind == "experimenter")
    for cut in (wished, wished + 1):
        assert [attempt.trial for attempt in fold(events[:cut]).counting] == expected
    statuses = {number: trial.status for number, trial in fold(events[: wished + 1]).trials.items()}
    assert statuses == {1: "answered" if expected else "repeated", 2: "repeated"}


def test_of_a_form_outside_trials_every_answer_counts():
    plan = plan_for("matching", 0, **PLAIN)
    state = fold(go_on(plan, [], lambda log: Turns(plan, log, [OK] * 4)))
    outside = [answer for answer in state.answers if answer.trial is None]
    assert [answer.form for answer in outside] == ["consent", "demographics", "likert", "suggestions"]
    assert all(state.counts(answer) for answer in outside)


class Watched:
    """A world behind a record that answers everything at once, and notes what was performed live and what recorded.

    `goes_back`: the participant first goes back as far as possible, so that every answer of the session is
    shown once more.
    """

    def __init__(self, plan, log, goes_back):
        self.chance, self.log, self.goes_back = Chance(plan, log, 0), log, goes_back
        self.performed, self.shown = [], {}

    def now(self):
        return 1_000 * len(self.log.events)

    def perform(self, request):
        self.performed.append(request)
        if isinstance(request, Ask) and request.trial is not None:
            self.shown.setdefault(request.trial.number, request.previous)
            self.goes_back = self.goes_back and request.may_go_back
            if self.goes_back:
                return Reply({"go": "back"})
        return self.chance.plain(request)


class NextTrialStarted(Exception):
    """The next trial started: the rest is not compared."""


def resume_session(plan, events, goes_back):
    """What a session becomes from here, to its end or to the start of the next trial; and the world that it met."""
    log = MemoryLog(list(events))
    world = Watched(plan, log, goes_back)

    def look(event):
        if event.kind == "trial_started" and not goes_back:
            log.events.append(event)
            raise NextTrialStarted

    log.on_append = look
    tape = Recorded(events, world, log)
    with suppress(NextTrialStarted):
        run(plan, tape, tape, HEADER)
    return log.events[len(events) :], world


def name_of(track):
    return None if track is None else track.name


def demand_what_the_runner_does_next(plan, state, events):
    """The open request is performed again, the trial under way goes on, the trial that comes next starts next."""
    new, world = resume_session(plan, events, goes_back=False)
    if state.ended is not None:
        assert new == []
        return
    aborted = new[0].ended_as == "aborted"
    if state.request is not None:
        request_at = max(place for place, event in enumerate(events) if event.kind == "request")
        if any(event.kind == "samples" for event in events[request_at:]):
            assert new[0].kind == "fault" and new[0].value == BROKEN_OFF.value
        else:
            assert world.performed[0].body() == state.request.value
    if state.current is not None:
        assert aborted or (new[0].trial, new[0].attempt) == (state.current.trial, state.current.number)
    else:
        started = next((event for event in new if event.kind == "trial_started"), None)
        attempts = len(state.trials[state.next_trial].attempts) if state.next_trial in state.trials else 0
        over = {attempt.trial for attempt in state.attempts if attempt.ended_as == "stopped" and not attempt.withdrawn}
        tracks = {trial.track.name for trial in plan.trials if trial.number in over}
        left = [trial.number for trial in plan.trials[state.next_trial - 1 :] if name_of(trial.track) not in tracks]
        assert (started is None) == (not left or aborted)
        assert started is None or started.trial == left[0]
        assert started is None or left[0] != state.next_trial or started.attempt == attempts + 1


@pytest.mark.untraced
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("task", PARTS)
def test_after_every_event_the_state_is_what_the_runner_goes_on_from(task, seed):
    plan = plan_for(task, seed, **(REFERENCES if task == "matching" else {}))
    events = rough_session(plan, seed)[:FIRST_EVENTS]
    state = SessionState()
    for cut, event in enumerate(events, start=1):
        state.apply(event)
        demand_what_the_runner_does_next(plan, state, events[:cut])
    assert state == fold(events)


@pytest.mark.untraced
@pytest.mark.parametrize("seed", LAST_IN_A_REVISION)
@pytest.mark.parametrize("task", ["slider_rating", "free_lexicon"])
def test_after_every_event_the_answers_that_count_are_those_that_the_runner_shows_again(task, seed):
    """A repeated trial shows its answer; without one the stimulus is presented again."""
    plan = plan_for(task, seed, practice=None)
    events = rough_session(plan, seed)
    state, revisions = SessionState(), 0
    for cut, event in enumerate(events, start=1):
        state.apply(event)
        if event.value.get("which") == "last":
            revisions += state.trials[event.trial].answer is not None
        _, world = resume_session(plan, events[:cut], goes_back=True)
        answers = {number: trial.answer.values for number, trial in state.trials.items() if trial.answer is not None}
        assert world.shown == {number: answers.get(number) for number in world.shown}
        if world.shown:
            assert answers.keys() <= world.shown.keys()
    assert revisions


def test_among_the_random_sessions_everything_happens():
    events = [event for task in PARTS for seed in SEEDS for event in rough_session(plan_for(task, seed), seed)]
    done = {(e.value["do"], e.value.get("which")) for e in events if e.kind == "experimenter"}
    assert {
        ("repeat", "this"),
        ("repeat", "last"),
        ("repeat", "block"),
        ("pause", None),
        ("go_on", None),
        ("abort", None),
    } <= done
    assert {e.value["as"] for e in events if e.kind == "trial_ended"} == {
        "answered", "captured", "left", "repeated", "faulted", "stopped",
    }  # fmt: skip
    assert {"samples", "fault"} <= {e.kind for e in events}
    assert any(e.kind == "fault" and e.value == BROKEN_OFF.value for e in events), "killed in a recording"


def test_the_check_of_shapes_folds_what_it_takes():
    events = rough_session(plan_for("matching", 1), 1)
    shapes = EventShapes(fold(events[:1]))
    for event in events[1:]:
        shapes.take(event)
    assert shapes.state == fold(events)


def happened(*events):
    """(t_s, kind, body, trial) each."""
    return [
        Event(seq, round(t_s * NS), kind, canonical(body), trial, None if trial is None else 1)
        for seq, (t_s, kind, body, trial) in enumerate(events)
    ]


def aside(t_s, trial=None, **body):
    return (t_s, "experimenter", body, trial)


def test_a_pause_takes_no_time_and_ends_with_the_session():
    state = fold(happened(aside(10, do="pause"), aside(12, do="pause"), aside(15, do="go_on"), aside(16, do="go_on"),
                          aside(20, do="pause", by="participant")))  # fmt: skip
    assert state.pauses == [Pause(10 * NS, False, 15 * NS), Pause(20 * NS, True)]
    times_s = {5: 5, 10: 10, 12: 10, 15: 10, 18: 13, 20: 15, 99: 15}
    assert {t_s: active_ns(state.pauses, t_s * NS) / NS for t_s in times_s} == times_s
    assert state.pause == state.pauses[-1]
    state.apply(happened((30, "session_ended", {"trials": 4, "as": "aborted"}, None))[0])
    assert state.pause is None and state.ended == "aborted"


@pytest.mark.parametrize(
    ("which", "numbers"), [("this", [5]), ("last", [3]), ("block", [3, 5])], ids=["this", "last", "block"]
)
def test_the_trials_that_are_to_be_repeated_are_those_that_were_begun(which, numbers):
    started = [
        (number, "trial_started", {"stimulus": "A", "block": block}, number)
        for number, block in ((1, "x"), (2, "x"), (3, "y"), (5, "y"))  # 4 was passed over: its track had ended
    ]
    state = fold(happened(*started))
    assert state.repeated_by(happened(aside(9, 5, do="repeat", which=which))[0]) == numbers
    state.apply(happened(aside(9, 5, do="repeat", which=which))[0])
    assert [number for number, trial in state.trials.items() if trial.attempts[-1].withdrawn] == numbers
    assert state.next_trial == numbers[0]


def test_the_first_trial_is_its_own_last():
    state = fold(happened((1, "trial_started", {"stimulus": "A", "block": "x"}, 1)))
    assert state.repeated_by(happened(aside(2, 1, do="repeat", which="last"))[0]) == [1]
