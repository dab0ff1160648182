"""The sample that a study plans: how many people, how many sessions for each, how many minutes per session."""

from __future__ import annotations

from typing import Any

from palpate.protocols.study import Study
from palpate.protocols.wording import count


def planned_people(study: Study, group: str | None = None) -> int | None:
    """Return how many participants are planned, in all or in a group; None if the study does not say."""
    sample = study.participants
    if sample is None:
        return None
    if group is not None or sample.planned is not None:
        return sample.planned if group is None else sample.per_group
    return None if sample.per_group is None else sample.per_group * max(1, len(study.groups))


def sample_of(study: Study) -> dict[str, Any]:
    """Return the planned sample as JSON data: planned, per_group, sessions, apart_days, minutes; {} if none."""
    declared = {} if study.participants is None else study.participants.model_dump(mode="json", exclude_none=True)
    everybody = {"planned": planned_people(study), "minutes": study.minutes}
    return {**declared, **{key: value for key, value in everybody.items() if value is not None}}


def describe_sample(study: Study) -> str:
    """Return the planned sample in words, an empty text if none is planned.

    For example: "40 participants (20 in each group), 2 sessions 1 to 14 days apart, 90 minutes a session".
    """
    sample = sample_of(study)
    parts = []
    if "planned" in sample:
        each = f" ({sample['per_group']} in each group)" if "per_group" in sample else ""
        parts.append(f"{count(sample['planned'], 'participant')}{each}")
    if study.sessions > 1:
        days = sample.get("apart_days")
        parts.append(f"{study.sessions} sessions" + (f" {days[0]} to {count(days[1], 'day')} apart" if days else ""))
    if study.minutes is not None:
        parts.append(f"{study.minutes:g} minute{'s' if study.minutes != 1 else ''} a session")
    return ", ".join(parts)
