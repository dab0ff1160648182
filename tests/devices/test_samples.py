"""What the experimenter has to mount, in which interval or on which side, and how long each is felt."""

import pytest

from palpate.devices.acts import page_of
from palpate.devices.samples import FeltInIntervals, HandMounted, mounting_for
from palpate.protocols.events import Aside, Ask, Choose, Present, Reply, Sense
from palpate.protocols.plan import compile_plan
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS
from palpate.protocols.trial import ParticipantRow
from tests.devices.stage.seats import Clock, Desk, Window

PAPERS = [{"id": f"P{n}", "columns": {"grit_um": str(n), "position": f"box {n}"}} for n in (60, 120, 180)]
ROWS = {"kind": "constant", "level": {"column": "grit_um", "of": "stimuli"}, "repeats": 2}
WEIGHTS = {"kind": "constant", "level": {"column": "weight_g", "values": [90, 100, 110]}, "repeats": 2}


def presents(intervals, procedure=ROWS, stimuli=PAPERS, index=0):
    """The requests of the first trial that present something, at one level of the grid."""
    data = {"study": "papers", "task": "intervals", "stimuli": stimuli, "intervals": intervals, "procedure": procedure,
            "order": {"design": "as_listed"}, "needs": ["window", "samples"]}  # fmt: skip
    trial = compile_plan(Study.model_validate(data), ParticipantRow("P001")).trials[0]
    steps, requests, reply = TASKS["intervals"].steps(trial), [], None
    while not isinstance(request := steps.send(reply), Ask):
        requests.append(request)
        chosen = isinstance(request, Choose)
        reply = Reply({"index": index, "level": trial.track.levels[index]} if chosen else {})
    return [request for request in requests if isinstance(request, Present)]


def prompts_of(requests, blind=()):
    return [mounting_for(request, blind).text for request in requests]


def test_each_interval_is_named_with_its_sample():
    texts = prompts_of(presents({"standard": "P120"}))
    assert sorted(text[15:] for text in texts) == [
        ": put in place P120 (box 120)", ": put in place P60 (box 60)",
    ]  # fmt: skip
    assert [text[:15] for text in texts] == ["Interval 1 of 2", "Interval 2 of 2"]


def test_an_interval_without_a_stimulus_stays_empty():
    texts = prompts_of(presents({}, WEIGHTS, [{"id": "W"}]))
    assert sorted(text.partition(": ")[2] for text in texts) == ["put in place W, weight_g 90", "put nothing in place"]


@pytest.mark.parametrize(
    ("intervals", "procedure", "stimuli", "sides"),
    [
        ({"standard": "P120", "at_once": True}, ROWS, PAPERS, {"P60 (box 60)", "P120 (box 120)"}),
        ({"standard": 100, "at_once": True}, WEIGHTS, [{"id": "W"}], {"W, weight_g 90", "W, weight_g 100"}),
        ({"at_once": True}, WEIGHTS, [{"id": "W"}], {"W, weight_g 90", "nothing"}),
    ],
)
def test_both_sides_are_told_at_once(intervals, procedure, stimuli, sides):
    [request] = presents(intervals, procedure, stimuli)
    left, right = prompts_of([request])[0].removeprefix("Put in place left: ").split(", right: ")
    assert {left, right} == sides
    assert {1: left, 2: right}[request.part.interval].startswith(request.trial.stimulus.id)


def test_three_at_once_have_places():
    [request] = presents({"design": "oddity", "standard": "P120", "at_once": True})
    assert [f"place {n}: " in prompts_of([request])[0] for n in (1, 2, 3)] == [True] * 3


def test_what_is_blind_is_not_told():
    requests = [*presents({"standard": "P120"}), *presents({"standard": "P120", "at_once": True})]
    assert all(
        "box" in text and "P60" not in text and "P120" not in text for text in prompts_of(requests, ("grit_um",))
    )
    assert all("weight" not in text for text in prompts_of(presents({}, WEIGHTS, [{"id": "W"}]), ("weight_g",)))


def test_the_page_is_the_number_of_the_interval():
    first, second = presents({"standard": "P120"})
    assert [page_of(first), page_of(second)] == ["interval 1", "interval 2"]
    assert page_of(presents({"standard": "P120", "at_once": True})[0]) == "feel_now"
    assert page_of(Sense("tool", 1.0, first.trial)) == "recording"


def performed(request, confirms, asides=()):
    clock, desk = Clock(), Desk(confirms=list(confirms), asides=list(asides))
    window, presenter = Window(clock), FeltInIntervals(HandMounted())
    events = []
    while not events or not isinstance(events[-1], Reply):
        events.append(presenter.perform(request, window, desk, clock))
    return events, window.pages, desk


def test_a_sample_is_mounted_and_then_felt_for_the_seconds_of_the_study():
    request = presents({"standard": "P120", "seconds": 2})[0]
    [reply], pages, desk = performed(request, [3.0])
    assert reply.value == {"presented": True, "by": "experimenter", "seconds": 5.0}
    assert pages == ["changing_sample", "interval 1"] and desk.standing is None and len(desk.demands) == 1


def test_without_seconds_the_experimenter_confirms_that_it_was_felt():
    [reply], pages, desk = performed(presents({"standard": "P120"})[1], [3.0, 4.0])
    assert reply.value["seconds"] == 7.0 and pages == ["changing_sample", "interval 2"]
    assert desk.demands[1] == "Interval 2 of 2: confirm when it was felt"


def test_after_a_note_the_sample_is_not_mounted_again():
    request = presents({"standard": "P120", "seconds": 2})[0]
    clock, desk = Clock(), Desk(confirms=[1.0])
    presenter, window = FeltInIntervals(HandMounted()), Window(clock)
    window.each_turn = lambda: desk.asides.append(NOTE) if clock.t_ns == 2_000_000_000 else None
    assert presenter.perform(request, window, desk, clock) is NOTE and window.pages[-1] == "interval 1"
    assert presenter.perform(request, window, desk, clock).value["seconds"] == 3.0
    assert window.pages.count("changing_sample") == 1


def test_both_at_once_are_felt_while_answering():
    _, pages, _ = performed(presents({"standard": "P120", "at_once": True})[0], [1.0])
    assert pages == ["changing_sample"]


NOTE = Aside({"do": "note", "text": "a fan"})
