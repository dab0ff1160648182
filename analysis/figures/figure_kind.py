"""The parts of a figure: settings, data, drawing, and the marks in it with details."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

from palpate.analysis.plans.answers import Normalise
from palpate.analysis.plans.idle import Idle
from palpate.analysis.plans.sources import Takes
from palpate.analysis.plans.where import Condition
from palpate.protocols.strict import Strict
from palpate.protocols.study import Text

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure

    from palpate.analysis.plans.answers import Answer, Row, Selected

_NONE: Mapping[str, Any] = MappingProxyType({})
MOST_MARKS = 700
"""The number of points above which a figure draws them together, since more groups make a page slow."""


class FigureSettings(Strict):
    """The common settings of figures in an analysis plan; each kind adds its own.

    `name` is unique in its plan and usable as a file name, `figure` names the kind. `tests` names the plan's tests
    whose answers the figure shows (significance marks, a configuration of points). The other settings are as for a
    test; `order` of a figure names no column.
    """

    not_columns: ClassVar[frozenset[str]] = frozenset({"order"})
    name: str
    figure: str
    title: str | None = None
    outcomes: tuple[str, ...] | None = None
    where: Mapping[Text, Condition] = {}
    table: str | None = None
    source: Takes | None = None
    normalise: Normalise | None = None
    tests: tuple[str, ...] = ()

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect beside the others; a kind that shows tests has its own."""
        yield Idle("tests", "in this kind of figure, which shows no test")


def rows_without_effect(where: str) -> Iterator[Idle]:
    """Yield the settings that choose rows, for a figure that shows answers of tests as they are, as `where` says."""
    yield from (Idle(name, where) for name in ("outcomes", "where", "table", "source", "normalise"))


@dataclass(frozen=True)
class FigureInput:
    """The inputs of a figure's data: the selected rows, and the answers of the tests that it names.

    `answers` maps a test's name to its answers by outcome ("" for a kind that answers once for all outcomes).
    """

    selected: Selected
    answers: Mapping[str, Mapping[str, Answer]] = field(default_factory=lambda: _NONE)


@dataclass(frozen=True)
class FigureData:
    """All data of a figure: `rows` is its table (written as NAME.csv), `words` are further values for the drawing.

    `words` has plain values only: labels of axes, ends of scales, the order of levels.
    """

    rows: tuple[Row, ...]
    title: str
    caption: str
    words: Mapping[str, Any] = field(default_factory=lambda: _NONE)


@dataclass(frozen=True)
class Mark:
    """A mark with details in a drawing; `gid` is the id of its group in the figure's SVG.

    `details` are the names and values that a page shows on pointing. `key` is the stimulus (or level, participant,
    word) that it shares with marks of other figures: choosing one highlights all of them.
    """

    gid: str
    details: tuple[tuple[str, str], ...]
    key: str = ""


@dataclass
class Marks:
    """The marks of a drawing, collected in drawing order; each artist gets an id."""

    marks: list[Mark] = field(default_factory=list)

    def add(self, artist: Artist, details: tuple[tuple[str, str], ...], key: str = "") -> None:
        """Turn the artist into a mark."""
        gid = f"m{len(self.marks)}"
        artist.set_gid(gid)
        self.marks.append(Mark(gid, details, key))

    def all(self) -> tuple[Mark, ...]:
        """Return every mark in drawing order."""
        return tuple(self.marks)


@dataclass(frozen=True)
class DrawnFigure:
    """A drawing and its marks."""

    figure: Figure
    marks: tuple[Mark, ...] = ()


@dataclass(frozen=True)
class FigureKind:
    """A kind of figure that a plan may use: its settings, and two functions.

    `data` computes the figure's table and caption, and raises a named ValueError if there is nothing to show. `draw`
    depends on the data only, so that a figure can be drawn again from its table. `takes` is the study's table that the
    figure is drawn from; None: it shows answers of tests alone.
    """

    settings: type[FigureSettings]
    data: Callable[[FigureInput, Any], FigureData]
    draw: Callable[[FigureData], DrawnFigure]
    takes: Takes | None = "ratings"
