from collections import deque
from itertools import pairwise

import pytest

from palpate.devices.window.geometry import WindowError
from palpate.devices.window.inputs import Key, Moved, Pressed, Released
from palpate.devices.window.presenter_window import END_AT_DESK_S, END_S, WindowPresenter
from palpate.protocols.events import Aside, Ask, Confirm, Present, Reply, Rest
from palpate.protocols.forms import Sliders
from palpate.protocols.study import Attribute, Scale, Stimulus
from palpate.protocols.trial import Trial
from tests.devices.window.shells_for_tests import FRAME_S, SIZE, FakeDesk, FakeShell, page

FORM = Sliders((Attribute(low="Smooth", high="Rough"),), Scale(low=0, high=100, step=1))
SIDED = Sliders(FORM.attributes, FORM.scale, sides=("real", "virtual"))
PAGE = page()
NOTE, PAUSE, GO_ON = (Aside({"do": "note", "text": "coughs"}), Aside({"do": "pause"}), Aside({"do": "go_on"}))
AGAIN = Aside({"do": "repeat", "which": "this"})


def ask(form=FORM):
    return Ask(form, Trial(1, "main", False, Stimulus(id="T01"), form, False, False))


@pytest.fixture
def shell():
    return FakeShell()


@pytest.fixture
def window(shell):
    return WindowPresenter(shell, PAGE, {"size_px": list(SIZE)})


def box_of(window, request, name):
    """Where an element of the request's screen stands; the request is left unanswered."""
    window.perform(request, FakeDesk({2: NOTE}), window.shell.now_ns)
    return next(element.box for element in window.request_scene.screen.placed() if element.name == name)


def press_at(box, share=0.5):
    x, y = box.left + share * (box.width - 1), box.middle[1]
    return [Pressed(x, y, 0.0), Released(x, y, 0.0)]


def answered(window, request=None):
    """Inputs that answer the form of one line with 50 and go on."""
    request = request or ask()
    line = box_of(window, request, "slider 0.line")
    return request, [press_at(line), [Key("enter", False, 0.0)]]


def test_a_request_is_shown_and_its_answer_comes_back(window, shell):
    request, inputs = answered(window)
    shell.turns.extend(inputs)

    reply = window.perform(request, FakeDesk(), shell.now_ns)

    request.demand_answer(reply)
    assert reply.value["answers"] == {"Smooth": 50}
    assert window.request is None


def test_nothing_is_drawn_while_nothing_changes(window, shell):
    window.perform(ask(), FakeDesk({200: NOTE}), shell.now_ns)

    assert len(shell.shown) == 1
    assert shell.rests > 100


def test_only_the_boxes_that_changed_are_uploaded_after_the_first_time(window, shell):
    request, inputs = answered(window)
    shell.turns.extend(inputs[:1])
    window.perform(request, FakeDesk({4: NOTE}), shell.now_ns)

    first, second = shell.shown[0][1], shell.shown[1][1]
    assert [(box.left, box.top, box.width, box.height) for box in first] == [(0, 0, *SIZE)]
    assert sum(box.width * box.height for box in second) < SIZE[0] * SIZE[1] / 4


def test_what_was_done_to_the_screen_before_is_not_handed_on(window, shell):
    request, inputs = answered(window)
    shell.turns.extend([*inputs, press_at(box_of(window, ask(), "slider 0.line"))])
    window.perform(request, FakeDesk(), shell.now_ns)
    before = shell.forgotten

    window.perform(ask(), FakeDesk({2: NOTE}), shell.now_ns)

    assert shell.forgotten == before + 1


def test_the_release_of_a_press_from_another_screen_is_ignored(window, shell):
    request, _ = answered(window)
    line = box_of(window, request, "slider 0.line")
    shell.turns.append([Moved(*line.middle, 0.0), Released(*line.middle, 0.0)])

    window.perform(request, FakeDesk({3: NOTE}), shell.now_ns)

    assert window.request_scene.screen.value()["answers"] == {}


def test_samples_are_counted_in_session_time_from_the_moment_the_screen_was_seen(window, shell):
    request, inputs = answered(window)
    seen_ns = shell.now_ns() - round(window.request_scene.since_s() * 1e9)
    shell.turns.extend(inputs)

    reply = window.perform(request, FakeDesk(), shell.now_ns)

    assert reply.samples[0].t0_ns == pytest.approx(seen_ns, abs=1000)


