import random
from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest
from PIL import Image

from benchmarks.window.gestures import FORM, ROWS, Expected, Gestures
from benchmarks.window.screens import cases, drawn_length_px
from palpate.devices.window.geometry import Box, Placed

NAMES = FORM.items()


@dataclass
class Notes:
    """A hand that only records its calls."""

    done: list = field(default_factory=list)

    def __getattr__(self, name):
        return lambda *arguments: self.done.append((name, arguments))


def reply_to(expected):
    """What a screen answers that lost nothing."""
    return {
        "answers": {NAMES[row]: value for row, value in expected.values.items()},
        "touches": {NAMES[row]: count for row, count in expected.touches.items()},
    }


@pytest.fixture
def expected():
    lines = {row: Box(100, 50 * row, 457, 3) for row in range(ROWS)}
    acts = Gestures(Notes(), lines, random.Random(5))
    kinds = [*acts.all_rows(), *(acts.anything() for _ in range(60))]
    assert {"click", "tap", "drag", "both buttons", "key"} == set(kinds)
    return acts.expected


def test_where_nothing_is_lost_nothing_is_counted(expected):
    assert expected.lost(reply_to(expected)) == 0


def test_a_touch_that_did_not_count_and_a_value_that_is_wrong_are_lost(expected):
    reply = reply_to(expected)
    reply["touches"][NAMES[3]] -= 1
    reply["answers"][NAMES[5]] = 99

    assert expected.lost(reply) == 2


def test_a_line_that_was_never_answered_is_lost(expected):
    reply = reply_to(expected)
    del reply["answers"][NAMES[0]], reply["touches"][NAMES[0]]

    assert expected.lost(reply) == expected.touches[0] + 1


def test_keys_in_a_row_are_one_touch_and_stay_on_the_scale():
    expected = Expected()
    expected.put(2, 1)
    for name in ("left", "left", "pagedown"):
        expected.key(name)

    assert (expected.values, expected.touches) == ({2: 0}, {2: 2})


@pytest.mark.parametrize(("edge", "length"), [(255, 300.0), (0, 301.0), (127.5, 300.5)])
def test_the_drawn_length_is_that_of_the_ink(edge, length):
    display = Image.new("L", (500, 40), 255)
    display.paste(0, (100, 20, 400, 23))
    display.paste(round(edge), (400, 20, 401, 23))
    hand = SimpleNamespace(picture=lambda x, y, w, h: display.crop((x, y, x + w, y + h)).convert("RGB"))

    assert drawn_length_px(hand, Placed("slider 0.line", "mark", Box(100, 20, 300, 3))) == pytest.approx(
        length, abs=0.01
    )


def test_where_no_display_can_be_had_the_cases_are_left_out_by_name(monkeypatch, capsys):
    monkeypatch.setenv("PATH", "")

    assert list(cases(quick=True)) == []
    assert "window: left out, for want of Xvfb" in capsys.readouterr().err
