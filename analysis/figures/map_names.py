"""Where the names of a map's points are written so that they lie on no point and on no other name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.analysis.figures.lettering import width_pt

AROUND = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))
RADIUS = 3.4
"""How far a point itself reaches, in points."""


@dataclass(frozen=True)
class Area:
    """An area that is taken, in points."""

    left: float
    bottom: float
    right: float
    top: float

    def shared(self, other: Area) -> float:
        """How much of the other area lies within this one, in square points."""
        wide = min(self.right, other.right) - max(self.left, other.left)
        tall = min(self.top, other.top) - max(self.bottom, other.bottom)
        return wide * tall if wide > 0 and tall > 0 else 0.0


def about(middle: tuple[float, float], wide: float, tall: float) -> Area:
    """The area of these sides about a middle."""
    x, y = middle
    return Area(x - wide / 2, y - tall / 2, x + wide / 2, y + tall / 2)


@dataclass(frozen=True)
class Placed:
    """A name's middle relative to its point, in points; `free` is False where it lies on something."""

    x: float
    y: float
    free: bool


def placed(
    points: Sequence[tuple[float, float]], names: Sequence[str], size: float, taken: Sequence[Area] = ()
) -> list[Placed]:
    """A place for each name about its point (both in points); the most crowded point comes last.

    Of eight places about the point and eight further away the one that covers least is taken, the nearer one first.
    """
    blocked = [*taken, *(about(point, 2 * RADIUS, 2 * RADIUS) for point in points)]
    found: dict[int, Placed] = {}
    for i in sorted(range(len(points)), key=lambda i: (_near(points, i), i)):
        sides = (width_pt(names[i], size), 1.05 * size)
        tries = [_tried(points[i], way, far, sides, blocked) for far in (1.0, 2.4) for way in AROUND]
        found[i] = min(tries, key=lambda each: each[0])[1]
        if found[i].free:
            blocked.append(about((points[i][0] + found[i].x, points[i][1] + found[i].y), *sides))
    return [found[i] for i in range(len(points))]


def _near(points: Sequence[tuple[float, float]], i: int) -> int:
    x, y = points[i]
    return sum(abs(a - x) < 40 and abs(b - y) < 20 for a, b in points)


def _tried(
    point: tuple[float, float], way: tuple[int, int], far: float, sides: tuple[float, float], blocked: Sequence[Area]
) -> tuple[float, Placed]:
    """What a name would cover there, in square points, and the place."""
    gap = 4.6 * far
    middle = (way[0] * (gap + sides[0] / 2), way[1] * (gap + sides[1] / 2) * (0.75 if way[0] else 1.0))
    area = about((point[0] + middle[0], point[1] + middle[1]), *sides)
    cover = sum(area.shared(other) for other in blocked)
    return cover, Placed(*middle, cover < 1.0)
