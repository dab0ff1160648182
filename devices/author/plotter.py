"""The plot of a door: its force over the opening angle, the background, and the legend."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from palpate.devices.author.elements import BAND_MARK, FEELS, SIDES, Chip, Dot, Swatch
from palpate.devices.author.layout import Layout
from palpate.devices.author.work import Letter, Work
from palpate.devices.window.geometry import Box
from palpate.devices.window.paint import INK, QUIET, Colour
from palpate.devices.window.plot import Axes, Masks, axes_for
from palpate.devices.window.screens.elements import Element
from palpate.devices.window.screens.profile import Curve, Ground
from palpate.devices.window.typeset import SMALL_STEPS, Typesetter, line_px
from palpate.protocols.tables import read_table
from palpate.signals.arrays import Array
from palpate.signals.doors.grid import POINTS, DoorDataError

Hand = tuple[float, float]
"""The door's position while it plays: angle in degrees, force in newtons."""
LETTERS: tuple[Letter, Letter] = ("A", "B")
COLUMNS = ("angle_deg", "least_N", "most_N")
FILE = Path(__file__).resolve().with_name("rated_range.csv")


@dataclass
class Plotter:
    """A builder of the plot's elements."""

    setter: Typesetter
    layout: Layout
    masks: Masks = field(default_factory=Masks)

    @cached_property
    def rated(self) -> tuple[bytes, bytes]:
        """Return the outline of the range of doors that people have rated."""
        least, most = rated_range()
        return least.tobytes(), most.tobytes()

    def elements(self, work: Work, force_N: Array, beside_N: Array | None, hand: Hand | None) -> Iterator[Element]:
        """Yield the axes, the doors on them and the legend."""
        axes = axes_for(self.layout.panel.plot, *(profile for profile in (force_N, beside_N) if profile is not None))
        force_axis = self.setter.page.texts("force_axis")
        yield self.setter.label("force axis", force_axis, self.layout.panel.force_axis, QUIET, within="door")
        for letter, box in zip(LETTERS, self.layout.panel.chips, strict=True) if work.b is not None else ():
            laid = self.setter.text(letter, box.width, box.height, bold=True)
            yield Chip(f"side {letter}", box, "door", laid=laid, chosen=work.on == letter, colour=SIDES[letter])
        low, high = self.rated
        yield Ground("grid", axes.box, "door", low, high, axes.low_N, axes.high_N, self.masks)
        unit, line = self.setter.page.metrics.unit, line_px(self.setter.page, 3.8)
        for force in axes.forces_N:
            box = Box(axes.box.left - unit(11.5), axes.y(force) - line // 2, unit(11), line)
            number = f"{force:.0f}".replace("-", "\N{MINUS SIGN}")
            yield self.setter.label(f"{force:g} N", number, box, QUIET, "right", (3.8,), within="door")
        for angle in range(0, 61, 10):
            box = Box(axes.x(angle) - unit(6), axes.box.bottom + (line + 1) // 2, unit(12), line)
            yield self.setter.label(f"{angle} deg", f"{angle}", box, QUIET, "centre", (3.8,), within="door")
        thick = max(2.0, 0.75 * unit(1))
        if beside_N is not None:
            yield from self._curve("beside", beside_N, axes, 0.55 * thick, SIDES["A" if work.on == "B" else "B"])
        yield from self._curve("curve", force_N, axes, thick, SIDES[work.on])
        if hand is not None:
            side = unit(3.4) | 1
            x = min(max(axes.x(hand[0]), axes.box.left), axes.box.right - 1)
            y = min(max(axes.y(hand[1]), axes.box.top), axes.box.bottom - 1)
            yield Dot("hand", Box(x - side // 2, y - side // 2, side, side), "grid", INK)
        yield from self._legend(work, hand is not None)

    def _curve(self, name: str, force_N: Array, axes: Axes, thick_px: float, colour: Colour) -> Iterator[Element]:
        for number, piece in enumerate(self.masks.line(force_N, axes, thick_px)):
            yield Curve(f"{name} {number}", piece.box, "grid", piece.cover, colour)

    def _legend(self, work: Work, played: bool) -> Iterator[Element]:
        texts, place, unit = self.setter.page.texts, self.layout, self.setter.page.metrics.unit
        axis = Box(
            place.panel.plot.left, place.panel.angle_axis.top, place.panel.plot.width, place.panel.angle_axis.height
        )
        yield self.setter.label("angle axis", texts("angle_axis"), axis, QUIET, "centre", SMALL_STEPS, within="door")
        marks: list[tuple[str, Colour]] = [("wished", SIDES[work.on]), ("feels", FEELS), ("band", BAND_MARK)]
        x, side = place.panel.plot.left, unit(3)
        for name, colour in [*marks, *([("hand", INK)] if played else [])]:
            laid = self.setter.text(texts(name), unit(45), place.panel.legend.height, SMALL_STEPS)
            yield Swatch(f"swatch {name}", Box(x, place.panel.legend.middle[1] - side // 2, side, side), "door", colour)
            box = Box(x + side + unit(1), place.panel.legend.top, laid.width, place.panel.legend.height)
            yield self.setter.label(f"legend {name}", texts(name), box, QUIET, "left", SMALL_STEPS, within="door")
            x = box.right + unit(5)


def rated_range() -> tuple[Array, Array]:
    """Return the least and the greatest force of the rated doors at each of the 621 angles, in newtons."""
    _angles, least, most = map(np.asarray, read_table(FILE, COLUMNS).numbers(COLUMNS).values())
    if len(least) != POINTS:
        raise DoorDataError(f"{FILE}: {len(least)} rows found, {POINTS} expected")
    return least, most


def range_text(profiles: Array) -> str:
    """Return the range file's content for profiles (n, 621)."""
    rows = zip(profiles.min(axis=0), profiles.max(axis=0), strict=True)
    lines = (f"{number / 10:.1f},{low:.2f},{high:.2f}" for number, (low, high) in enumerate(rows))
    return "\n".join((",".join(COLUMNS), *lines)) + "\n"
