"""The markers of a slider form: answers, when and how often each was touched, and the path of every marker."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import Any

from palpate.protocols.forms import Sliders
from palpate.protocols.requests import Samples

ROW = struct.Struct("<3f")


@dataclass
class Marks:
    """Markers by attribute; one that was never touched has no answer, which is not the same as zero."""

    form: Sliders
    t0_ns: int
    answers: dict[str, float] = field(default_factory=dict)
    at_s: dict[str, float] = field(default_factory=dict)
    touches: dict[str, int] = field(default_factory=dict)
    path: bytearray = field(default_factory=bytearray)
    _keyed: int | None = None

    def touch(self, number: int, by_key: bool = False) -> None:
        """A marker is taken hold of; keys in a row on one marker are one touch."""
        if by_key and self._keyed == number:
            return
        self._keyed = number if by_key else None
        name = self.form.attributes[number].name
        self.touches[name] = self.touches.get(name, 0) + 1

    def put(self, number: int, value: float, at_s: float) -> None:
        """A marker is put to the scale's nearest answer; a change of it is kept as a sample."""
        name = self.form.attributes[number].name
        answer = float(self.form.scale.nearest(value)) + 0.0  # a plain float, and never -0.0
        self.at_s[name] = round(at_s, 3)
        if self.answers.get(name) != answer:
            self.answers[name] = answer
            self.path += ROW.pack(number, at_s, answer)

    def value(self) -> dict[str, Any]:
        """Answers in the form's order, with times and touches of those that were touched."""
        return {
            part: {name: known[name] for name in self.form.items() if name in known}
            for part, known in (("answers", self.answers), ("at_s", self.at_s), ("touches", self.touches))
        }

    def samples(self) -> tuple[Samples, ...]:
        """The path of the markers; none where nothing was moved."""
        if not self.path:
            return ()
        channels, units = ("item", "time", "value"), ("index", "s", "scale")
        return (Samples("marker", channels, units, 0.0, self.t0_ns, bytes(self.path)),)
