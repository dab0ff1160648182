"""A barcode scanner that types: its burst of keys is a code, a hand's keys are not."""

import pytest

from palpate.devices.desk import Prompt
from palpate.studies.console.desk import ExperimenterDesk
from palpate.studies.console.listening import Heard
from palpate.studies.console.orders import burst
from tests.studies.live.halls import Paper, sheets_plan

MOUNT = Prompt("Put in place: T07", codes=True)


def typed(text, start_s=1.0, gap_s=0.005):
    return [Heard(key, start_s + n * gap_s) for n, key in enumerate(text)]


@pytest.mark.parametrize(
    ("keys", "now_s", "code"),
    [
        (typed("T07\r"), 1.02, ("T07", False)),
        (typed("quiet"), 1.03, (None, True)),
        (typed("quiet"), 1.2, (None, False)),
        (typed("q"), 1.01, (None, True)),
        (typed("q"), 1.1, (None, False)),
        (typed("p\r"), 1.02, (None, False)),
        (typed("T07\r", gap_s=0.2), 1.7, (None, False)),
        (typed("\r"), 1.0, (None, False)),
        (typed("\x1bT07\r"), 1.1, (None, False)),
        ([], 1.0, (None, False)),
    ],
)
def test_a_burst_that_ends_with_enter_is_a_code(keys, now_s, code):
    assert burst(keys, now_s) == code


class Wedge:
    """A terminal whose keys come as they are scripted."""

    def __init__(self, *keys, by_line=False):
        self.pending, self.by_line, self.now_s = list(keys), by_line, 0.0

    def take(self):
        due = [key for key in self.pending if key.t_s <= self.now_s]
        self.pending = [key for key in self.pending if key.t_s > self.now_s]
        return due

    def close(self):
        pass


def asides(desk, wedge, until_s, prompt=MOUNT):
    desk.demand(prompt)
    values = []
    while wedge.now_s < until_s:
        wedge.now_s = round(wedge.now_s + 0.01, 3)
        if (aside := desk.poll()) is not None:
            values.append(aside.value)
    return values


def desk_with_wedge(*keys, by_line=False):
    wedge = Wedge(*keys, by_line=by_line)
    return ExperimenterDesk(sheets_plan(), wedge, Paper(), lambda: wedge.now_s), wedge


def test_a_scanned_code_answers_and_its_letters_order_nothing():
    desk, wedge = desk_with_wedge(*typed("quarp07\r"))
    assert asides(desk, wedge, 2.0) == [] and desk.answer() == "quarp07"


def test_keys_typed_by_hand_still_mean_what_they_mean():
    desk, wedge = desk_with_wedge(*typed("p"), *typed("p", 2.0))
    assert asides(desk, wedge, 3.0) == [{"do": "pause"}, {"do": "pause"}] and desk.answer() is None
    desk, wedge = desk_with_wedge(*typed("\r"))
    asides(desk, wedge, 2.0)
    assert desk.answer() is True


def test_where_no_code_is_asked_for_nothing_is_one():
    desk, wedge = desk_with_wedge(*typed("p07\r"))
    assert asides(desk, wedge, 2.0, Prompt("Put in place: T07")) == [{"do": "pause"}]


def test_once_a_scanner_is_there_a_stray_scan_orders_nothing():
    desk, wedge = desk_with_wedge(*typed("T07\r"), *typed("qap7\r", 3.0), *typed("p", 4.0))
    assert asides(desk, wedge, 2.0) == [] and desk.answer() == "T07"
    assert asides(desk, wedge, 5.0, None) == [{"do": "pause"}], "a hand's key still means what it means"
    assert asides(desk, wedge, 6.0, Prompt("Type what the ruler reads", "number")) == [] and desk.answer() is None


def test_a_line_gives_a_code_too():
    desk, wedge = desk_with_wedge(Heard("scan T12", 0.5), by_line=True)
    asides(desk, wedge, 1.0)
    assert desk.answer() == "T12"
    desk, wedge = desk_with_wedge(Heard("scan", 0.5), by_line=True)
    asides(desk, wedge, 1.0)
    assert desk.answer() is None and any("a scan needs its code" in line for line in desk.display.lines)
