import pytest

from palpate.protocols.forms import Demographics, Eligibility, Interview, Likert, Question
from palpate.protocols.study import Criterion, Item, Questionnaire
from tests.devices.window.screens.pages import Hand

AGE = Question("age", "How old are you?", "number", unit="years", low=0, high=120)
HAND = Question("hand", "Which hand?", "choice", (("left", "Left"), ("right", "Right")))
JOB = Question("job", "What do you do?", "text", optional=False)
PERSON = Demographics((AGE, HAND, JOB))
LIKERT = Likert(Questionnaire(items=tuple(Item(name=n, text=f"It was {n}") for n in ("real", "easy", "clear"))))


def test_numbers_choices_and_texts_are_answered_by_mouse_and_typing():
    hand = (
        Hand(PERSON).tap("question 0 field").type("34").tap("question 1 option 1").tap("question 2 field").type("a  b ")
    )
    assert hand.tap("next").value["answers"] == {"age": 34, "hand": "right", "job": "a b"}
    assert type(hand.value["answers"]["age"]) is int


def test_everything_can_be_answered_by_keys():
    hand = Hand(PERSON).key("tab").type("27").key("tab", "tab", "space", "right", "tab").type("x").key("enter")
    assert hand.value["answers"] == {"age": 27, "hand": "right", "job": "x"}


def test_silence_has_to_be_chosen_and_is_null():
    hand = Hand(PERSON).tap("question 2 field").type("x").tap("next")
    assert hand.screen.reply is None and "How old are you?" in hand.text("notice")
    hand.tap("question 0 none").tap("question 1 none").tap("next")
    assert hand.value["answers"] == {"age": None, "hand": None, "job": "x"}


FIT = Eligibility(
    tuple(
        Criterion.model_validate({"name": name, "text": f"{name}?", "answer": answer})
        for name, answer in (("impaired", "no"), ("right_handed", "yes"))
    )
)


@pytest.mark.parametrize(("options", "eligible"), [((1, 0), True), ((0, 0), False), ((1, 1), False)])
def test_of_eligibility_nothing_leaves_the_screen_but_the_outcome(options, eligible):
    hand = Hand(FIT).tap("next")
    assert hand.screen.reply is None, "every question wants its answer"
    for question, option in enumerate(options):
        hand.tap(f"question {question} option {option}")
    assert set(hand.tap("next").value) == {"answers", "seconds"} and hand.value["answers"] == {"eligible": eligible}
    assert hand.screen.samples() == ()


def test_typing_takes_silence_back_and_what_must_be_answered_offers_none():
    hand = Hand(PERSON).tap("question 0 none").tap("question 0 field").type("5")
    assert "age" not in hand.screen.picked
    assert "question 2 none" not in [element.name for element in hand.screen.scene()]


@pytest.mark.parametrize(
    ("typed", "bounds", "says"),
    [
        ("130", (0, 120), "A number from 0 to 120 is expected."),
        ("old", (0, 120), "A number from 0 to 120 is expected."),
        ("-1", (0, None), "A number from 0 upwards is expected."),
        ("9", (None, 5), "A number up to 5 is expected."),
        ("nan", (None, None), "A number is expected."),
    ],
)
def test_a_wrong_number_is_answered_by_what_is_expected(typed, bounds, says):
    form = Demographics((Question("n", "How many?", "number", low=bounds[0], high=bounds[1]),))
    hand = Hand(form).tap("question 0 field").type(typed).tap("next")
    assert hand.screen.reply is None and hand.text("notice") == f"How many? {says}"


@pytest.mark.parametrize(("typed", "number"), [("7.5", 7.5), ("7,5", 7.5), (" 12 ", 12), ("0", 0)])
def test_numbers_are_read_with_point_or_comma(typed, number):
    assert Hand(Demographics((AGE,))).tap("question 0 field").type(typed).key("enter").value["answers"]["age"] == number


def test_former_answers_fill_the_form():
    hand = Hand(PERSON)
    hand.screen.fill({"answers": {"age": 31, "hand": None, "job": "cook"}})
    assert hand.tap("next").value["answers"] == {"age": 31, "hand": None, "job": "cook"}


def test_statements_are_answered_by_whole_numbers_and_no_number_is_shown():
    hand = Hand(LIKERT).tap("item 0", 0.99).tap("item 1", 0.01).tap("item 2", 0.5).tap("item 1", 0.2).tap("next")
    assert hand.value == {
        "answers": {"real": 7, "easy": 2, "clear": 4},
        "at_s": {"real": 0.1, "easy": 0.7, "clear": 0.5},
        "seconds": 1.0,
    }
    assert not [element.text for element in hand.screen.placed() if any(c.isdigit() for c in element.text)]


def test_statements_are_answered_by_keys_from_the_middle_and_within_the_ends():
    hand = Hand(LIKERT).key("right", "right", "down", "left", "down", "end", "right").key("enter")
    assert hand.value["answers"] == {"real": 5, "easy": 4, "clear": 7}


def test_a_statement_left_out_is_named():
    hand = Hand(LIKERT).tap("item 0").tap("item 2").tap("next")
    assert hand.screen.reply is None and hand.text("notice") == "Please answer: “It was easy”"
    assert hand.screen.focus == "item 1"


def test_a_press_between_two_points_takes_the_nearer_one():
    hand = Hand(LIKERT)
    points = hand.element("item 0")
    between = (points.circles[2].right + points.circles[3].left) // 2
    assert (points.nearest(between - 3), points.nearest(between + 3)) == (2, 3)


@pytest.mark.long
def test_a_question_of_any_length_is_pointed_at_in_as_many_words_as_there_is_room_for():
    long = Question("job", "What do you do on an ordinary day? " * 20, "text", optional=False)
    hand = Hand(Demographics((long,))).tap("next")
    assert hand.screen.reply is None
    assert hand.text("notice").startswith("Please look at: What do you do") and hand.text("notice").endswith("…")


def test_an_interview_is_written_over_several_sheets_and_may_be_left_empty():
    interview = Interview(tuple(Item(name=name, text=f"What of {name}?") for name in ("texture", "noise")))
    hand = Hand(interview).type("It buzzed,\nthen stopped.").tap("next")
    assert hand.screen.reply is None and hand.text("question") == "What of noise?"
    assert hand.tap("next").value["answers"] == {"texture": "It buzzed,\nthen stopped.", "noise": ""}
