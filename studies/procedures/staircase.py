"""Up-down staircases (Levitt 1971), also weighted ones (Kaernbach 1991)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from palpate.protocols.procedures import Staircase
from palpate.protocols.tracks import Past, Track
from palpate.studies.procedures.adviser import End, Estimate, ProcedureKind, Step, at_the_edge, too_rare

HARDER, EASIER = -1, 1


@dataclass
class Walk:
    """A staircase after some answers: where it is, where it goes, and the levels at which it turned."""

    index: int
    reversals: list[int] = field(default_factory=list)
    direction: int = 0
    hits: int = 0
    misses: int = 0


@dataclass(frozen=True)
class StaircaseAdviser:
    """A staircase on the grid of a track."""

    track: Track

    @property
    def rules(self) -> Staircase:
        """Return the rules of the study. Raises TypeError for another kind of procedure."""
        if not isinstance(self.track.procedure, Staircase):
            raise TypeError(f"{self.track.name}: a staircase is expected")
        return self.track.procedure

    def advise(self, past: Past) -> Step | End:
        """Return the next level, or the end after enough reversals or trials."""
        rules, walk = self.rules, self.walk(past)
        if rules.stop.reversals is not None and len(walk.reversals) >= rules.stop.reversals:
            return End(f"{len(walk.reversals)} reversals")
        if len(past) >= rules.stop.trials:
            return End(f"{len(past)} trials")
        return Step(walk.index)

    def walk(self, past: Past) -> Walk:
        """Return where these answers lead; a staircase that is at an end of the levels stays there."""
        rules, count = self.rules, len(self.track.levels)
        harder = -1 if rules.easier == "higher" else 1
        walk = Walk(self.track.levels.index(float(rules.start)))
        for index, hit in past:
            walk.hits, walk.misses = (walk.hits + 1, 0) if hit else (0, walk.misses + 1)
            if walk.hits < rules.down and walk.misses < rules.up:
                continue
            direction = HARDER if hit else EASIER
            if walk.direction not in (0, direction):
                walk.reversals.append(index)
            walk.direction, walk.hits, walk.misses = direction, 0, 0
            points = rules.step[min(len(walk.reversals), len(rules.step) - 1)]
            points *= rules.weight if direction == EASIER else 1
            walk.index = min(max(index + points * (harder if direction == HARDER else -harder), 0), count - 1)
        return walk

    def estimate(self, past: Past) -> Estimate:
        """Return the mean of the last reversals, or a statement where the staircase ran to an end of the levels.

        There is no estimate of its uncertainty: reversals lie closer together than estimates of several staircases.
        """
        if self.rules.target is not None and (beyond := at_the_edge(self.track, past, self.rules.target)) is not None:
            return beyond
        last = self.walk(past).reversals[-self.rules.last :]
        ends = {0, len(self.track.levels) - 1}
        if len(last) < self.rules.last or any(index in ends for index in last):
            return Estimate(outside="unknown")
        if self.rules.target is not None and too_rare(past, self.rules.target):
            return Estimate(outside="unknown")
        levels = [float(self.track.levels[index]) for index in last]  # type: ignore[arg-type]
        return Estimate(math.fsum(levels) / len(levels))


KIND = ProcedureKind(StaircaseAdviser)
