"""What a vibrator has to know of a study."""

from __future__ import annotations

from palpate.protocols.plan import Plan


def interval_seconds(plan: Plan) -> float | None:
    """Return how long an interval of the study lasts; None if it has no intervals, or does not say."""
    intervals = plan.study.intervals
    seconds: float | None = None if intervals is None else intervals.seconds
    return seconds