def test_an_aside_comes_back_at_once_and_the_form_keeps_its_state(window, shell):
    request, inputs = answered(window)
    shell.turns.extend(inputs[:1])
    desk = FakeDesk({3: NOTE})

    assert window.perform(request, desk, shell.now_ns) == NOTE
    shell.turns.extend(inputs[1:])
    assert window.perform(request, desk, shell.now_ns).value["answers"] == {"Smooth": 50}


def test_time_paused_does_not_count_and_the_page_says_pause_meanwhile(window, shell):
    request, inputs = answered(window)
    desk = FakeDesk({1: PAUSE, 1001: GO_ON})
    before = window.request_scene.seconds()

    assert window.perform(request, desk, shell.now_ns) == PAUSE
    assert window.perform(request, desk, shell.now_ns) == GO_ON
    assert [status["window"] for status in desk.statuses] == ["pause"]
    shell.turns.extend(inputs)
    reply = window.perform(request, desk, shell.now_ns)

    assert desk.statuses[-1] == {"window": "sliders"}
    assert reply.value["seconds"] == pytest.approx(before + 4 * FRAME_S, abs=3 * FRAME_S)


def test_what_is_done_on_the_pause_page_reaches_nobody(window, shell):
    request, inputs = answered(window)
    desk = FakeDesk({1: PAUSE, 50: GO_ON, 100: NOTE})

    window.perform(request, desk, shell.now_ns)
    shell.turns.extend([*inputs, *inputs])
    assert window.perform(request, desk, shell.now_ns) == GO_ON
    assert window.perform(request, desk, shell.now_ns) == NOTE
    assert window.request_scene.screen.value()["answers"] == {}


def test_a_drag_that_a_pause_cuts_off_ends_where_it_was(window, shell):
    request = ask()
    line = box_of(window, request, "slider 0.line")
    x, y = line.left + 0.25 * (line.width - 1), line.middle[1]
    shell.turns.append([Pressed(*line.middle, 0.0), Moved(x, y, 0.0)])
    desk = FakeDesk({3: PAUSE, 6: GO_ON, 9: NOTE})
    for _ in range(3):
        window.perform(request, desk, shell.now_ns)

    assert window.request_scene.screen.value()["answers"] == {"Smooth": 25}
    shell.turns.append([Moved(*line.middle, 0.0), Released(*line.middle, 0.0)])
    window.perform(request, FakeDesk({3: NOTE}), shell.now_ns)
    assert window.request_scene.screen.value()["answers"] == {"Smooth": 25}


def test_a_pause_outlasts_a_repeated_trial(window, shell):
    desk = FakeDesk({1: PAUSE, 3: AGAIN, 5: NOTE})
    first = ask()
    assert [window.perform(first, desk, shell.now_ns) for _ in range(2)] == [PAUSE, AGAIN]

    assert window.perform(ask(), desk, shell.now_ns) == NOTE
    assert window.on.name == "pause"


RESTS, GOES_ON = (Aside({"do": do, "by": "participant"}) for do in ("pause", "go_on"))


def test_the_participant_rests_by_a_button_and_goes_on_with_the_form_as_it_was(shell):
    window = WindowPresenter(shell, page(may_rest=True), {})
    request, inputs = answered(window)
    rest = box_of(window, request, "rest")
    shell.turns.extend([inputs[0], press_at(rest), [], [Key("enter", False, 0.0)]])
    desk = FakeDesk()

    assert window.perform(request, desk, shell.now_ns) == RESTS
    assert window.perform(request, desk, shell.now_ns) == GOES_ON
    shell.turns.extend(inputs[1:])
    assert window.perform(request, desk, shell.now_ns).value["answers"] == {"Smooth": 50}
    assert [status["window"] for status in desk.statuses] == ["resting", "sliders"]


