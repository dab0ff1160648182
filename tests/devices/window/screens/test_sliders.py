import struct

import pytest

from palpate.devices.window.build import screen_for
from palpate.devices.window.inputs import Moved, Pressed, Released
from palpate.protocols.forms import Sliders
from palpate.protocols.study import Attribute
from tests.devices.window.screens.pages import FREE, SIZES, STEPS, Hand, ask, page, sliders


def rows(reply):
    (block,) = reply.samples
    assert (block.stream, block.channels, block.units) == ("marker", ("item", "time", "value"), ("index", "s", "scale"))
    return [tuple(round(x, 3) for x in row) for row in struct.iter_unpack("<3f", block.data)]


def test_there_is_no_marker_before_the_first_touch_and_untouched_is_not_zero():
    hand = Hand(sliders(2, STEPS))
    assert not [element for element in hand.screen.placed() if element.kind == "marker"]
    hand.tap("slider 0", 0.5).tap("next")
    assert hand.screen.reply is None and hand.screen.notice[0] == "Please answer: Flat – not Flat"
    assert hand.tap("slider 1", 0.0).tap("next").value["answers"] == {"Rough": 0.0, "Flat": -10.0}


def test_answers_are_python_numbers_on_the_scale_and_the_reply_has_times_and_counts():
    hand = (
        Hand(sliders(2, STEPS)).tap("slider 1", 0.312).drag("slider 0", 0.0, 0.4, 0.9).tap("slider 0", 0.99).tap("next")
    )
    assert hand.value == {
        "answers": {"Rough": 10.0, "Flat": -4.0},
        "at_s": {"Rough": 0.8, "Flat": 0.2},
        "touches": {"Rough": 2, "Flat": 1},
        "seconds": 1.0,
    }
    assert all(type(answer) is float for answer in hand.value["answers"].values())
    assert rows(hand.screen.reply) == [(1, 0.1, -4), (0, 0.3, -10), (0, 0.4, -2), (0, 0.5, 8), (0, 0.7, 10)]
    assert hand.screen.reply.samples[0].t0_ns == 7


def test_a_press_has_one_owner_and_a_drag_across_other_lines_moves_none_of_them():
    hand = Hand(sliders(4))
    (x, y), (_, last) = hand.point("slider 0", 0.2), hand.point("slider 3", 0.2)
    hand.do(Pressed, x, y)
    for n in range(20):
        hand.do(Moved, x + 5 * n, y + (last - y) * n / 19)
    hand.do(Pressed, *hand.point("slider 2", 0.9)).do(Released, x + 95, last)
    assert list(hand.screen.marks.answers) == ["Rough"]


def test_a_tap_whose_press_and_release_come_together_counts():
    hand = Hand(sliders(1))
    x, y = hand.point("slider 0", 0.25)
    for event in (Pressed(x, y, 1.0), Released(x, y, 1.0)):
        hand.screen.handle(event)
    assert hand.screen.marks.answers == {"Rough": pytest.approx(25, abs=0.2)}


def test_the_whole_band_around_a_line_takes_presses_and_beyond_its_ends_the_end_counts():
    hand = Hand(sliders(2))
    band = hand.element("slider 0").box
    for x, y in ((band.left, band.top), (band.right - 1, band.bottom - 1)):
        hand.do(Pressed, x, y).do(Released, x, y)
        assert hand.screen.marks.answers["Rough"] == (0.0 if x == band.left else 100.0)
    hand.do(Pressed, band.left - 5, band.top).do(Released, band.left - 5, band.top)
    assert hand.screen.marks.touches["Rough"] == 2


