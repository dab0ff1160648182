"""Figures to reach for the participant's window on virtual displays: lengths, lost answers, idling, memory."""

from __future__ import annotations

import random
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import click

from benchmarks.window.display import missing, virtual_display
from benchmarks.window.gestures import FORM, Gestures
from benchmarks.window.hand import Hand
from benchmarks.window.stage import Setting
from benchmarks.window.stagehand import Stage, stage_on
from palpate.devices.window.calibration import NOMINAL_MM, Calibration
from palpate.devices.window.geometry import Placed
from palpate.protocols.bench import Case
from palpate.protocols.events import Ask
from palpate.protocols.forms import Sliders
from palpate.protocols.study import Order, Scale, Stimulus, Study

MONITORS = ((1280, 720, 3.6), (1920, 1080, 3.6), (2560, 1440, 4.3), (3840, 2160, 7.0))
"""Width and height in pixels, and pixels per millimetre."""
SHARES = (0.0, 0.01, 0.13, 0.25, 0.4, 0.5, 0.62, 0.77, 0.9, 0.99, 1.0)
GESTURES, GESTURES_PER_FORM = 2000, 25
WARM_UP_TRIALS = 50
FINE = Sliders(FORM.attributes[:4], Scale(low=0, high=100))
STUDY = Study(
    study="bench", title="Bench", task="slider_rating", attributes=FORM.attributes, scale=FORM.scale,
    stimuli=(Stimulus(id="one"),), order=Order(design="as_listed"),
)  # fmt: skip


