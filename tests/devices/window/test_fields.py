import pytest

from palpate.devices.window.fields import Writing, place_at, shown, step, view
from palpate.protocols.forms import Lexicon
from tests.devices.window.screens.pages import Hand, fonts


def written(*acts, many_lines=True):
    writing = Writing(many_lines=many_lines)
    for act in acts:
        if act in ("backspace", "delete"):
            getattr(writing, act)()
        elif act in ("left", "right", "home", "end"):
            writing.move(act)
        elif act == "enter":
            writing.new_line()
        else:
            writing.insert(act)
    return writing


def test_text_is_written_where_the_caret_stands():
    assert written("heavy", "home", "very ", "end", "!", "left", "delete", "enter", "x").text == "very heavy\nx"


def test_home_and_end_go_to_the_ends_of_the_line():
    assert written("ab", "enter", "cd", "home", "-", "end", "+").text == "ab\n-cd+"


def test_a_letter_with_its_marks_is_one_step_and_one_deletion():
    assert written("कि", "x", "left", "left", "y").text == "yकिx"
    assert written("aकि", "backspace").text == "a"
    assert written("हिन्दी", "home", "delete").text == "न्दी"


def test_loose_letters_are_composed_as_they_come():
    writing = written("ᄒ", "ᅡ", "ᆫ")
    assert (writing.text, writing.caret) == ("한", 1)
    assert written("e", "\u0301").text == "é"


def test_controls_are_not_written_and_a_field_of_one_line_stays_one():
    assert written("a\tb\r\nc\x08", "enter", "d", many_lines=False).text == "abcd"


def test_a_word_is_not_longer_than_the_ledger_takes():
    writing = Writing()
    assert writing.insert("x" * 200) and not writing.insert("y")
    assert writing.text == "x" * 200


def test_long_lines_are_wrapped_and_the_caret_stays_in_view():
    writing = written("a long line of words that does not fit ", "enter", *["line", "enter"] * 6)
    seen = view(fonts(), writing, 20, 150, 4)
    assert len(seen.lines) == 4 and seen.caret == (3, 0)
    writing.caret = 0
    seen = view(fonts(), writing, 20, 150, 4)
    assert seen.caret == (0, 0) and "".join(seen.lines).startswith("a long line of words that")
    assert all(fonts().width(line.rstrip(), 20) <= 150 for line in seen.lines)


def test_a_single_line_shows_the_part_around_the_caret():
    writing = Writing("0123456789" * 8, 80)
    seen = view(fonts(), writing, 20, 120, 1)
    assert seen.lines[0].endswith("9") and seen.caret[1] <= 120
    writing.caret = 0
    assert view(fonts(), writing, 20, 120, 1).lines[0].startswith("0123")


def test_up_and_down_keep_their_place_across():
    writing = Writing("wwww\nii\nwwww", 3, many_lines=True)
    step(fonts(), writing, 20, 300, 1)
    assert writing.caret == 7
    step(fonts(), writing, 20, 300, 1)
    step(fonts(), writing, 20, 300, 1)
    assert writing.caret in (8, 9)
    writing.caret = 1
    step(fonts(), writing, 20, 300, -1)
    assert writing.caret == 1


@pytest.mark.parametrize(("x", "place"), [(0, 0), (1000, 5), (26, 2)])
def test_a_press_puts_the_caret_between_the_nearest_letters(x, place):
    seen = view(fonts(), Writing("nnnnn", 0), 20, 300, 1)
    assert place_at(fonts(), seen, 20, 0, x) == place


def test_what_no_font_draws_is_recorded_and_shown_as_a_box():
    hand = Hand(Lexicon(1)).type("a\U000e0100x\ue123").key("tab", "enter")
    assert hand.value["answers"]["words"] == ["a\U000e0100x\ue123"]
    assert shown(fonts(), "x\ue123") == "x□"


def test_pressing_in_the_field_of_the_screen_moves_the_caret():
    hand = Hand(Lexicon(1)).type("abcdef\nxyz")
    box = hand.element("words").box
    x, y = box.left + 14, box.top + 20
    from palpate.devices.window.inputs import Pressed, Released

    hand.do(Pressed, x, y).do(Released, x, y).type("0").key("up", "down").tap("next")
    assert hand.value["answers"]["words"] == ["0abcdef", "xyz"]
