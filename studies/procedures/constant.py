"""Constant stimuli: all levels in a random order, again and again."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.protocols.keyed import shuffled
from palpate.protocols.tracks import Past, Track
from palpate.studies.procedures.adviser import End, Estimate, ProcedureKind, Step


@dataclass(frozen=True)
class ConstantStimuli:
    """Each round presents every level once, in an order of its own; the threshold is a matter of the analysis."""

    track: Track

    def advise(self, past: Past) -> Step | End:
        """Return the next level of the round, or the end after the last round."""
        count, done = len(self.track.levels), len(past)
        if done >= self.track.trials:
            return End(f"{done} trials")
        order = shuffled(map(str, range(count)), "constant", *self.track.chance, done // count)
        return Step(int(order[done % count]))

    def estimate(self, past: Past) -> Estimate:  # noqa: ARG002
        """Return that nothing is estimated on the way."""
        return Estimate(outside="unknown")


KIND = ProcedureKind(ConstantStimuli)
