from dataclasses import replace

import pytest

from palpate.devices.window.geometry import WindowError
from palpate.protocols.forms import AnchorForm
from palpate.protocols.study import Anchor
from tests.devices.window.screens.pages import STEPS, Hand, sliders

SIMILARITY = sliders(1, sides=("real", "virtual"))
AUTHORING = sliders(2, STEPS, tries=True)


def test_switching_is_counted_and_timed():
    hand = Hand(SIMILARITY)
    assert hand.screen.side is None and hand.text("side told") == "Which one do you feel first?"
    hand.tap("side 0")
    assert hand.screen.side == "real" and hand.text("side told") == "You are feeling: Real"
    hand.tap("side 0").type("2").type("r").type("V").tap("slider 0", 0.5).tap("next")
    assert hand.value["switches"] == [
        {"to": "real", "at_s": 0.2},
        {"to": "virtual", "at_s": 0.5},
        {"to": "real", "at_s": 0.6},
        {"to": "virtual", "at_s": 0.7},
    ]
    assert hand.value["side_s"] == {"real": 0.4, "virtual": 0.5} and hand.value["seconds"] == 1.1


def test_every_side_is_to_be_felt_before_going_on():
    hand = Hand(SIMILARITY).tap("slider 0").tap("side 1").tap("next")
    assert hand.screen.reply is None and hand.text("notice") == "Please feel every side first: Real"
    assert hand.screen.focus == "side 0"
    assert hand.key("enter").screen.side == "real"
    assert hand.tap("next").value["answers"]


def test_whoever_revises_need_not_feel_again():
    assert Hand(SIMILARITY, previous={"Rough": 40.0}).key("enter").value["answers"] == {"Rough": 40.0}


def test_sides_are_switched_by_the_focus_as_well_and_three_of_them_fit():
    hand = Hand(sliders(1, sides=("real", "virtual", "vague"))).key("tab", "space", "tab", "space", "tab", "space")
    assert [switch["to"] for switch in hand.screen.switching.switches] == ["real", "virtual", "vague"]
    assert hand.type("v").screen.side == "vague"  # two sides begin with v: the letter means neither


def test_done_is_off_before_the_first_try():
    hand = Hand(AUTHORING).tap("slider 0", 0.9).tap("try")
    assert hand.screen.reply is None and hand.text("notice") == "Please answer: Flat – not Flat"
    hand.tap("slider 1", 0.1).tap("next")
    assert hand.screen.reply is None and hand.text("notice") == "Please try it at least once."
    assert hand.tap("try").value == {
        "go": "try",
        "answers": {"Rough": 8.0, "Flat": -8.0},
        "at_s": {"Rough": 0.2, "Flat": 0.6},
        "touches": {"Rough": 1, "Flat": 1},
        "seconds": 1.0,
    }


def test_after_a_try_the_setting_is_shown_and_can_be_settled_or_changed_and_tried_again():
    tried = {"Rough": 8, "Flat": -8}
    assert "go" not in Hand(AUTHORING, former=tried).tap("next").value
    assert "go" not in Hand(AUTHORING, former=tried).key("enter").value
    changed = Hand(AUTHORING, former=tried).tap("slider 0", 0.5).key("enter").value
    assert changed["go"] == "try" and changed["answers"] == {"Rough": 0.0, "Flat": -8}


@pytest.mark.parametrize("key", ["t", "T", "ㅅ"])
def test_the_key_t_tries_whatever_the_keyboard_writes(key):
    assert Hand(AUTHORING, former={"Rough": 8, "Flat": -8}).type(key).value["go"] == "try"


def test_a_setting_of_many_lines_is_tried_on_its_last_sheet():
    many = sliders(8, STEPS, tries=True)
    many = replace(many, attributes=tuple(replace_low(a, n) for n, a in enumerate(many.attributes * 3)))
    hand = Hand(many)
    while hand.screen.reply is None:
        last = hand.screen.sheet == hand.screen.sheets - 1
        assert ("try" in [element.name for element in hand.screen.scene()]) == last
        for name in [element.name for element in hand.screen.scene() if element.name.startswith("slider")]:
            hand.tap(name)
        hand.tap("try" if last else "next")
    assert len(hand.value["answers"]) == 24


def replace_low(attribute, n):
    return attribute.model_copy(update={"low": f"{attribute.low} {n}"})


def test_a_reference_is_felt_before_going_on_and_as_often_as_wished():
    form = AnchorForm(Anchor(id="a", label="This is 0 of Soft."), "main", 1, 2)
    hand = Hand(form, former={"felt": 0}).tap("next")
    assert hand.screen.reply is None and hand.text("notice") == "Please feel it first."
    assert hand.key("enter").value == {"go": "try", "answers": {"felt": 0}, "seconds": 0.3}
    assert Hand(form, former={"felt": 1}).type("t").value["go"] == "try"
    assert Hand(form, former={"felt": 2}).key("enter").value == {"answers": {"felt": 2}, "seconds": 0.1}


def test_a_label_that_takes_more_than_a_screen_is_refused_before_the_session():
    form = AnchorForm(Anchor(id="light", label="A door. " * 400), "main", 1, 2)
    with pytest.raises(WindowError, match="label of anchor light takes more than one screen"):
        Hand(form, former={"felt": 0})
