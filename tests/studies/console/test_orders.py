"""What keys and lines mean, and what is refused with a hint."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.devices.desk import Prompt
from palpate.protocols.canonical import canonical
from palpate.protocols.events import NS, Aside, Event
from palpate.protocols.study import Console
from palpate.studies.console.desk import ExperimenterDesk
from palpate.studies.console.orders import IDLE, LONGEST_NOTE, Entry, Order, OrderError, order_of, press
from palpate.studies.sessions.interrupts import Interrupted
from tests.studies.live.halls import Paper, Script, Time, sheets_plan

MOUNT, MEASURE = Prompt("Put in place: T07"), Prompt("How long is the line?", "number", 127.0)


def typed(keys, entry=IDLE, demand=None, paused=False):
    """The orders that the keys give."""
    orders = []
    for key in keys:
        pressed = press(entry, key, demand, paused)
        entry = pressed.entry
        if pressed.order is not None:
            orders.append(pressed.order)
    return orders, entry


@pytest.mark.parametrize(
    ("line", "order"),
    [
        ("confirm", Order("confirm")),
        ("  GO   on ", Order("go on")),
        ("repeat last", Order("repeat last")),
        ("repeat block", Order("repeat block")),
        ("note  the fan, again: 3 dB ", Order("note", "the fan, again: 3 dB")),
        ("abort", Order("abort")),
        ("abort felt unwell", Order("abort", "felt unwell")),
        ("126,8", Order("number", number=126.8)),
    ],
)
def test_a_line_is_an_order(line, order):
    assert order_of(line) == order


@pytest.mark.parametrize("line", ["pasue", "nan", "inf", "note", "note   ", "repeat again", "confirm it"])
def test_a_line_that_is_no_order_names_what_is(line):
    with pytest.raises(OrderError):
        order_of(line)
    if line == "pasue":
        with pytest.raises(OrderError, match="pause"):
            order_of(line)


def test_a_note_is_typed_with_corrections_and_ended_by_enter():
    orders, entry = typed("nfaan\x7f\x7fn, 한글\r")
    assert orders == [Order("note", "fan, 한글")] and entry == IDLE
    assert typed("nqr") == ([], Entry("note", "qr")), "letters of a note are no keys"
    assert typed("nabc\x1b") == ([], IDLE)


def test_only_the_word_abort_aborts():
    assert typed("a\r")[0] == [] and typed("ay\r")[0] == []
    assert typed("aabort\r")[0] == [Order("abort")]
    assert typed("aabort felt unwell\r")[0] == [Order("abort", "felt unwell")]


def test_a_block_is_repeated_only_by_its_word():
    assert typed("B\r")[0] == [] and typed("Br\r")[0] == [] and typed("Bblock\x1b")[0] == []
    assert typed("BBlock \r")[0] == [Order("repeat block")]


@pytest.mark.parametrize("blocks", [True, False])
def test_a_block_is_repeated_only_where_there_are_blocks(blocks):
    order = {"design": "as_listed", **({"within": "block", "blocks": {"by": "size"}} if blocks else {})}
    time = Time(5_000_000_000)
    one = ExperimenterDesk(sheets_plan(order=order), Script(time, [(5.0, "repeat block")], True), Paper(), time.seconds)
    one.watch(Event(0, 0, "trial_started", canonical({"stimulus": "T07", "block": "1"}), 1, 1))
    assert polled(one) == ([{"do": "repeat", "which": "block"}] if blocks else [])
    assert one.view.hint == ("" if blocks else "the study has no blocks to repeat")


def test_digits_are_a_number_only_where_one_is_asked_for():
    assert typed("126.8\r", demand=MEASURE)[0] == [Order("number", number=126.8)]
    assert typed("126.8\r", demand=MOUNT)[0] == [Order("confirm")], "stray digits do not become an answer"
    assert typed("1-2\r", demand=MEASURE)[0] == []


def test_p_pauses_and_goes_on():
    assert typed("p")[0] == [Order("pause")] and typed("p", paused=True)[0] == [Order("go on")]


@given(
    st.text(st.sampled_from("npaqrRBh\r\x1b\x7fab1.-,한 \t\x04"), max_size=60), st.sampled_from([None, MOUNT, MEASURE])
)
def test_no_sequence_of_keys_breaks_the_entry_or_aborts_without_the_word(keys, demand):
    orders, entry = typed(keys, demand=demand)
    assert len(entry.text) <= LONGEST_NOTE
    assert not any(order.do == "abort" for order in orders)
    assert all(order.text for order in orders if order.do == "note")


def desk(orders=(), by_line=False, at_s=0.0):
    time = Time(round(at_s * 1e9))
    return ExperimenterDesk(sheets_plan(), Script(time, orders, by_line), Paper(), time.seconds), time


def polled(one, until_s=10.0):
    """What the desk gives in ten seconds of polling."""
    values = []
    while one.clock() < until_s:
        if (aside := one.poll()) is not None:
            values.append(aside.value)
        one.source.time.t_ns += 100_000_000
    return values


def test_enter_confirms_what_stands_and_nothing_that_comes_later():
    one, time = desk([(0.0, "\r"), (2.0, "\r")])
    assert one.poll() is None and one.view.hint == "nothing to confirm now"
    time.t_ns = round(1.9e9)
    one.demand(MOUNT)
    time.t_ns = round(2.0e9)
    assert one.poll() is None and one.answer() is None, "a second Enter of a hasty hand"
    assert "once more" in one.view.hint


def test_enter_confirms_after_a_moment_and_a_new_demand_asks_anew():
    one, _ = desk([(1.0, "\r")])
    one.demand(MOUNT)
    polled(one)
    assert one.answer() is True
    one.demand(MOUNT)
    assert one.answer() is True, "an equal demand stays as it stands"
    one.demand(None)
    one.demand(MOUNT)
    assert one.answer() is None


def test_a_number_has_a_default():
    one, _ = desk([(1.0, "\r")])
    one.demand(MEASURE)
    polled(one)
    assert one.answer() == 127.0 and type(one.answer()) is float


@pytest.mark.parametrize(("line", "answer"), [("126.4", 126.4), ("confirm", 127.0)])
def test_a_line_that_answers_waits_for_its_demand_and_later_lines_behind_it(line, answer):
    one, time = desk([(0.0, line), (0.0, "note after it")], by_line=True)
    assert one.poll() is None and one.poll() is None
    time.t_ns = 10**9
    one.demand(MEASURE)
    assert one.poll() == Aside({"do": "note", "text": "after it"}) and one.answer() == answer


def test_a_number_is_no_confirmation_and_blank_lines_are_none_either():
    one, _ = desk([(0.0, "127"), (0.0, ""), (0.0, "  ")], by_line=True)
    one.demand(MOUNT)
    polled(one)
    assert one.answer() is None and one.display.lines[-1].startswith("no number is expected")


def test_lines_that_mean_nothing_are_answered_with_what_would():
    one, _ = desk([(0.0, "puase"), (0.0, "pause"), (0.0, "help")], by_line=True)
    assert polled(one) == [{"do": "pause"}]
    assert "pause" in one.display.lines[1] and one.display.lines[-1].startswith("one order a line")


def test_quit_ends_the_run():
    one, _ = desk([(0.0, "q")])
    with pytest.raises(Interrupted, match="QUIT"):
        one.poll()


def test_what_devices_tell_stays_until_it_is_taken_back():
    one, _ = desk()
    one.tell({"door": "idle", "side": "real"})
    one.tell({"side": None, "window": "pause"})
    assert one.view.states == {"door": "idle", "window": "pause"}


def test_what_a_study_keeps_blind_is_in_no_demand_and_no_state():
    one, _ = desk()
    blind = one.plan.study.model_copy(update={"console": Console(blind=("material",))})
    one = ExperimenterDesk(replace(one.plan, study=blind), one.source, Paper(), one.clock)
    stimulus = one.plan.trials[0].stimulus
    one.demand(Prompt(f"{stimulus.id}, {stimulus.columns['material']}: the link is lost. Put it right, then confirm."))
    assert one.view.prompt.text == "…, …: the link is lost. Put it right, then confirm."
    one.tell({"door": f"plays {stimulus.id}", "window": None})
    assert one.view.states == {"door": "plays …"}
    body = canonical({"device": "door", "what": "refused", "message": f"door: {stimulus.id} is too steep"})
    one.watch(Event(9, NS, "fault", body, 1, 1))
    assert one.status.remarks[-1].text == "door went safe: … is too steep"


def test_help_goes_away_with_the_next_key():
    one, _ = desk([(0.0, "h"), (2.0, "x")])
    one.poll()
    assert one.view.help
    polled(one)
    assert not one.view.help and one.view.hint.startswith("'x' means nothing")
