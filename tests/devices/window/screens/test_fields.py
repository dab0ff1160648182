"""The composite form: each kind of answer by mouse and by keys, with a time of its own, and what is not answered."""

import pytest

from palpate.devices.window.build import screen_for
from palpate.devices.window.geometry import WindowError, problems
from palpate.devices.window.inputs import Pressed, Released
from palpate.protocols.events import Ask
from palpate.protocols.fields import MOST_FIELDS, MOST_OPTIONS, Fields, questions_from
from tests.devices.window.screens.pages import SIZES, Hand, ask, page

CHOICE = {"kind": "choice", "name": "which", "text": "Which was rougher?", "options": ["first", "second", "alike"]}
SCALE = {"kind": "scale", "name": "nice", "text": "How pleasant?", "from": 0, "to": 10, "step": 1, "ends": ["-", "+"]}
SURE = {"kind": "confidence", "name": "sure"}
NUMBER = {"kind": "number", "name": "strength", "text": "How strong?", "above": 0}
TEXT = {"kind": "text", "name": "like", "text": "What was it like?", "optional": True}


def form(*questions):
    return Fields(questions_from(questions))


def hand(*questions, **more):
    return Hand(form(*questions), SIZES["1920x1080 at 3.6"], **more)


ALL = (CHOICE, SCALE, SURE, NUMBER, TEXT)
ANSWERS = {"which": "second", "nice": 3.0, "sure": 4, "strength": 12.5, "like": "sand"}


def test_every_kind_is_answered_by_mouse_each_with_its_own_time():
    on = hand(*ALL).tap("question 0 option 1").tap("question 1 line", 0.31).tap("question 2 points", 0.9)
    on.tap("question 3 field").type("12,5").tap("question 4 field").type("sand").tap("next")
    assert on.value["answers"] == ANSWERS
    assert on.value["at_s"] == {"which": 0.1, "nice": 0.4, "sure": 0.5, "strength": 1.2, "like": 1.8}
    assert on.value["seconds"] == 2.0


def test_every_kind_is_answered_by_keys_alone():
    on = hand(*ALL).key("right", "right", "tab", "right", "left", "left", "tab", "end", "tab").type("12.5")
    on.key("tab").type("sand").key("tab", "enter")
    assert on.value["answers"] == ANSWERS


def test_a_box_of_number_keys_answers_choices_and_confidence_one_after_the_other():
    on = hand(CHOICE, SURE).type("2").type("3")
    assert on.screen.value()["answers"] == {"which": "second", "sure": 3} and on.screen.reply is None
    on.type("1").type("9").type("0")
    assert on.screen.value()["answers"] == {"which": "second", "sure": 1}, (
        "the last question keeps the focus; 9 and 0 are none"
    )
    assert on.key("enter").value["at_s"] == {"which": 0.1, "sure": 0.3}


def test_a_number_key_goes_on_to_the_field_that_comes_next():
    assert hand(CHOICE, NUMBER).type("1").type("42").key("enter").value["answers"] == {"which": "first", "strength": 42}


def test_a_number_is_typed_by_touch_on_the_keys_below_it():
    on = hand(NUMBER)
    for key in (0, 1, 10, 4, 11, 8):  # 1 2 . 5, back, 9
        on.tap(f"question 0 option {key}")
    assert on.screen.focus == "question 0 field" and on.text("question 0 field.text") == "12.9"
    on.type("1").tap("next")
    assert on.value["answers"] == {"strength": 12.91} and on.value["at_s"] == {"strength": 1.3}
    below = hand({**NUMBER, "above": -5})
    assert below.tap("question 0 option 11").tap("question 0 option 3").tap("next").value["answers"] == {"strength": -4}
    assert "question 3 option 0" not in {element.name for element in hand(*ALL).screen.scene()}


@pytest.mark.parametrize("size", SIZES)
def test_the_keys_of_a_number_fit_on_every_screen(size):
    for questions in ((NUMBER,), (NUMBER, SURE, TEXT), ({**NUMBER, "above": -5},)):
        assert problems(Hand(form(*questions), SIZES[size]).screen.placed(), SIZES[size]) == []


