"""Cards that are put in order: dragged, or moved by keys; what was felt has its place before anything else is felt."""

from dataclasses import replace

import pytest

from palpate.devices.window.geometry import problems
from palpate.devices.window.inputs import Moved, Pressed, Released
from palpate.protocols.events import Ask
from palpate.protocols.study import Attribute, Stimulus
from palpate.protocols.tasks.ranking import MOST, Ranking
from palpate.protocols.trial import Trial
from tests.devices.window.screens.pages import SIZES, Hand

ROUGH = Attribute(low="Smooth", high="Rough", explanation="How rough it is.")
FOUR = Ranking(("s", "t", "u", "v"), ROUGH)


def ranks(*order):
    """The stimuli from the first place to the last; those that are left out have none."""
    return {name: order.index(name) + 1 if name in order else 0 for name in FOUR.stimuli}


def hand(*order, form=FOUR, **more):
    return Hand(form, previous=ranks(*order), **more)


def order_of(on):
    return [name for name in sorted(on.screen.shown, key=on.screen.ranks.get) if on.screen.ranks[name]]


def drag(on, card, *where):
    """Drag a card over the middles of elements, to the last."""
    on.do(Pressed, *on.point(card))
    points = [on.point(name) for name in where]
    for point in points:
        on.do(Moved, *point)
    return on.do(Released, *points[-1])


def test_the_first_card_is_placed_before_the_next_is_felt():
    on = Hand(FOUR)
    assert on.text("told") == "1 of 4 felt.   Where does A belong?" and on.text("next.text") == "Feel the next"
    on.tap("next")
    assert on.screen.reply is None and on.text("notice") == "Please put it in its place: A"
    drag(on, "card 0", "place 1").tap("next")
    assert on.value == {
        "go": "try", "feel": "t", "answers": ranks("s"), "moves": [["s", 1, 0.5]], "seconds": 0.7,
    }  # fmt: skip


def test_a_card_is_dragged_among_the_others_which_make_room():
    on = hand("s", "u", form=replace(FOUR, stimuli=("s", "u", "t", "v")))
    drag(on, "card 2", "place 4", "place 1", "place 2")
    assert order_of(on) == ["s", "t", "u"]
    drag(on, "card 0", "place 2", "place 3")
    assert order_of(on) == ["t", "u", "s"]
    assert on.tap("next").value["answers"] == ranks("t", "u", "s")


def test_a_new_card_let_go_beside_the_row_lies_where_it_lay_and_another_stays_in_the_row():
    on = hand("s", "t")
    drag(on, "card 2", "place 1", "prompt")
    assert order_of(on) == ["s", "t"] and on.screen.ranks["u"] == 0 and not on.screen.moves
    drag(on, "card 0", "place 2", "prompt")
    assert order_of(on) == ["t", "s"]


def test_a_tap_chooses_a_card_and_a_tap_on_a_free_place_puts_the_new_one_at_the_end():
    on = hand("s", "t").tap("card 1")
    assert on.screen.chosen_card == "t" and order_of(on) == ["s", "t"] and on.text("again.text") == "Feel B again"
    on.tap("place 4")
    assert order_of(on) == ["s", "t", "u"] and not on.screen.missing()


def test_everything_is_done_with_the_keyboard_alone():
    on = hand("s", "t").key("left")
    assert order_of(on) == ["u", "s", "t"] and on.screen.focus == "card 2"
    on.key("right", "right", "right")
    assert order_of(on) == ["s", "t", "u"]
    on.key("tab", "tab", "tab", "tab")
    on.screen.focus = "card 0"
    assert order_of(on.key("end")) == ["t", "u", "s"] and order_of(on.key("left", "home")) == ["s", "t", "u"]
    assert on.key("enter").value["feel"] == "v"
    assert hand("s", "t").key("right").key("enter").value["answers"] == ranks("s", "t", "u")


def test_the_chosen_card_is_felt_again_by_button_or_key_placed_or_not():
    assert hand("s", "t").tap("again").value | {"moves": []} == {
        "go": "try", "feel": "u", "answers": ranks("s", "t"), "moves": [], "seconds": 0.2,
    }  # fmt: skip
    assert hand("s", "t").tap("card 0").type("T").value["feel"] == "s"
    assert hand("t", "s", "u", "v").key("tab").type("ㅅ").value["feel"] == "t"


def test_where_nothing_is_felt_again_there_is_no_button():
    on = hand("s", form=replace(FOUR, again=False)).type("t")
    assert on.screen.reply is None and "again" not in {element.name for element in on.screen.scene()}
    assert "T: feel" not in on.text("hint")


def test_the_last_of_a_set_ends_the_trial():
    on = hand("s", "t", "u")
    assert on.text("next.text") == "Next" and on.text("told") == "4 of 4 felt.   Where does D belong?"
    on.key("home")
    assert on.text("told") == "4 of 4 felt.   Change the order until it is right."
    assert on.key("enter").value == {
        "answers": ranks("v", "s", "t", "u"), "moves": [["v", 1, 0.1]], "seconds": 0.2,
    }  # fmt: skip


def test_whoever_revises_sees_the_order_and_may_leave_it_so():
    assert hand("v", "u", "t", "s", back=True).key("enter").value["answers"] == ranks("v", "u", "t", "s")
    assert hand("v", "u", "t", "s", back=True).key("backspace").value["so_far"] == ranks("v", "u", "t", "s")


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("count", [2, MOST])
def test_the_smallest_and_the_largest_set_fit_on_every_screen(size, count):
    attribute = Attribute(
        low="Extraordinarily uncomfortable", high="Disproportionately comfortable",
        explanation="How much the movement of the door, from the first pull to the stop, asked of your arm.",
    )  # fmt: skip
    stimuli = tuple(Stimulus(id=f"s{n}") for n in range(count))
    form = Ranking(tuple(stimulus.id for stimulus in stimuli), attribute)
    trial = Trial(3, "1", True, stimuli[0], form, may_go_back=True, rest_before=False, stimuli=stimuli)
    every = size == next(iter(SIZES))  # the smallest: there each number of placed cards, elsewhere few, half and all
    for placed in range(count + 1) if every else sorted({0, 1, count // 2, count - 1, count}):
        on = Hand(
            Ask(form, trial, {s.id: n if n <= placed else 0 for n, s in enumerate(stimuli, start=1)}), SIZES[size]
        )
        assert problems(on.screen.placed(), SIZES[size]) == []
        if placed < count:
            assert problems(on.key("home").screen.placed(), SIZES[size]) == []
