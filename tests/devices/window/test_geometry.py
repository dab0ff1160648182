import pytest

from palpate.devices.window.geometry import Box, Metrics, Placed, WindowError, problems

METRICS = Metrics(1280, 720, 4.0)
TARGET = Placed("a", "target", Box(100, 100, 60, 40))


def only(*placed):
    messages = problems(placed, METRICS)
    assert len(messages) == 1, messages
    return messages[0]


def test_what_stands_apart_has_no_problem():
    inner = Placed("word", "text", Box(105, 105, 50, 30), "word", Box(106, 106, 40, 20), within="a")
    assert problems([TARGET, inner, Placed("b", "target", Box(164, 100, 60, 40))], METRICS) == []


@pytest.mark.parametrize(
    ("placed", "says"),
    [
        ([Placed("a", "mark", Box(1270, 0, 20, 20))], "out of the screen"),
        ([Placed("a", "text", Box(0, 0, 50, 20), "long", Box(0, 0, 52, 20))], "needs"),
        ([Placed("a", "target", Box(0, 0, 60, 25))], "smaller than 8"),
        ([TARGET, Placed("b", "target", Box(162, 100, 60, 40))], "only 2 px apart"),
        ([TARGET, Placed("b", "text", Box(150, 100, 60, 40))], "a overlaps b"),
        ([TARGET, Placed("b", "text", Box(150, 100, 60, 20), within="a")], "partly outside"),
        ([TARGET, Placed("a", "mark", Box(0, 0, 5, 5))], "one name"),
    ],
)
def test_each_fault_of_a_layout_is_found(placed, says):
    assert says in only(*placed)


def test_a_grandchild_lies_in_its_grandparent_without_overlap():
    card, child = Placed("card", "mark", Box(0, 0, 200, 200)), Placed("b", "target", Box(10, 10, 60, 40), within="card")
    assert problems([card, child, Placed("t", "text", Box(12, 12, 20, 20), within="b")], METRICS) == []


def test_targets_and_text_never_shrink_below_what_can_be_pressed_and_read():
    tiny = Metrics(1024, 640, 5.0)
    assert tiny.scale == 0.8 and tiny.unit(8) < tiny.mm(8) <= tiny.target(8)
    assert tiny.text(1) / tiny.px_per_mm >= 4.0


def test_a_screen_too_small_or_a_wrong_calibration_is_refused():
    with pytest.raises(WindowError, match="at least 1024x640"):
        Metrics(800, 600, 4.0)
    with pytest.raises(WindowError, match="calibrate"):
        Metrics(1280, 720, 0.1)