@pytest.mark.parametrize("size", SIZES)
def test_a_drag_to_a_share_of_the_line_reads_that_share_within_a_pixel(size):
    hand = Hand(sliders(7), SIZES[size])
    pixel = 100 / (hand.element("slider 3").line.width - 1)
    for percent in range(0, 101):
        hand.drag("slider 3", 0.5, percent / 100)
        assert abs(hand.screen.marks.answers["Hard"] - percent) <= pixel
        marker = hand.element("slider 3").marker
        assert abs(marker.left + marker.width // 2 - round(hand.point("slider 3", percent / 100)[0])) <= 1


def test_keys_alone_answer_everything():
    hand = Hand(sliders(3, STEPS)).key("right", "right", "tab", "left", "pageup", "down", "home")
    assert hand.key("enter").value["answers"] == {"Rough": 1.0, "Flat": 10.0, "Sticky": -10.0}
    assert hand.value["touches"] == {"Rough": 1, "Flat": 1, "Sticky": 1}


def test_the_first_arrow_puts_the_marker_to_the_middle_and_a_free_scale_goes_by_hundredths():
    hand = Hand(sliders(1, FREE)).key("left")
    assert hand.screen.marks.answers == {"Rough": 50.0}
    assert hand.key("left", "pagedown", "right").key("enter").value["answers"] == {"Rough": 40.0}


def test_keys_stay_on_the_scale():
    hand = Hand(sliders(1, STEPS)).key("end", "right", "pageup")
    assert hand.screen.marks.answers == {"Rough": 10.0}


def test_the_focus_goes_round_and_back_and_is_seen_only_when_keys_are_used():
    hand = Hand(sliders(2), back=True)
    for name in ("slider 0", "slider 1", "next", "back", "slider 0"):
        hand.key("tab")
        assert [element.name for element in hand.screen.scene() if getattr(element, "focused", False)] == [name]
    hand.key("tab", shift=True)
    assert hand.screen.focus == "back"
    hand.tap("slider 1")
    assert not [element for element in hand.screen.scene() if getattr(element, "focused", False)]


def test_back_leaves_for_the_trial_before_only_where_it_may():
    assert Hand(sliders(2), back=True).tap("back").value == {"go": "back", "seconds": 0.2}
    assert Hand(sliders(2), back=True).key("backspace").value == {"go": "back", "seconds": 0.1}
    hand = Hand(sliders(2)).key("backspace")
    assert hand.screen.reply is None and "back" not in [element.name for element in hand.screen.scene()]


def test_a_revised_trial_shows_its_former_answers_and_may_be_left_as_it_is():
    hand = Hand(sliders(2, STEPS), previous={"Rough": 3, "Flat": -2}).tap("slider 0", 0.5).tap("next")
    assert hand.value["answers"] == {"Rough": 0.0, "Flat": -2} and hand.value["touches"] == {"Rough": 1}


def test_next_pressed_while_off_goes_to_what_is_missing():
    hand = Hand(sliders(3)).tap("slider 0").tap("next")
    assert hand.screen.focus == "slider 1" and not hand.element("next").on
    assert hand.text("notice") == "Please answer: Flat – not Flat, Sticky – not Sticky"
    assert hand.tap("slider 1").text("notice") is None


def test_a_button_pressed_and_left_does_nothing():
    hand = Hand(sliders(1)).tap("slider 0")
    hand.do(Pressed, *hand.point("next")).do(Moved, 100, 100).do(Released, 100, 100)
    assert hand.screen.reply is None


def test_input_after_the_reply_is_ignored():
    hand = Hand(sliders(1)).tap("slider 0", 0.5).tap("next")
    before = hand.screen.reply
    assert hand.tap("slider 0", 0.9).screen.reply is before


def test_a_form_of_many_sheets_is_answered_sheet_by_sheet_and_turned_back():
    form = Sliders(tuple(Attribute(low=f"a{n}", high=f"b{n}") for n in range(20)), STEPS)
    hand = Hand(form)
    assert hand.tap("next").screen.sheet == 0 and hand.text("label") == f"1 / {hand.screen.sheets}"
    while hand.screen.reply is None:
        for name in [element.name for element in hand.screen.scene() if element.name.startswith("slider")]:
            hand.tap(name, 0.5)
        if hand.screen.sheet == 1:
            hand.tap("back").tap("next")
            assert hand.screen.sheet == 1
        hand.tap("next")
    assert len(hand.value["answers"]) == 20


def test_a_filled_form_shows_a_reply_and_going_back_fills_nothing():
    screen = screen_for(ask(sliders(2)), page(), 0)
    screen.fill({"go": "back", "seconds": 1.0})
    assert not [element for element in screen.placed() if element.kind == "marker"]
    screen.fill({"answers": {"Rough": 10, "Flat": 90}})
    assert len([element for element in screen.placed() if element.kind == "marker"]) == 2


def test_practice_and_progress_are_shown():
    hand = Hand(sliders(1), practice=True)
    assert hand.text("label") == "Practice" and hand.element("progress").share == pytest.approx(2 / 45)


def test_a_drag_ends_where_the_sheet_is_turned():
    hand = Hand(sliders(2, STEPS))
    hand.screen._sheets = [[row] for sheet in hand.screen._sheets for row in sheet]
    hand.screen.lay_out_on(2)
    hand.do(Pressed, *hand.point("slider 0", 0.5)).key("enter").do(Moved, 600, 300).do(Released, 600, 300)
    assert hand.tap("slider 1", 1.0).tap("next").value["answers"] == {"Rough": 0.0, "Flat": 10.0}


def test_what_was_set_before_going_back_goes_on_record():
    assert Hand(sliders(2, STEPS), back=True).tap("back").value.keys() == {"go", "seconds"}
    left = Hand(sliders(2, STEPS), back=True).tap("slider 1", 0.5).tap("back").screen.reply
    assert left.value["go"] == "back" and left.value["so_far"] == {"Flat": 0.0}
    assert rows(left) == [(1, 0.1, 0)]
