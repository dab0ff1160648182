"""Whatever is done to a screen: no answer is lost, and no reply is one that the protocol refuses."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices.window.build import screen_for
from palpate.devices.window.inputs import Key, Moved, Pressed, Released, Typed
from palpate.devices.window.screens.specimens import RATED, specimens
from palpate.protocols.events import Ask
from palpate.protocols.forms import Likert, Sliders
from palpate.protocols.study import Attribute, Item, Questionnaire, Scale
from tests.devices.window.screens.pages import ask, page
from tests.examples import examples

KEYS = ("left", "right", "up", "down", "home", "end", "pageup", "pagedown", "tab", "enter", "space", "backspace",
        "delete", "escape")  # fmt: skip
PAGE = page(pages={"instructions": "Read."})
LINES = Sliders(
    tuple(Attribute(low=f"low {n}", high=f"high {n}", explanation=f"What {n} means. " * 9) for n in range(9)), RATED
)
STATEMENTS = Likert(
    Questionnaire(items=tuple(Item(name=f"i{n}", text=f"So {n}. " * 40) for n in range(9)), ends=("-", "+"))
)
FORMS = {name: specimen.request for name, specimen in specimens().items() if isinstance(specimen.request, Ask)} | {
    "lines on several sheets": ask(LINES),
    "statements on several sheets": ask(STATEMENTS),
}
SPOTS = st.integers(0, 400)
ACTS = st.one_of(
    st.tuples(st.just("tap"), SPOTS, st.floats(0, 1)),
    st.tuples(st.just("drag"), SPOTS, st.floats(0, 1)),
    st.tuples(st.just("press"), st.integers(0, 1279), st.integers(0, 719)),
    st.tuples(st.just("move"), st.integers(-50, 1400), st.integers(-50, 800)),
    st.tuples(st.just("release"), st.integers(-50, 1400), st.integers(-50, 800)),
    st.tuples(st.just("key"), st.sampled_from(KEYS), st.booleans()),
    st.tuples(st.just("type"), st.text(max_size=6), st.none()),
)


def do(screen, act, t_s):
    kind, what, how = act
    if kind in ("tap", "drag"):
        targets = [element for element in screen.scene() if element.stops]
        box = targets[what % len(targets)].box
        x, y = box.left + how * (box.width - 1), box.middle[1]
        screen.handle(Pressed(x, y, t_s))
        if kind == "drag":
            screen.handle(Moved(x + 60, y + 90, t_s))
        screen.handle(Released(x, y, t_s))
    elif kind == "key":
        screen.handle(Key(what, how, t_s))
    elif kind == "type":
        screen.handle(Typed(what, t_s))
    else:
        screen.handle({"press": Pressed, "move": Moved, "release": Released}[kind](what, how, t_s))


def canonical_types(value):
    if isinstance(value, dict):
        return all(type(key) is str and canonical_types(part) for key, part in value.items())
    if isinstance(value, list):
        return all(map(canonical_types, value))
    return type(value) in (str, int, float, bool, type(None))


@pytest.mark.parametrize("name", FORMS)
@given(acts=st.lists(ACTS, max_size=60))
@settings(max_examples=examples(40), deadline=None)
def test_a_reply_is_always_one_that_answers_the_form(name, acts):
    request = FORMS[name]
    screen = screen_for(request, PAGE, 0)
    for n, act in enumerate(acts):
        do(screen, act, 0.1 * n)
        if screen.reply is not None:
            request.demand_answer(screen.reply)
            assert canonical_types(screen.reply.value)
            assert all(block.count for block in screen.reply.samples)
            return
    screen.placed()


@given(
    presses=st.lists(st.tuples(st.integers(0, 3), st.floats(0, 1)), min_size=1, max_size=40),
    step=st.sampled_from([None, 1, 0.1]),
)
@settings(max_examples=examples(60), deadline=None)
def test_the_last_touch_of_every_line_is_its_answer(presses, step):
    scale = Scale.model_validate({"from": -1, "to": 1} | ({} if step is None else {"step": step}))
    form = Sliders(tuple(Attribute(low=f"a{n}", high=f"b{n}") for n in range(4)), scale)
    screen = screen_for(ask(form), PAGE, 0)
    last = {}
    for n, (line, share) in enumerate([*presses, (0, 0.5), (1, 0.5), (2, 0.5), (3, 0.5)]):
        track = next(element for element in screen.scene() if element.name == f"slider {line}")
        x, y = track.line.left + share * (track.line.width - 1), track.box.middle[1]
        screen.handle(Pressed(x, y, float(n)))
        screen.handle(Released(x, y, float(n)))
        last[f"a{line}"] = scale.nearest(-1 + 2 * share)
    screen.handle(Key("enter", False, 99.0))
    assert screen.reply.value["answers"] == {name: pytest.approx(last[name], abs=1e-9) for name in sorted(last)}
