"""The planned and the achieved sample of a study: participants, sessions and minutes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from palpate.protocols.sample import planned_people, sample_of
from palpate.protocols.study import Study


@dataclass(frozen=True)
class DoneSession:
    """A complete session: participant, number, and how many minutes it took, without the time between its runs."""

    participant: str
    group: str | None
    number: int
    minutes: float


def achieved_sample(study: Study, sessions: Sequence[DoneSession]) -> dict[str, Any]:
    """Return the planned and the achieved sample as JSON data; {} if the study plans nothing.

    A participant with every session is done.
    """
    planned = sample_of(study)
    if not planned:
        return {}
    had = {(session.participant, session.number) for session in sessions}
    group_of = {session.participant: session.group for session in sessions}
    numbers = range(1, study.sessions + 1)
    done = [who for who in group_of if all((who, number) in had for number in numbers)]
    achieved: dict[str, Any] = {"done": len(done)}
    if "planned" in planned:
        achieved["planned"] = planned["planned"]
    if "per_group" in planned:
        achieved["groups"] = {
            group: {"planned": planned_people(study, group), "done": sum(group_of[who] == group for who in done)}
            for group in study.groups
        }
    if study.sessions > 1:
        counts = Counter(session.number for session in sessions)
        achieved["sessions_done"] = {str(number): counts[number] for number in numbers}
    if study.minutes is not None:
        achieved["minutes_planned"] = study.minutes
        if minutes := [session.minutes for session in sessions]:
            achieved["minutes"] = {"median": median(minutes), "least": min(minutes), "most": max(minutes)}
    return achieved


def sample_facts(achieved: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the result of `achieved_sample` as labels and texts for the head of a page."""
    if "planned" in achieved:
        groups = achieved.get("groups", {})
        listing = ", ".join(f"group {group}: {rows['done']} of {rows['planned']}" for group, rows in groups.items())
        yield (
            "Done of planned",
            f"{achieved['done']:,} of {achieved['planned']:,}" + (f" ({listing})" if listing else ""),
        )
    for number, done in achieved.get("sessions_done", {}).items():
        yield f"Session {number} done", f"{done:,}"
    if "minutes_planned" in achieved:
        real = achieved.get("minutes")
        came = f"{real['median']:.0f} ({real['least']:.0f} to {real['most']:.0f})" if real else "none"
        yield "Minutes, real and planned", f"{came}; {achieved['minutes_planned']:g} planned"
