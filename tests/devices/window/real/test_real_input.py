import random

import pytest

from benchmarks.window.screens import lost_answers
from palpate.protocols.events import Aside, Ask
from tests.devices.window.real.forms import FORMS, KOREAN, SCALE, ask, trial_of

pytestmark = pytest.mark.needs("psychopy", "xvfb")

FORM = FORMS["sliders"]
NAMES = FORM.items()


def at(placed, row, value):
    """Where a value of the scale stands on a line."""
    line = placed[f"slider {row}.line"].box
    return line.left + round((value - SCALE.low) / (SCALE.high - SCALE.low) * (line.width - 1)), line.middle[1]


def answered(theatre):
    """The reply once Next is pressed by hand."""
    theatre.hand.click(*theatre.stage.placed()["next"].box.middle)
    return theatre.stage.result().value


def fill(theatre, placed, value=0):
    for row in range(len(NAMES)):
        theatre.hand.tap(*at(placed, row, value))


def test_a_tap_shorter_than_a_frame_counts(theatre):
    placed = theatre.put_on(ask("sliders"))
    for row in range(len(NAMES)):
        theatre.hand.tap(*at(placed, row, row - 3))

    assert answered(theatre)["answers"] == {name: row - 3 for row, name in enumerate(NAMES)}


def test_a_drag_moves_its_own_marker_and_none_that_it_crosses(theatre):
    placed = theatre.put_on(ask("sliders"))
    fill(theatre, placed)
    theatre.hand.drag([at(placed, 0, -10), *(at(placed, row, 10) for row in range(1, 7)), at(placed, 6, 7)])
    value = answered(theatre)

    assert value["answers"] == {NAMES[0]: 7, **dict.fromkeys(NAMES[1:], 0)}
    assert value["touches"] == {NAMES[0]: 2, **dict.fromkeys(NAMES[1:], 1)}


def test_a_drag_that_leaves_the_line_stays_on_it_and_ends_at_its_end(theatre):
    placed = theatre.put_on(ask("sliders"))
    fill(theatre, placed)
    x, y = at(placed, 2, 3)
    theatre.hand.drag([(x, y), (1279, y), (1279, 719)])

    assert answered(theatre)["answers"][NAMES[2]] == 10


def test_another_button_neither_answers_nor_ends_a_drag(theatre):
    placed = theatre.put_on(ask("sliders"))
    fill(theatre, placed)
    theatre.hand.move(*at(placed, 1, -8))
    for button in (2, 3):
        theatre.hand.press(button)
        theatre.hand.release(button)
    theatre.hand.move(*at(placed, 3, -5))
    theatre.hand.press()
    theatre.hand.press(3)
    theatre.hand.move(*at(placed, 4, 5))
    theatre.hand.release(3)
    theatre.hand.move(*at(placed, 4, 9))
    theatre.hand.release()

    assert answered(theatre)["answers"] == {**dict.fromkeys(NAMES, 0), NAMES[3]: 9}


def test_the_wheel_does_nothing(theatre):
    placed = theatre.put_on(ask("sliders"))
    fill(theatre, placed)
    theatre.hand.move(*at(placed, 1, -8))
    for button in (4, 5):
        theatre.hand.press(button)
        theatre.hand.release(button)

    assert set(answered(theatre)["answers"].values()) == {0}


def test_every_movement_of_the_marker_is_in_the_record(theatre):
    placed = theatre.put_on(ask("sliders"))
    fill(theatre, placed)
    theatre.hand.drag([at(placed, 0, value) for value in range(0, 11)])
    theatre.hand.click(*theatre.stage.placed()["next"].box.middle)
    [block] = theatre.stage.result().samples

    assert block.channels == ("item", "time", "value")
    assert block.count == len(NAMES) + 10


def test_next_stays_off_until_every_line_is_answered_and_says_which_is_not(theatre):
    placed = theatre.put_on(ask("sliders"))
    for row in range(len(NAMES) - 1):
        theatre.hand.tap(*at(placed, row, 1))
    theatre.hand.click(*placed["next"].box.middle)
    texts = [element.text for element in theatre.stage.look()["placed"] if "Luxurious" in element.text]
    theatre.hand.tap(*at(placed, len(NAMES) - 1, 1))

    assert any(text.startswith("Please answer") for text in texts)
    assert len(answered(theatre)["answers"]) == len(NAMES)


def test_back_leaves_the_trial_by_mouse_and_by_key(theatre):
    theatre.put_on(ask("sliders", back=True))
    theatre.hand.click(*theatre.stage.placed()["back"].box.middle)
    by_mouse = theatre.stage.result()
    theatre.put_on(ask("sliders", back=True))
    theatre.hand.key("backspace")
    by_key = theatre.stage.result()

    assert {by_mouse.value["go"], by_key.value["go"]} == {"back"}


