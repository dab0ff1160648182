import pytest

from palpate.devices.window.inputs import Pressed
from palpate.protocols.forms import Lexicon, Words
from tests.devices.window.screens.pages import Hand

WORDS = Words(tuple(f"word{n}" for n in range(12)), further=True)


def test_words_are_ticked_and_unticked_and_every_click_is_recorded():
    hand = Hand(WORDS).tap("word 7").tap("word 2").tap("word 7").tap("word 7").tap("next")
    assert hand.value == {
        "answers": {"ticked": ["word2", "word7"], "further": []},
        "clicks": [["word7", 0.1, True], ["word2", 0.3, True], ["word7", 0.5, False], ["word7", 0.7, True]],
        "seconds": 1.0,
    }


def test_a_tick_counts_at_its_press_wherever_the_hand_goes_then():
    hand = Hand(WORDS)
    hand.drag("word 3", 0.1, 0.9).do(Pressed, 640, 20)
    assert hand.screen.ticked == {"word3"}


def test_ticked_words_differ_in_more_than_colour():
    hand = Hand(WORDS).tap("word 0")
    assert [hand.element(f"word {n}").ticked for n in (0, 1)] == [True, False]


def test_arrows_move_through_the_grid_and_stay_inside_it():
    hand = Hand(WORDS)
    columns = hand.screen._columns
    hand.key("down")
    assert hand.screen.focus == "word 0"
    hand.key("right", "down", "space", "left", "up", "up", "space", "end", "right", "space", "home", "left", "space")
    assert [click[0] for click in hand.screen.clicks] == [f"word{columns + 1}", "word0", "word11", "word0"]
    assert [click[2] for click in hand.screen.clicks] == [True, True, True, False]


def test_the_grid_is_one_stop_of_the_keyboard():
    hand = Hand(WORDS, back=True).key("tab", "right")
    assert hand.screen.stops() == ["word 1", "further", "next", "back"]


def test_that_no_word_fits_has_to_be_confirmed():
    hand = Hand(WORDS).tap("next")
    assert hand.screen.reply is None and "no word fits" in hand.text("notice")
    assert hand.tap("next").screen.reply is None, "the second half of a double click says nothing"
    assert hand.wait().tap("next").value["answers"] == {"ticked": [], "further": []}


def test_ticking_takes_the_warning_back():
    hand = Hand(WORDS).tap("next").tap("word 1").tap("word 1").tap("next")
    assert hand.screen.reply is None


def test_further_words_stand_between_commas_and_repetitions_and_blanks_are_dropped():
    hand = Hand(WORDS).tap("further").type("dull, a bit sharp,, dull ;끈적이는").tap("next")
    assert hand.value["answers"] == {"ticked": [], "further": ["dull", "a bit sharp", "끈적이는"]}


def test_space_in_the_field_writes_and_ticks_nothing():
    hand = Hand(WORDS).key("right").tap("further").type("a b").key("enter")
    assert hand.value == {"answers": {"ticked": [], "further": ["a b"]}, "clicks": [], "seconds": pytest.approx(0.8)}


def test_former_answers_are_shown_again():
    hand = Hand(WORDS, previous={"ticked": ["word4"], "further": ["odd", "dull"]}).tap("word 1").tap("next")
    assert hand.value["answers"] == {"ticked": ["word1", "word4"], "further": ["odd", "dull"]}


def test_without_further_words_there_is_no_field():
    hand = Hand(Words(("a", "b"))).tap("word 1")
    assert hand.text("further") is None and hand.tap("next").value["answers"] == {"ticked": ["b"], "further": []}


def test_words_of_ones_own_stand_on_lines_of_their_own():
    hand = Hand(Lexicon(2)).type("smooth\n\n  warm \nsmooth").key("tab", "enter")
    assert hand.value == {"answers": {"words": ["smooth", "warm"]}, "seconds": hand.clock_s}


def test_as_many_different_words_as_are_asked_for_are_demanded():
    hand = Hand(Lexicon(2)).type("warm\nwarm").tap("next")
    assert hand.screen.reply is None and hand.text("notice") == "Please write at least so many different words: 2"
    assert hand.screen.focus == "words"
    assert hand.type("\ncold").tap("next").value["answers"] == {"words": ["warm", "cold"]}


def test_suggestions_may_be_left_empty():
    assert Hand(Lexicon(0, "suggestions")).tap("next").value["answers"] == {"words": []}


def test_backspace_in_a_field_deletes_and_does_not_go_back():
    hand = Hand(Lexicon(1), back=True).type("hot").key("backspace", "backspace", "backspace", "backspace")
    assert hand.screen.reply is None
    assert hand.key("tab", "backspace").value["go"] == "back"
