"""What a mixed model refuses beside what every statistic refuses."""

from __future__ import annotations

from palpate.analysis.statistics.refusals import StatisticsError


class RankDeficient(StatisticsError):
    """Fixed effects that the data cannot tell apart."""


class NotIdentified(StatisticsError):
    """A random effect that the data cannot tell from another or from the residual."""


class NoResidual(StatisticsError):
    """Data whose residual is nothing, or nothing but the rounding of the numbers."""


class NotConverged(StatisticsError):
    """A likelihood whose maximum was not reached: no number of such a fit is given away."""


class NotComparable(StatisticsError):
    """Two models that a likelihood ratio does not compare."""