def test_back_is_not_to_be_had_where_the_trial_does_not_allow_it(theatre):
    placed = theatre.put_on(ask("sliders"))
    theatre.hand.key("backspace")
    theatre.stage.look()
    theatre.leave()

    assert "back" not in placed


def test_former_answers_are_shown_and_stand_until_they_are_changed(theatre):
    former = dict.fromkeys(NAMES, -4)
    theatre.put_on(Ask(FORM, trial_of(FORM), former))

    assert answered(theatre)["answers"] == former


def test_a_held_backspace_does_not_run_on_into_the_next_screen(theatre):
    theatre.put_on(ask("sliders", back=True))
    code = theatre.hand.display.keysym_to_keycode(0xFF08)
    theatre.hand.hold(code)
    theatre.stage.result()
    placed = theatre.put_on(ask("lexicon"))
    theatre.hand.key("a")
    theatre.hand.key("b")
    theatre.until(lambda: theatre.stage.look()["seconds"] > 1.5)
    theatre.hand.let_go(code)
    theatre.keys(("enter",), ("c",), ("tab",), ("enter",))

    assert "words" in placed
    assert theatre.stage.result().value["answers"] == {"words": ["ab", "c"]}


def test_an_arrow_that_is_held_goes_on_and_on(theatre):
    theatre.put_on(ask("sliders"))
    theatre.hand.key("home")
    code = theatre.hand.display.keysym_to_keycode(0xFF53)
    theatre.hand.hold(code)
    theatre.until(lambda: theatre.stage.look()["seconds"] > 1.5)
    theatre.hand.let_go(code)
    theatre.keys(*[("down",), ("right",)] * 6, ("enter",))

    assert theatre.stage.result().value["answers"][NAMES[0]] > -8


def test_shift_tab_goes_back_where_tab_went_on(theatre):
    theatre.put_on(ask("sliders"))
    theatre.keys(("tab",), ("tab",), ("tab",), ("shift", "tab"), ("end",))
    theatre.keys(*[("down",), ("home",)] * 6, ("enter",))
    answers = theatre.stage.result().value["answers"]

    assert [name for name, value in answers.items() if value == 10] == [NAMES[1]]


def test_escape_does_nothing(theatre):
    placed = theatre.put_on(ask("sliders"))
    fill(theatre, placed, 2)
    theatre.hand.key("escape")

    assert set(answered(theatre)["answers"].values()) == {2}


def test_korean_and_accented_words_are_typed_and_recorded(theatre):
    theatre.put_on(ask("lexicon"))
    theatre.hand.type(KOREAN[0])
    theatre.hand.key("enter")
    theatre.hand.type(KOREAN[1] + "é")
    shown, painted, wrong = theatre.picture()
    theatre.keys(("tab",), ("enter",))

    assert theatre.stage.result().value["answers"] == {"words": [KOREAN[0], KOREAN[1] + "é"]}
    assert shown.tobytes() == painted.tobytes()
    assert wrong == []


def test_the_sides_that_are_switched_to_are_counted_timed_and_reported(theatre):
    placed = theatre.put_on(ask("similarity"))
    for side in ("side 0", "side 1", "side 0"):
        theatre.hand.click(*placed[side].box.middle)
    sides = theatre.stage.look()["sides"]
    theatre.hand.key("1")
    theatre.hand.click(*placed["slider 0.line"].box.middle)
    value = answered(theatre)

    assert sides == ["real", "virtual", "real"]
    assert [switch["to"] for switch in value["switches"]] == sides
    assert sum(value["side_s"].values()) <= value["seconds"]


def test_authoring_is_tried_before_it_is_done(theatre):
    placed = theatre.put_on(ask("authoring"))
    for row in range(len(NAMES)):
        theatre.hand.tap(*placed[f"slider {row}.line"].box.middle)
    theatre.hand.click(*placed["next"].box.middle)
    theatre.hand.click(*placed["try"].box.middle)
    tried = theatre.stage.result().value
    theatre.put_on(Ask(FORMS["authoring"], trial_of(FORMS["authoring"]), tried["answers"]))
    done = answered(theatre)

    assert tried["go"] == "try"
    assert "go" not in done
    assert done["answers"] == tried["answers"]


@pytest.mark.parametrize("seed", [11, 12])
def test_of_generated_gestures_none_is_lost(theatre, seed):
    assert lost_answers(theatre.stage, theatre.hand, 125, random.Random(seed).randrange(1000)) == 0


def test_an_aside_leaves_the_form_as_it_was(theatre):
    placed = theatre.put_on(ask("sliders"))
    fill(theatre, placed, 3)
    theatre.stage.look()
    theatre.stage.send_message("aside", {"do": "note", "text": "coughs"})
    assert theatre.stage.result() == Aside({"do": "note", "text": "coughs"})
    theatre.stage.send_message("perform again")

    assert set(answered(theatre)["answers"].values()) == {3}