def test_one_choice_alone_is_answered_by_the_press_itself():
    on = hand(CHOICE)
    on.do(Pressed, *on.point("question 0 option 2"))
    assert on.value == {"answers": {"which": "alike"}, "at_s": {"which": 0.1}, "seconds": 0.1}
    assert "next" not in {element.name for element in on.screen.scene()}


@pytest.mark.parametrize(
    ("keys", "typed", "answer"),
    [
        ([], "3", "alike"),
        (["right", "enter"], "", "first"),
        (["left", "space"], "", "alike"),
        (["down", "down", "tab", "up", "enter"], "", "second"),
    ],
)
def test_one_choice_alone_is_answered_by_a_key(keys, typed, answer):
    assert hand(CHOICE).key(*keys).type(typed).value["answers"] == {"which": answer}


def test_a_key_that_is_no_option_answers_nothing():
    on = hand(CHOICE).type("4").type("0").type("x").key("enter", "space", "home", "backspace")
    assert on.screen.reply is None and on.screen.given.at_s == {}


def test_what_is_not_answered_is_named_and_gets_the_focus():
    on = hand(CHOICE, SURE, NUMBER).tap("question 1 points").tap("next")
    assert on.screen.reply is None and on.screen.focus == "question 0 option 0"
    assert on.text("notice") == "Please answer: “Which was rougher?”, “How strong?”"
    assert not on.element("next").on
    assert on.type("1").text("notice") is None


def test_what_is_optional_may_stay_unanswered_and_can_be_taken_back():
    easy = [{**question, "optional": True} for question in (CHOICE, SCALE, SURE, NUMBER, TEXT)]
    on = hand(*easy)
    assert on.text("question 0 optional") == "You may leave this out."
    on.tap("question 0 option 0").tap("question 0 option 0")  # a second press takes it back
    on.tap("question 1 line").key("delete").tap("question 2 points").key("delete").tap("next")
    assert (
        on.value["answers"] == dict.fromkeys(("which", "nice", "sure", "strength", "like")) and on.value["at_s"] == {}
    )
    assert hand({**CHOICE, "optional": True}).tap("next").value["answers"] == {"which": None}


@pytest.mark.parametrize(
    ("bounds", "typed", "says"),
    [
        ({"above": 0}, "0", "A number above 0 is expected."),
        ({"from": 1, "to": 9}, "10", "A number from 1 to 9 is expected."),
        ({"from": 1}, "0", "A number from 1 upwards is expected."),
        ({"to": 5}, "6", "A number up to 5 is expected."),
        ({"optional": True}, "loud", "A number is expected."),
    ],
)
def test_a_wrong_number_is_answered_by_what_is_expected(bounds, typed, says):
    on = hand({"kind": "number", "name": "n", "text": "How many?", **bounds}).type(typed).key("enter")
    assert on.screen.reply is None and on.text("notice") == f"“How many?” {says}"


def test_a_text_has_at_most_as_many_characters_as_the_question_allows():
    short = {**TEXT, "longest": 5, "optional": False}
    assert hand(short).type("abcdefg").key("enter").value["answers"] == {"like": "abcde"}
    assert hand(short).type("   ").key("enter").screen.reply is None


def test_korean_is_written_from_latin_keys_and_numbers_stay_numbers():
    on = hand(NUMBER, {**TEXT, "text": "무엇?"}, language="ko", hangul=True).type("15").key("tab").type("ahfo")
    assert on.key("tab", "enter").value["answers"] == {"strength": 15, "like": "모래"}


def test_a_long_text_has_lines_and_enter_breaks_them():
    assert hand(TEXT).type("a\nb").key("tab", "enter").value["answers"] == {"like": "a\nb"}


