"""The form after intervals: its words by design, and what the answers are; the pages of intervals and of feedback."""

import pytest

from palpate.devices.window.build import page_for
from palpate.devices.window.geometry import problems
from palpate.devices.window.paint import ACCENT, CARD, GROUND, WARM, contrast
from palpate.devices.window.pictures import picture
from palpate.devices.window.screens.intervals import specimen_of
from palpate.protocols.intervals import MOST_INTERVALS, Intervals
from tests.devices.window.screens.pages import SIZES, Hand, page

DESIGNS = {
    "forced_choice": ({}, "Which one was it?", ("First", "Second"), "2"),
    "yes_no": ({}, "Did you feel it?", ("Yes", "No"), "no"),
    "same_different": ({"standard": 1.0}, "Were the two the same or different?", ("Same", "Different"), "different"),
    "oddity": ({"standard": 1.0}, "Which one was different?", ("First", "Second", "Third"), "2"),
}


def hand(sure=False, language="en", **settings):
    return Hand(specimen_of(Intervals(**settings), sure=sure).request, language=language)


def labels(on):
    buttons = sorted(element.name for element in on.screen.scene() if " option " in element.name)
    return tuple(on.text(f"{name}.text") for name in buttons)


@pytest.mark.parametrize("design", DESIGNS)
def test_each_design_has_its_question_and_its_words_and_stores_its_answers(design):
    settings, question, words, second = DESIGNS[design]
    on = hand(design=design, **settings)
    assert on.text("question 0 text") == question and labels(on) == words
    assert on.type("2").value["answers"] == {"chosen": second}


def test_both_at_once_are_left_and_right():
    on = hand(at_once=True)
    assert labels(on) == ("Left", "Right") and on.tap("question 0 option 1").value["answers"] == {"chosen": "2"}
    assert labels(hand(language="ko", at_once=True)) == ("왼쪽", "오른쪽")


def test_two_may_be_equal():
    on = hand(at_once=True, equal=True)
    assert labels(on) == ("Left", "Right", "No difference") and on.type("3").value["answers"] == {"chosen": "equal"}


def test_the_study_may_name_the_answers():
    on = hand(design="yes_no", names=("felt", "not felt"))
    assert labels(on) == ("felt", "not felt") and on.type("1").value["answers"] == {"chosen": "yes"}


def test_confidence_is_asked_below_with_words_of_its_own():
    on = hand(sure=True)
    texts = (on.text("question 1 text"), on.text("question 1 low"), on.text("question 1 high"))
    assert texts == ("How sure are you?", "Just a guess", "Completely sure")
    assert on.type("1").type("4").key("enter").value["answers"] == {"chosen": "1", "sure": 4}


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("sure", [False, True])
def test_every_design_fits_on_every_screen(size, sure):
    settings = [{"design": design, **more[0]} for design, more in DESIGNS.items()]
    settings += [
        {"count": MOST_INTERVALS},
        {"at_once": True},
        {"equal": True},
        {"names": ("A", "the one that was rougher")},
    ]
    for one in settings:
        on = Hand(specimen_of(Intervals(**one), sure=sure).request, SIZES[size])
        assert problems(on.key("right").screen.placed(), SIZES[size]) == [], one


@pytest.mark.parametrize("size", SIZES)
def test_pages_of_intervals_differ_in_the_number_alone(size):
    on = page(SIZES[size])
    scenes = [page_for(f"interval {n}", on).scene() for n in range(1, MOST_INTERVALS + 1)]
    assert (
        len({scene[0] for scene in scenes}) == 1 and len({(scene[1].box, scene[1].laid.size) for scene in scenes}) == 1
    )
    assert [scene[1].laid.text for scene in scenes] == [str(n) for n in range(1, MOST_INTERVALS + 1)]
    assert problems(page_for("interval 8", on).placed(), on.metrics) == []


def test_right_and_wrong_differ_in_form_in_word_and_in_brightness():
    on = page()
    right, wrong = (page_for(key, on) for key in ("right_answer", "wrong_answer"))
    texts = [next(one.text for one in screen.placed() if one.name == "word") for screen in (right, wrong)]
    assert texts == ["Correct", "Not correct"]
    sign = right.scene()[0].box
    corner = sign.left + sign.width // 2, sign.top + sign.height // 8  # inside the disc, beside its sign
    assert [picture(screen, on).getpixel(corner) for screen in (right, wrong)] == [ACCENT, CARD]
    assert contrast(WARM, GROUND) > 6 and contrast(ACCENT, GROUND) > 6
