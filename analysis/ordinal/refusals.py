"""What ordinal models refuse, by name."""

from __future__ import annotations

from palpate.analysis.statistics.refusals import StatisticsError


class Separated(StatisticsError):
    """Answers that the predictors divide without overlap: some estimate would be infinite."""


class NotConverged(StatisticsError):
    """A likelihood without a maximum that could be found."""
