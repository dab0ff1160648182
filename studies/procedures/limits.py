"""The method of limits: series of levels that rise or fall until the answer changes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from palpate.protocols.keyed import uniform
from palpate.protocols.procedures import Limits
from palpate.protocols.tracks import Past, Track
from palpate.studies.procedures.adviser import End, Estimate, ProcedureKind, Step


@dataclass(frozen=True)
class Series:
    """One series: where it began, which way it goes, and the levels of its answers; `crossed` if the answer changed."""

    number: int
    towards_easier: bool
    indexes: tuple[int, ...] = ()
    crossed: bool = False


@dataclass(frozen=True)
class LimitsAdviser:
    """Series on the grid of a track: ascending ones go from the hardest level to easier ones until the first hit."""

    track: Track

    @property
    def rules(self) -> Limits:
        """Return the rules of the study. Raises TypeError for another kind of procedure."""
        if not isinstance(self.track.procedure, Limits):
            raise TypeError(f"{self.track.name}: the method of limits is expected")
        return self.track.procedure

    def advise(self, past: Past) -> Step | End:
        """Return the next level, or the end after enough series or trials."""
        series = self.series(past)
        finished = len(series) - 1
        if finished >= (self.rules.stop.series or finished + 1):
            return End(f"{finished} series")
        if len(past) >= self.rules.stop.trials:
            return End(f"{len(past)} trials")
        return Step(self._next(series[-1]))

    def series(self, past: Past) -> list[Series]:
        """Return the series of these answers; the last one is under way, or has not started."""
        several = [self._new(1)]
        for index, hit in past:
            current = several[-1]
            indexes = (*current.indexes, index)
            changed = hit == current.towards_easier
            at_end = not 0 <= index + self._move(current) < len(self.track.levels)
            several[-1] = Series(current.number, current.towards_easier, indexes, changed)
            if changed or at_end:
                several.append(self._new(current.number + 1))
        return several

    def estimate(self, past: Past) -> Estimate:
        """Return the mean of the points between the last two levels of each series.

        Series that ran to an end of the levels, or ended at their first level, have no such point. If most have none,
        the threshold is unknown; if none has one, the statement is to which end they ran.
        """
        ended, levels = self.series(past)[:-1], self.track.levels
        points = []
        for series in ended:
            if series.crossed and len(series.indexes) > 1:
                last, before = (float(levels[index]) for index in (series.indexes[-1], series.indexes[-2]))  # type: ignore[arg-type]
                points.append((last + before) / 2)
        if ended and not points:
            return self._beyond(ended)
        if len(points) <= len(ended) / 2:
            return Estimate(outside="unknown")
        mean = math.fsum(points) / len(points)
        if len(points) < 2:
            return Estimate(mean)
        variance = math.fsum((point - mean) ** 2 for point in points) / (len(points) - 1)
        return Estimate(mean, math.sqrt(variance / len(points)))

    def _beyond(self, ended: list[Series]) -> Estimate:
        """Return beyond which level the threshold lies by all series, without a probability: there is no model.

        Each series says so of the hardest level that was hit, or of the easiest one that was missed.
        """
        always_hit = [series.towards_easier == series.crossed for series in ended]
        if any(always_hit) != all(always_hit):
            return Estimate(outside="unknown")
        indexes = [series.indexes for series in ended]
        below = always_hit[0] == (self.rules.easier == "higher")
        level = self.track.levels[max(map(min, indexes)) if below else min(map(max, indexes))]
        return Estimate(outside="below" if below else "above", bound=float(level), sure=None)  # type: ignore[arg-type]

    def _new(self, number: int) -> Series:
        direction = self.rules.direction
        rising = direction == "ascending" or (direction == "alternating" and number % 2 == 1)
        return Series(number, rising == (self.rules.easier == "higher"))

    def _move(self, series: Series) -> int:
        upwards = series.towards_easier == (self.rules.easier == "higher")
        return self.rules.step if upwards else -self.rules.step

    def _next(self, series: Series) -> int:
        move, last = self._move(series), len(self.track.levels) - 1
        if series.indexes:
            return series.indexes[-1] + move
        draw = uniform("limits", *self.track.chance, series.number)
        inside = min(math.floor((self.rules.jitter + 1) * draw), last)
        return inside if move > 0 else last - inside


KIND = ProcedureKind(LimitsAdviser)