def test_the_experimenter_ends_a_rest_and_a_pause_of_theirs_is_not_the_participants_to_end(shell):
    window = WindowPresenter(shell, page(may_rest=True), {})
    request = ask()
    rest = press_at(box_of(window, request, "rest"))
    shell.turns.extend([rest, [], [], [Key("enter", False, 0.0)]])
    desk = FakeDesk({3: PAUSE, 9: GO_ON})
    assert [window.perform(request, desk, shell.now_ns) for _ in range(3)] == [RESTS, PAUSE, GO_ON]

    shell.turns.append(rest)
    desk = FakeDesk({6: GO_ON, 8: NOTE})
    assert [window.perform(request, desk, shell.now_ns) for _ in range(3)] == [RESTS, GO_ON, NOTE]
    assert window.on.name == "sliders"


def test_there_is_no_button_to_rest_unless_the_study_offers_it(window, shell):
    window.perform(ask(), FakeDesk({2: NOTE}), shell.now_ns)
    assert "rest" not in {element.name for element in window.request_scene.screen.placed()}


def test_a_step_of_setting_up_is_confirmed_at_the_desk_while_the_participant_waits(window, shell):
    desk = FakeDesk(answers=deque([True]))
    reply = window.perform(Confirm("setup 1", "Plates of 5 mm."), desk, shell.now_ns)
    assert reply.value == {"confirmed": True} and desk.demands[0].text == "Setup 1: Plates of 5 mm."
    assert desk.demands[-1] is None


def test_a_new_request_object_gets_a_new_form(window, shell):
    first, inputs = answered(window)
    shell.turns.extend(inputs[:1])
    assert window.perform(first, FakeDesk({3: AGAIN}), shell.now_ns) == AGAIN

    window.perform(ask(), FakeDesk({3: NOTE}), shell.now_ns)
    assert window.request_scene.screen.value()["answers"] == {}


def test_the_sides_switched_to_are_reported(window, shell):
    switched = []
    window.on_side = switched.append
    request = ask(SIDED)
    window.perform(request, FakeDesk({3: NOTE}), shell.now_ns)
    names = {element.name: element.box for element in window.request_scene.screen.placed() if element.kind == "target"}
    sides = [box for name, box in names.items() if name.startswith("side")]
    shell.turns.extend([press_at(box) for box in (*sides, sides[0])])
    window.perform(request, FakeDesk({9: NOTE}), shell.now_ns)

    assert switched[0] is not None
    assert set(switched) == {"real", "virtual"}
    assert all(one != other for one, other in pairwise(switched))


def test_a_page_is_waited_on_until_something_else_is_ready(window, shell):
    looks = []

    def ready():
        looks.append(window.on.name if window.on is not None else None)
        return len(looks) > 3

    assert window.wait_for("feel_now", FakeDesk(), ready) is None
    assert looks == [None, "feel_now", "feel_now", "feel_now"]


def test_while_paused_a_page_is_not_asked_whether_it_is_over(window, shell):
    desk = FakeDesk({1: PAUSE, 9: GO_ON})
    assert window.wait_for("recording", desk, lambda: False) == PAUSE

    assert window.wait_for("recording", desk, lambda: pytest.fail("asked while paused")) == GO_ON
    assert window.wait_for("recording", desk, lambda: True) is None


def test_an_unknown_page_is_named(window):
    with pytest.raises(WindowError, match="feel_nov.*feel_now"):
        window.wait_for("feel_nov", FakeDesk(), lambda: False)


def test_the_ruler_confirms_the_calibration(window, shell):
    desk = FakeDesk(answers=deque([None, None, 126.8]))

    reply = window.perform(Confirm("calibration"), desk, shell.now_ns)

    assert reply == Reply({"measured_mm": 126.8, "nominal_mm": 127.0})
    assert desk.demands[0].kind == "number"
    assert desk.demands[0].default == 127.0
    assert desk.demands[-1] is None


def test_a_slip_of_the_ruler_is_asked_again_once(window, shell):
    desk = FakeDesk(answers=deque([12.7, 127.0]))

    assert window.perform(Confirm("calibration"), desk, shell.now_ns).value["measured_mm"] == 127.0
    assert "12.7 mm is not 127: measure once more" in desk.demands[-2].text


def test_a_line_that_is_too_long_twice_ends_the_run_and_says_what_to_do(window, shell):
    desk = FakeDesk(answers=deque([130.0, 130.2]))

    with pytest.raises(WindowError, match="measures 130.2 mm.*palpate window calibrate"):
        window.perform(Confirm("calibration"), desk, shell.now_ns)


