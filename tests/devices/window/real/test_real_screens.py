import pytest

from tests.devices.window.real.forms import FORMS, REQUESTS, ask, keys_for

pytestmark = pytest.mark.needs("psychopy", "xvfb")

PAGES = [
    "pause", "changing_sample", "feel_now", "recording", "end", "thanks", "aborted", "interval 1", "right_answer",
    "wrong_answer",
]  # fmt: skip
ANSWERED = sorted(set(REQUESTS) - {"confirm"})


@pytest.mark.parametrize("name", sorted(REQUESTS))
def test_every_screen_stands_on_the_display_as_it_was_painted_and_nothing_overlaps(theatre, name):
    theatre.put_on(REQUESTS[name])
    shown, painted, wrong = theatre.picture()
    theatre.leave()

    assert shown.tobytes() == painted.tobytes()
    assert wrong == []
    assert len(set(shown.resize((64, 36)).getdata())) > 8


@pytest.mark.parametrize("key", PAGES)
def test_every_page_stands_on_the_display_as_it_was_painted(theatre, key):
    theatre.stage.send_message("wait for", key)
    theatre.stage.wait_for_message("shown")
    shown, painted, wrong = theatre.picture()
    theatre.stage.send_message("ready")

    assert theatre.stage.result() is None
    assert shown.tobytes() == painted.tobytes()
    assert wrong == []


@pytest.mark.parametrize("name", ANSWERED)
def test_every_screen_is_answered_with_the_keyboard_alone(theatre, name):
    theatre.put_on(REQUESTS[name])
    theatre.keys(*keys_for(name))
    reply = theatre.stage.result()

    if name in FORMS:
        REQUESTS[name].demand_answer(reply)
    assert reply.value["seconds"] >= 0


def test_what_is_answered_is_drawn(theatre):
    theatre.put_on(ask("sliders"))
    before, _, _ = theatre.picture()
    theatre.keys(("right",), ("down",), ("right",))
    after, painted, wrong = theatre.picture()
    theatre.leave()

    assert after.tobytes() == painted.tobytes() != before.tobytes()
    assert wrong == []


def test_a_filled_form_is_shown_for_a_moment(theatre):
    from palpate.protocols.events import Reply

    theatre.put_on(ask("sliders"))
    empty, _, _ = theatre.picture()
    theatre.leave()
    answers = dict.fromkeys(FORMS["sliders"].items(), 5)
    theatre.stage.send_message("show answered", ask("sliders"), Reply({"answers": answers, "seconds": 2.0}), 0.6)
    theatre.stage.wait_for_message("shown")
    filled, painted, wrong = theatre.picture()

    assert theatre.stage.result() is None
    assert filled.tobytes() == painted.tobytes() != empty.tobytes()
    assert wrong == []
