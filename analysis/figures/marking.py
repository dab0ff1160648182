"""The marks of a drawing, collected while it is drawn."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from palpate.analysis.figures.drawn import Mark

if TYPE_CHECKING:
    from matplotlib.artist import Artist

MOST = 700
"""Beyond this many points a figure draws them together: a page with more groups turns slow."""


@dataclass
class Marking:
    """Gives each artist that can be looked at closer an id of its own, in the order of drawing."""

    marks: list[Mark] = field(default_factory=list)

    def add(self, artist: Artist, told: tuple[tuple[str, str], ...], key: str = "") -> None:
        """The artist becomes a mark."""
        gid = f"m{len(self.marks)}"
        artist.set_gid(gid)
        self.marks.append(Mark(gid, told, key))

    def all(self) -> tuple[Mark, ...]:
        """Every mark, in the order of drawing."""
        return tuple(self.marks)