def test_the_demand_for_the_ruler_goes_with_the_session(window, shell):
    desk = FakeDesk({5: Aside({"do": "abort", "text": "ill"})})

    window.perform(Confirm("calibration"), desk, shell.now_ns)

    assert desk.demands[-1] is None


def test_a_filled_form_is_shown_for_its_moment_and_hears_nobody(window, shell):
    request = ask()
    _, inputs = answered(window, request)
    shell.turns.extend(inputs)
    start_s = shell.now_s()

    assert window.show_answered(ask(), Reply({"answers": {"Smooth": 80}}), 0.4, FakeDesk()) is None

    assert shell.now_s() - start_s == pytest.approx(0.4, abs=0.05)
    assert len(shell.shown) == 2


def test_a_note_does_not_prolong_the_moment(window, shell):
    request, desk, start_s = ask(), FakeDesk({10: NOTE}), shell.now_s()
    reply = Reply({"answers": {"Smooth": 80}})

    assert window.show_answered(request, reply, 0.4, desk) == NOTE
    assert window.show_answered(request, reply, 0.4, desk) is None
    assert shell.now_s() - start_s == pytest.approx(0.4, abs=0.05)


def test_the_last_page_stays_until_the_experimenter_says_so(window, shell):
    desk, start_s = FakeDesk(answers=deque([None, True])), shell.now_s()

    window.finish(desk)

    assert window.on.name == "end"
    assert shell.now_s() - start_s < 1.0
    assert [demand is None for demand in desk.demands] == [False, True]


@pytest.mark.parametrize(("desk", "seconds"), [(None, END_S), (FakeDesk(), END_AT_DESK_S)])
def test_the_last_page_does_not_stay_for_ever(window, shell, desk, seconds):
    start_s = shell.now_s()

    window.finish(desk, "thanks")

    assert shell.now_s() - start_s == pytest.approx(seconds, abs=0.1)
    assert window.on.name == "thanks"


def test_an_interruption_passes_through(window, shell):
    class Interrupted(BaseException):
        pass

    class Leaving(FakeDesk):
        def poll(self):
            raise Interrupted

    with pytest.raises(Interrupted):
        window.perform(Rest(3, 9), Leaving(), shell.now_ns)
    window.close()
    assert shell.closed


def live():
    """A door that is felt, with a form of one line that it follows."""
    form = Sliders(FORM.attributes, FORM.scale, tries=True, live=True, shows_force=True)
    return Present(Trial(1, "main", False, Stimulus(id="T01"), form, False, False), {"Smooth": 20.0})


def test_a_live_form_says_where_its_line_stands_until_something_else_is_ready(window, shell):
    seen, looks = [], iter(range(60))
    window.force_of = lambda setting: [setting["Smooth"]] * 621
    window.show_live(live(), FakeDesk({2: NOTE}), lambda: False, lambda *_: None)
    line = next(element.box for element in window.request_scene.screen.placed() if element.name == "slider 0.line")
    shell.turns.extend([press_at(line, 0.75)])
    request = window.request

    moved = lambda setting, done: seen.append((setting["Smooth"], done))  # noqa: E731
    assert window.show_live(request, FakeDesk(), lambda: next(looks) >= 50, moved) is None

    assert seen[0] == (20.0, False) and seen[-1] == (75.0, False)
    assert any(element.name.startswith("force") for element in window.request_scene.screen.scene())


def test_stop_on_a_live_form_is_reported_once_it_is_pressed(window, shell):
    seen, request = [], live()
    shell.turns.extend([[Key("enter", False, 0.0)]])
    window.show_live(request, FakeDesk(), lambda: seen[-1] or len(seen) > 50, lambda _setting, done: seen.append(done))
    assert seen[0] is False and seen[-1] is True


def test_a_live_form_waits_while_the_session_is_paused(window):
    request, ready = live(), []
    assert window.show_live(request, FakeDesk({1: PAUSE}), lambda: False, lambda *_: None) == PAUSE
    assert window.show_live(request, FakeDesk({9: GO_ON}), lambda: ready.append(1) or True, lambda *_: None) == GO_ON
    assert ready == []
