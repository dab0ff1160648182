import pytest

from palpate.devices.window.build import page_for, screen_for
from palpate.devices.window.geometry import WindowError
from palpate.devices.window.screens.reading import paragraphs
from palpate.protocols.events import Confirm, Instruct, Rest
from palpate.protocols.forms import Consent
from tests.devices.window.screens.pages import SMALL, Hand, page

LONG = "\n\n".join(
    f"Paragraph {n} says something that goes on for a while, and then some more of it. " * 3 for n in range(9)
)


def reading(text):
    return Hand(Instruct("instructions"), pages={"instructions": text})


def all_text(screen):
    return " ".join(element.text for element in screen.placed() if element.name.startswith("text "))


def test_paragraphs_headings_and_items_are_distinguished():
    text = "# Title\n\nOne\ntwo **bold**.\n\n- first\n  goes on\n- second\n<!-- unseen -->"
    assert [(paragraph.text, paragraph.heading) for paragraph in paragraphs(text)] == [
        ("Title", True), ("One two bold.", False), ("•  first goes on", False), ("•  second", False),
    ]  # fmt: skip


def test_instructions_are_read_page_by_page_and_nothing_of_them_is_lost():
    hand, seen = reading(LONG), []
    assert hand.screen.sheets > 1
    while hand.screen.reply is None:
        seen.append(all_text(hand.screen))
        assert hand.text("label") == f"{hand.screen.sheet + 1} / {hand.screen.sheets}"
        hand.key("enter")
    assert hand.screen.reply.value == {"seconds": round(0.1 * len(seen), 1)}
    assert " ".join(seen).split() == LONG.split()


def test_one_can_leaf_back():
    hand = reading(LONG)
    assert "back" not in [element.name for element in hand.screen.scene()]
    hand.tap("next").tap("back").tap("next").key("backspace")
    assert hand.screen.sheet == 0 and hand.screen.reply is None


def test_a_page_that_the_study_does_not_have_is_an_error():
    with pytest.raises(WindowError, match="no text for the page 'further'"):
        screen_for(Instruct("further"), page(), 0)


def test_consent_can_only_be_given_on_the_last_page_and_not_by_enter_alone():
    hand = Hand(Consent(LONG))
    names = {element.name for element in hand.screen.scene()}
    assert "agree" not in names and "decline" in names
    while hand.screen.sheet < hand.screen.sheets - 1:
        hand.key("enter")
    assert hand.key("enter").screen.reply is None
    assert hand.key("tab", "enter").value["answers"] == {"agreed": True}


def test_a_double_click_on_next_is_no_consent():
    hand = Hand(Consent(LONG))
    while hand.screen.sheet < hand.screen.sheets - 1:
        hand.tap("next")
    assert hand.tap("agree").screen.reply is None
    assert hand.wait().tap("agree").value["answers"] == {"agreed": True}


def test_one_can_decline_on_every_page():
    assert Hand(Consent(LONG)).tap("decline").value["answers"] == {"agreed": False}
    assert Hand(Consent("Short.")).tap("decline").value["answers"] == {"agreed": False}


def test_a_rest_shows_what_is_done_and_ends_when_the_participant_goes_on():
    hand = Hand(Rest(15, 45))
    assert hand.text("done") == "15 of 45 done" and hand.element("bar").share == pytest.approx(1 / 3)
    assert hand.tap("next").screen.reply.value == {"seconds": 0.2}
    assert Hand(Rest(15, 45)).key("enter").screen.reply.value == {"seconds": 0.1}


def test_the_ruler_is_exactly_as_long_as_it_says_and_answers_nothing_itself():
    screen = screen_for(Confirm("calibration"), page(), 0)
    ruler = next(element for element in screen.placed() if element.name == "ruler")
    assert ruler.box.width == SMALL.mm(127.0)
    assert "127\u00a0mm" in next(element.text for element in screen.placed() if element.name == "text")


@pytest.mark.parametrize("key", ["changing_sample", "feel_now", "recording", "pause", "end", "thanks", "aborted"])
def test_waiting_pages_wait(key):
    hand = Hand(Rest(1, 2))
    hand.screen = page_for(key, hand.page)
    assert hand.key("enter", "space", "backspace", "tab").screen.reply is None


def test_a_page_that_there_is_not_is_refused_with_the_nearest():
    with pytest.raises(WindowError, match="did you mean 'recording'"):
        page_for("recordin", page())
