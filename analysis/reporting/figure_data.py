"""What a figure of ratings shows: the words at the ends of the scales, the levels, their families, the means."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby

from analysis.figures.style import INK, OKABE_ITO
from analysis.ratings.wording import count


@dataclass(frozen=True)
class RatedAttribute:
    """A bipolar attribute: its word at each end of the scale (`high` empty where there is none), its category."""

    name: str
    low: str
    high: str
    category: str = ""

    @property
    def title(self) -> str:
        """Both words as they are read: from the low end to the high one."""
        return f"{self.low} → {self.high}" if self.high else self.name


@dataclass(frozen=True)
class Dot:
    """Mean and standard deviation over `n` participants for one attribute at one level.

    `sd` is None where fewer than two participants rated.
    """

    mean: float
    sd: float | None
    n: int


@dataclass(frozen=True)
class Picture:
    """What both figures show: `dots[attribute, level]`, and the family that each level belongs to.

    `levels` and `families` keep the order of the study; levels of one family stand next to each other.
    """

    attributes: tuple[RatedAttribute, ...]
    levels: tuple[str, ...]
    family_of: Mapping[str, str]
    dots: Mapping[tuple[str, str], Dot]
    scale: tuple[float, float]
    short: Mapping[str, str] | None = None
    """How a level is written at an axis, where its full name is too long."""

    def people(self) -> str:
        """How many participants the means are over, in words."""
        n = sorted({dot.n for dot in self.dots.values()})
        return count(n[-1], "participant") if len(n) == 1 else f"{n[0]} to {n[-1]} participants"

    def families(self) -> list[tuple[str, list[str]]]:
        """Each family with its levels, in order."""
        return [(name, list(levels)) for name, levels in groupby(self.levels, key=self.family_of.__getitem__)]

    def colours(self) -> dict[str, str]:
        """A family of one level that comes first is the reference: ink. The others get a colour each."""
        families = self.families()
        first = {families[0][0]: INK} if reference_level(self) else {}
        rest = [name for name, _ in families if name not in first]
        return first | {name: OKABE_ITO[i % len(OKABE_ITO)] for i, name in enumerate(rest)}

    def written(self, level: str) -> str:
        """The level's name at an axis."""
        return (self.short or {}).get(level, level)


def reference_level(picture: Picture) -> str | None:
    """The first level where it is a family of its own among larger ones (g0, the original), else None."""
    families = picture.families()
    alone = len(families) > 1 and len(families[0][1]) == 1 and any(len(of) > 1 for _, of in families[1:])
    return families[0][1][0] if alone else None
