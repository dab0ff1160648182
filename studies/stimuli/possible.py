"""Every stimulus that a session may present, with every level of its grid."""

from __future__ import annotations

from collections.abc import Iterable
from typing import cast

from palpate.protocols.plan import Plan
from palpate.protocols.study import Stimulus


def possible_stimuli(plan: Plan) -> list[Stimulus]:
    """Return the stimuli that may be presented, each once: `plan.possible` where levels adapt, else the plan's own."""
    possible = cast("Iterable[Stimulus] | None", getattr(plan, "possible", None))
    stimuli = [trial.stimulus for trial in plan.presented] if possible is None else list(possible)
    return list({(stimulus.id, *sorted(stimulus.columns.items())): stimulus for stimulus in stimuli}.values())
