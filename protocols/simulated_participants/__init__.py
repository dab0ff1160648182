"""The kinds of simulated participants: each is a module of this folder, found by its name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from palpate.protocols.events import Ask, Present, Reply, Rest
from palpate.protocols.plan import Plan
from palpate.protocols.registry import Registry
from palpate.protocols.study import Stimulus

Feels = Callable[[Stimulus], Mapping[str, float]]
"""Returns what is known of a stimulus only once it is presented, by the columns of the table that it replaces."""


class SimulatedParticipant(Protocol):
    """A person in a session. Equal requests get equal answers, so that a session is reproducible."""

    @property
    def reading_s(self) -> float:
        """Return how long the person reads a page, in seconds."""

    def answer(self, ask: Ask) -> tuple[Reply, float]:
        """Return the reply to a form and the seconds it took; a reply may go back where the trial allows it."""

    def leave_sliders(self, request: Present) -> Mapping[str, float]:
        """Return the final positions of the sliders of `request.live_form`, moved while the stimulus is felt."""

    def rest_s(self, rest: Rest) -> float:
        """Return how long the person rests, in seconds."""


@dataclass(frozen=True)
class ParticipantKind:
    """A kind of simulated participant: `make(plan, feels)` returns the person for a session's plan.

    `feels` is None if all that is known of a stimulus is in the study's table.
    """

    make: Callable[[Plan, Feels | None], SimulatedParticipant]


KINDS: Registry[ParticipantKind] = Registry(
    folder="palpate.protocols.simulated_participants.*",
    kind="participants",
    of="palpate.protocols.simulated_participants:ParticipantKind",
)
SHIPPED_KIND = "perceiver"


def simulated_participant(plan: Plan, feels: Feels | None = None, kind: str | None = None) -> SimulatedParticipant:
    """Return the simulated participant for a session's plan, of the kind that its study names, or of the shipped one.

    Raises KeyError if there is no such kind, ExtensionError if it belongs to an extension that is not there.
    """
    declared = None if plan.study.simulation is None else plan.study.simulation.kind
    return KINDS[kind or declared or SHIPPED_KIND].make(plan, feels)