def cases(quick: bool) -> Iterator[Case]:
    """Yield every figure without a session; without a virtual display print the reason and yield none."""
    if absent := missing():
        click.echo(f"window: left out, for want of {', '.join(absent)}", err=True)
        return
    for width, height, px_per_mm in MONITORS:
        yield from _lengths(width, height, px_per_mm)
    with _window(1920, 1080, 3.6) as (stage, hand):
        yield _lost(stage, hand, GESTURES // 5 if quick else GESTURES)
        yield _idle(stage, 3.0 if quick else 10.0)
    with _window(1280, 720, 3.6) as (stage, hand):
        yield _memory(stage, hand, 200 if quick else 1000)


def _case(what: str, method: str, input_name: str, n: int, kind: str, run: Any) -> Case:
    """Return a case whose run returns its error."""
    return Case("window", what, method, input_name, n, kind, run, float, 1)


@contextmanager
def _window(width: int, height: int, px_per_mm: float) -> Iterator[tuple[Stage, Hand]]:
    """Open the real window, which fills a virtual display of that size; yield its process and a hand."""
    setting = Setting(STUDY, Calibration((width, height), px_per_mm, 0, "never: a virtual display"), fullscreen=True)
    with virtual_display(width, height) as display:
        hand = Hand(display)
        try:
            with stage_on(display, setting) as stage:
                yield stage, hand
        finally:
            hand.close()


def _lengths(width: int, height: int, px_per_mm: float) -> Iterator[Case]:
    input_name = f"{width}x{height} at {px_per_mm:g} px/mm"
    with _window(width, height, px_per_mm) as (stage, hand):
        length, drag = partial(length_error_mm, stage, hand, px_per_mm), partial(drag_error_px, stage, hand)
        yield _case("127 mm drawn", "window, framebuffer", input_name, len(FINE.attributes), "mm off", length)
        yield _case("a drag to x %", "window, XTEST", input_name, len(SHARES), "px off", drag)


def length_error_mm(stage: Stage, hand: Hand, px_per_mm: float) -> float:
    """Return how far the worst of four lines on the screen is from 127 mm."""
    stage.put_on(Ask(FINE))
    lines = _lines(stage.placed())
    lengths_px = [drawn_length_px(hand, placed) for placed in lines.values()]
    _leave(stage)
    return max(abs(length / px_per_mm - NOMINAL_MM) for length in lengths_px)


def drawn_length_px(hand: Hand, line: Placed) -> float:
    """Return the length of a dark line in the display's pixels; half-dark pixels count half."""
    box = line.box.grown(8)
    row = hand.picture(box.left, line.box.top + line.box.height // 2, box.width, 1).convert("L")
    greys = list(row.tobytes())
    ground, ink = max(greys), min(greys)
    return sum((ground - grey) / (ground - ink) for grey in greys)


def drag_error_px(stage: Stage, hand: Hand) -> float:
    """Return the largest distance, in pixels, of an answer from where a drag was released."""
    worst = 0.0
    for share in SHARES:
        stage.put_on(Ask(FINE))
        lines = _lines(stage.placed())
        aims = [(name, line.box.left + share * (line.box.width - 1), line.box) for name, line in lines.items()]
        for _, x, box in aims:
            hand.drag([box.middle, (round(x), box.middle[1])])
        hand.key("enter")
        answers = stage.result().value["answers"]
        for name, x, box in aims:
            read = box.left + answers[FINE.items()[name]] / 100 * (box.width - 1)
            worst = max(worst, abs(read - round(x)))
    return worst


def _lost(stage: Stage, hand: Hand, count: int) -> Case:
    return _case("generated clicks, taps, drags and keys", "window, XTEST", f"{count} gestures on 7 lines", count,
                 "answers lost", lambda: lost_answers(stage, hand, count))  # fmt: skip


def lost_answers(stage: Stage, hand: Hand, count: int, seed: int = 1) -> float:
    """Return how many of `count` gestures had no effect, over forms of 25 gestures each."""
    lost, chance = 0, random.Random(seed)
    for _ in range(-(-count // GESTURES_PER_FORM)):
        stage.put_on(Ask(FORM))
        placed = stage.placed()
        acts = Gestures(hand, {row: line.box for row, line in _lines(placed).items()}, chance)
        done = len(list(acts.all_rows()))
        for _ in range(GESTURES_PER_FORM - done - 1):
            acts.anything()
        hand.tap(*placed["next"].box.middle)
        lost += acts.expected.lost(stage.result().value)
    return float(lost)


def _idle(stage: Stage, seconds: float) -> Case:
    return _case(
        "a question stands", "window", f"{seconds:g} s", 1, "% of a core", lambda: idle_percent(stage, seconds)
    )


def idle_percent(stage: Stage, seconds: float) -> float:
    """Return the window's share of a core while nothing happens, in percent."""
    stage.put_on(Ask(FORM))
    stage.look()
    before, start = stage.cpu_s(), time.perf_counter()
    time.sleep(seconds)
    share = (stage.cpu_s() - before) / (time.perf_counter() - start)
    _leave(stage)
    return 100 * share


def _memory(stage: Stage, hand: Hand, trials: int) -> Case:
    return _case("trials in one window", "window", f"{trials} trials after {WARM_UP_TRIALS}", trials, "MB grown",
                 lambda: grown_MB(stage, hand, trials))  # fmt: skip


def grown_MB(stage: Stage, hand: Hand, trials: int) -> float:
    """Return the growth of the window's memory after `trials` answered forms, in MB, not below 0."""
    for _ in range(WARM_UP_TRIALS):
        _answer(stage, hand)
    before = stage.resident_MB()
    for _ in range(trials):
        _answer(stage, hand)
    return max(0.0, stage.resident_MB() - before)


def _answer(stage: Stage, hand: Hand) -> None:
    """Answer one form of four lines, by keys."""
    stage.put_on(Ask(FINE))
    for _ in FINE.attributes:
        hand.key("right")
        hand.key("down")
    hand.key("enter")
    stage.result()


def _leave(stage: Stage) -> None:
    """Abandon the form unanswered, as an experimenter may."""
    stage.send_message("aside", {"do": "abort", "text": "bench"})
    stage.result()


def _lines(placed: dict[str, Placed]) -> dict[int, Placed]:
    """Return the lines of a form by their row."""
    by_name = {name.removesuffix(".line"): line for name, line in placed.items() if name.endswith(".line")}
    return {int(name.removeprefix("slider ")): line for name, line in by_name.items()}
