"""The errors of the statistics: each message says where, what was found, what was expected and what to do."""

from __future__ import annotations

from collections.abc import Collection, Iterable

SHOWN = 5
NO_SUBJECT = "without `subject`, because every row counts as an independent value then"


class StatisticsError(ValueError):
    """A table or a request that the statistics refuse."""


class UnknownColumn(StatisticsError):
    """A column missing from the table, or a name that stands for two things at once."""


class BadValue(StatisticsError):
    """A value that is not a finite number, or a row without a label."""


class IncompleteCells(StatisticsError):
    """A participant without a value in some cell."""


class DuplicatedCells(StatisticsError):
    """A participant with several values in one cell."""


class TooFew(StatisticsError):
    """Fewer than two participants, levels or groups."""


class BadOption(StatisticsError):
    """An option that does not exist, or a design that this function does not test."""


class Separated(StatisticsError):
    """Answers that the predictors separate without overlap, so that some estimate would be infinite."""


class NotConverged(StatisticsError):
    """A likelihood whose maximum was not reached, so that no result is returned."""


class RankDeficient(StatisticsError):
    """Fixed effects that the data cannot distinguish."""


class NotIdentified(StatisticsError):
    """A random effect that the data cannot distinguish from another or from the residual."""


class NoResidual(StatisticsError):
    """Data whose residual is zero, or only rounding."""


class NotComparable(StatisticsError):
    """Two models that a likelihood ratio cannot compare."""


class NoEstimate(StatisticsError):
    """Data that do not determine the requested numbers: the likelihood has no maximum at finite values."""


def refuse_idle(name: str, value: object, default: object, where: str) -> None:
    """Raise BadOption for an option that differs from its default where it has no effect.

    `where` names the condition: "without `subject`: every row counts as independent".
    """
    if value is not default and value != default:
        raise BadOption(f"{name}={shown(value)} has no effect {where}; leave it out")


def refuse_idle_levels(levels: Iterable[object], factors: Collection[object], name: str = "levels") -> None:
    """Raise BadOption for an order of levels of a column that is not among the factors."""
    for column in levels:
        if column not in factors:
            known = ", ".join(map(repr, factors)) or "none"
            raise BadOption(f"{name} of {column!r} have no effect: the factors here are {known}")


def listed(items: Iterable[str], total: int) -> str:
    """Return the first few of `total` items as text, and the number of the others."""
    first = [item for item, _ in zip(items, range(SHOWN), strict=False)]
    rest = total - len(first)
    return "; ".join(first) + (f"; and {rest} more" if rest else "")


def shown(option: object) -> str:
    """Return an invalid value as text: strings, numbers and None as they are, anything else by its type."""
    return repr(option) if option is None or isinstance(option, str | int | float) else f"<{type(option).__name__}>"
