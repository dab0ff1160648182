from itertools import count

import pytest

from palpate.devices.window.inputs import Key, Moved, Pressed, Released, Typed
from palpate.devices.window.shell_ears import Ears, Keys

LEFT, MIDDLE, RIGHT = 1, 2, 4
TAB, ENTER, ARROW, ESCAPE = 65289, 65293, 65363, 65307
KEYS = Keys({TAB: "tab", ENTER: "enter"}, {7: "right", 8: "backspace"}, {ARROW: "right", 65288: "backspace"})


@pytest.fixture
def ears():
    seconds = count()
    return Ears((200, 100), KEYS, lambda: float(next(seconds)))


def kinds(ears):
    return [type(event) for event in ears.hand_over()]


def test_a_press_and_its_release_between_two_looks_are_both_noticed(ears):
    ears.press(30, 99, LEFT, 0)
    ears.release(31, 99, LEFT, 0)

    assert ears.hand_over() == [Pressed(30, 0, 0.0), Released(31, 0, 1.0)]
    assert ears.hand_over() == []


def test_pixels_are_counted_from_the_top(ears):
    ears.press(0, 0, LEFT, 0)

    assert ears.hand_over()[0].y == 99


def test_only_the_left_button_is_input(ears):
    for button in (MIDDLE, RIGHT):
        ears.press(5, 5, button, 0)
        ears.drag(6, 5, 1, 0, button, 0)
        ears.release(6, 5, button, 0)

    assert ears.hand_over() == []


def test_another_button_while_the_left_is_held_changes_nothing(ears):
    ears.press(5, 5, LEFT, 0)
    ears.press(9, 9, RIGHT, 0)
    ears.drag(20, 5, 15, 0, LEFT | RIGHT, 0)
    ears.release(20, 5, RIGHT, 0)
    ears.drag(25, 5, 5, 0, LEFT, 0)
    ears.release(25, 5, LEFT, 0)

    assert kinds(ears) == [Pressed, Moved, Moved, Released]


def test_a_second_press_while_one_is_held_is_ignored(ears):
    ears.press(5, 5, LEFT, 0)
    ears.press(50, 50, LEFT, 0)

    assert [(type(event), event.x) for event in ears.hand_over()] == [(Pressed, 5)]


@pytest.mark.parametrize("after", ["motion", "drag of the right button"])
def test_a_release_that_the_system_swallowed_is_added(ears, after):
    ears.press(5, 5, LEFT, 0)
    if after == "motion":
        ears.motion(60, 5, 1, 0)
    else:
        ears.drag(60, 5, 1, 0, RIGHT, 0)
    ears.press(7, 7, LEFT, 0)

    assert kinds(ears) == [Pressed, Released, Pressed]


def test_moving_without_a_button_is_no_input(ears):
    ears.motion(60, 5, 1, 0)

    assert ears.hand_over() == []


def test_an_arrow_is_noted_once_for_each_repeat_and_knows_the_shift_key(ears):
    ears.key(ARROW, 0)
    ears.repeating(7)
    ears.repeating(7)
    ears.repeating_with_shift(7)

    assert [(event.name, event.shift) for event in ears.hand_over()] == [("right", False)] * 2 + [("right", True)]


def test_a_key_held_from_the_screen_before_repeats_for_nobody_until_it_is_pressed_again(ears):
    ears.key(65288, 0)
    ears.repeating(8)
    ears.forget()
    ears.repeating(8)
    assert ears.hand_over() == []

    ears.key_up(65288, 0)
    ears.key(65288, 0)
    ears.repeating(8)
    assert ears.hand_over() == [Key("backspace", False, 1.0)]


def test_escape_and_unknown_keys_do_nothing(ears):
    ears.key(ESCAPE, 0)
    ears.key(123456, 0)

    assert ears.hand_over() == []


def test_composed_text_is_input_and_control_characters_are_not(ears):
    for text in ("한", " ", "é", "\r", "\t", "\x7f"):
        ears.text(text)

    assert [event.text for event in ears.hand_over() if isinstance(event, Typed)] == ["한", " ", "é"]


def test_another_size_is_trouble_that_says_what_to_do(ears):
    ears.resized(200, 100)
    assert ears.trouble is None

    ears.resized(400, 100)
    assert "opened at 200x100 px and now has 400x100" in ears.trouble
    assert "palpate resume" in ears.trouble


def test_every_handler_keeps_the_event_from_psychopys_own(ears):
    arguments = {
        "on_mouse_press": (1, 1, LEFT, 0), "on_mouse_release": (1, 1, LEFT, 0), "on_mouse_drag": (1, 1, 1, 1, LEFT, 0),
        "on_mouse_motion": (1, 1, 1, 1), "on_key_press": (TAB, 0), "on_key_release": (TAB, 0), "on_text": ("a",),
        "on_text_motion": (7,), "on_text_motion_select": (7,), "on_resize": (200, 100), "on_mouse_scroll": (1, 1, 0, 1),
        "on_mouse_enter": (1, 1), "on_mouse_leave": (1, 1), "on_move": (1, 1),
    }  # fmt: skip

    assert {name: handler(*arguments.get(name, ())) for name, handler in ears.handlers().items()} == dict.fromkeys(
        ears.handlers(), True
    )
    assert "on_close" in ears.handlers()
