"""Generated clicks, taps in one packet, drags across other lines, and keys, with their expected results."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from benchmarks.window.hand import Hand
from palpate.devices.window.geometry import Box
from palpate.protocols.forms import Sliders
from palpate.protocols.study import Attribute, Scale

ROWS = 7
STEPS = 20
KEYS = {"left": -1, "right": 1, "pagedown": -10, "pageup": 10}
FORM = Sliders(
    tuple(Attribute(low=f"Low {number}", high=f"High {number}") for number in range(ROWS)),
    Scale(low=0, high=STEPS, step=1),
)


@dataclass
class Expected:
    """The expected answers after every gesture, by a model that shares no code with the screen."""

    values: dict[int, int] = field(default_factory=dict)
    touches: dict[int, int] = field(default_factory=dict)
    focus: int | None = None
    keyed: int | None = None

    def put(self, row: int, value: int) -> None:
        """Expect this value after a press on a line, wherever it was dragged before the release."""
        self.values[row] = value
        self.touches[row] = self.touches.get(row, 0) + 1
        self.focus, self.keyed = row, None

    def key(self, name: str) -> None:
        """Expect a key press on the focused line; consecutive keys are one touch."""
        if (row := self.focus) is None:
            return
        ends = {"home": 0, "end": STEPS}
        value = ends.get(name, self.values[row] + KEYS.get(name, 0))
        self.values[row] = min(max(value, 0), STEPS)
        if self.keyed != row:
            self.touches[row] = self.touches.get(row, 0) + 1
        self.keyed = row

    def lost(self, reply: Mapping[str, Any]) -> int:
        """Return how many gestures did not count, plus how many values are wrong."""
        names = FORM.items()
        counts = sum(abs(reply["touches"].get(names[row], 0) - count) for row, count in self.touches.items())
        wrong = sum(reply["answers"].get(names[row]) != value for row, value in self.values.items())
        return int(counts + wrong)


@dataclass
class Gestures:
    """A hand that acts at random on a form of lines, with a model of the expected answers."""

    hand: Hand
    lines: Mapping[int, Box]
    chance: random.Random
    expected: Expected = field(default_factory=Expected)

    def all_rows(self) -> Iterator[str]:
        """Touch every line once in random order, so that the form can be answered; yield each gesture."""
        for row in self.chance.sample(range(ROWS), ROWS):
            yield self._on(row, self.chance.choice(("click", "tap", "drag")))

    def anything(self) -> str:
        """Make one more gesture, and return its kind."""
        if self.expected.focus is not None and self.chance.random() < 0.3:
            key = self.chance.choice([*KEYS, "home", "end"])
            self.hand.key(key)
            self.expected.key(key)
            return "key"
        return self._on(self.chance.randrange(ROWS), self.chance.choice(("click", "tap", "drag", "both buttons")))

    def _on(self, row: int, kind: str) -> str:
        value = self.chance.randint(0, STEPS)
        match kind:
            case "click":
                self.hand.click(*self._at(row, value))
            case "tap":
                self.hand.tap(*self._at(row, value))
            case _:
                self._drag(row, value, second=kind == "both buttons")
        self.expected.put(row, value)
        return kind

    def _drag(self, row: int, value: int, second: bool) -> None:
        """Drag from anywhere on the line across two others; `second`: another button goes down meanwhile."""
        over = [self._at(self.chance.randrange(ROWS), self.chance.randint(0, STEPS)) for _ in range(2)]
        self.hand.move(*self._at(row, self.chance.randint(0, STEPS)))
        self.hand.press()
        if second:
            self.hand.press(3)
        for point in [*over, self._at(row, value)]:
            self.hand.move(*point)
        if second:
            self.hand.release(3)
        self.hand.release()

    def _at(self, row: int, value: int) -> tuple[float, float]:
        line = self.lines[row]
        return line.left + round(value / STEPS * (line.width - 1)), line.top + line.height // 2