def test_arrows_move_between_questions_and_change_what_is_chosen():
    on = hand(CHOICE, SURE, SCALE).key("right", "right", "down", "left", "left", "down", "home", "up")
    assert (
        on.screen.value()["answers"] == {"which": "second", "sure": 3, "nice": 0.0}
        and on.screen.focus == "question 1 points"
    )
    assert on.key("up", "left").screen.value()["answers"]["which"] == "first"


def test_many_questions_are_asked_on_several_sheets_each_to_be_answered_first():
    many = [{**CHOICE, "name": f"q{n}", "text": f"Question {n}?"} for n in range(MOST_FIELDS)]
    on = hand(*many)
    assert on.screen.sheets > 1
    on.tap("next")
    assert on.screen.sheet == 0 and "Question 0?" in on.text("notice")
    for _ in range(on.screen.sheets):
        for _ in on.screen._sheets[on.screen.sheet]:
            on.type("3")
        on.key("enter")
    assert set(on.value["answers"].values()) == {"alike"}


def test_a_form_shows_earlier_answers_and_goes_back_with_those_so_far():
    on = hand(*ALL, back=True, previous=ANSWERS)
    assert on.text("question 3 field.text") == "12.5" and on.element("question 0 option 1").chosen
    assert on.element("question 2 points").at == 3 and on.element("question 1 line").share == 0.3
    assert on.tap("back").value["so_far"] == ANSWERS


def test_a_rehearsal_shows_the_form_as_answered():
    for questions in (ALL, (CHOICE,)):
        screen = screen_for(Ask(form(*questions)), page(), 0)
        screen.fill({"answers": {name: ANSWERS[name] for name in form(*questions).items()}, "at_s": {}})
        assert screen.reply is None and not screen.missing()


def test_a_mark_is_dragged_along_its_line():
    assert hand(SCALE).drag("question 0 line", 0.1, 0.5, 0.8).tap("next").value["answers"] == {"nice": 8.0}


def test_a_release_elsewhere_changes_no_other_answer():
    on = hand(SCALE, SURE)
    on.do(Pressed, *on.point("question 0 line", 0.4)).do(Released, *on.point("question 1 points"))
    assert list(on.screen.given.known) == [0]


def test_a_scale_without_words_shows_its_numbers_and_a_question_without_text_its_name():
    bare = {"kind": "scale", "name": "how_rough", "from": 1, "to": 7}
    on = hand(bare)
    assert (on.text("question 0 text"), on.text("question 0 low"), on.text("question 0 high")) == (
        "how rough",
        "1",
        "7",
    )


def test_words_are_those_of_the_participants_language():
    words = {"Which was rougher?": "어느 쪽?", "second": "둘째"}
    screen = screen_for(ask(form(CHOICE)), page(language="ko", words=words), 0)
    texts = {element.name: element.text for element in screen.placed()}
    assert texts["question 0 text"] == "어느 쪽?" and texts["question 0 option 1.text"] == "둘째"


@pytest.mark.parametrize("size", SIZES)
def test_the_most_questions_and_the_most_options_fit_on_every_screen(size):
    options = [f"the {n}th option" for n in range(MOST_OPTIONS)]
    long = {**CHOICE, "options": options}
    eleven = {"kind": "confidence", "name": "sure", "points": 11}
    for questions in ([long], [long, eleven], [{**CHOICE, "options": ["a", "b" * 20]}], [NUMBER], [TEXT],
                      [{**CHOICE, "name": f"q{n}"} for n in range(MOST_FIELDS)]):  # fmt: skip
        screen = screen_for(ask(form(*questions), back=True), page(SIZES[size], may_rest=True), 0)
        for sheet in range(screen.sheets):
            screen._turn(sheet)
            assert problems(screen.placed(), SIZES[size]) == [], (questions, sheet)


def test_an_option_that_fits_at_no_size_is_refused_by_name():
    for more in ([], [SURE]):
        with pytest.raises(WindowError, match=r"'yyy.* does not fit"):
            screen_for(ask(form({**CHOICE, "options": ["a", "y" * 150]}, *more)), page(), 0)
