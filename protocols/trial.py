"""A trial, and the participant of its session."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from palpate.protocols.forms import Form
from palpate.protocols.study import Stimulus
from palpate.protocols.tracks import NO_CATCH, Past, Track


@dataclass(frozen=True)
class ParticipantRow:
    """A pseudonym with its group and its row of the counterbalancing square (0-based)."""

    participant: str
    group: str | None = None
    row: int = 0


@dataclass(frozen=True)
class Recording:
    """A recording of a stimulus: by which device and for how long."""

    device: str
    seconds: float


@dataclass(frozen=True)
class Trial:
    """A stimulus and its form or recording; `attempt` and `previous` are set for later attempts.

    A trial about a set has all its `stimuli`, in the order of the plan; `stimulus` is then the one to be felt, or the
    first if the trial is meant as a whole. A trial of a `track` has its level chosen when it comes, unless it is fixed
    (`index`); `past` are the answers of the track before it. `catch`: none, absent (without a stimulus) or easy.
    """

    number: int
    block: str
    practice: bool
    stimulus: Stimulus
    form: Form | None
    may_go_back: bool
    rest_before: bool
    recording: Recording | None = None
    attempt: int = 1
    previous: Mapping[str, Any] | None = None
    stimuli: tuple[Stimulus, ...] = ()
    track: Track | None = None
    catch: str = NO_CATCH
    index: int | None = None
    past: Past = ()

    def each(self) -> tuple[Trial, ...]:
        """Return the trial once for each stimulus that is felt in it."""
        return tuple(replace(self, stimulus=stimulus) for stimulus in self.stimuli) or (self,)
