"""A session's answers as the diagnostics take them, and what is drawn of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from palpate.analysis.monitoring.course import Course, Met
from palpate.analysis.ratings.diagnostics import Answered, Diagnostic, diagnose
from palpate.analysis.ratings.word_diagnostics import Worded, diagnose_words
from palpate.protocols.plan import Plan

BINS = 21


@dataclass(frozen=True)
class Rated:
    """How a session was answered: signs, seconds of each trial in order, and how often answers fell into each bin.

    `kind` is ratings or words; the bins cut the scale, or the numbers of words, into equal parts.
    """

    kind: str
    signs: tuple[Diagnostic, ...]
    seconds: tuple[float, ...]
    histogram: tuple[int, ...]
    ends: tuple[float, float]

    @property
    def flags(self) -> tuple[Diagnostic, ...]:
        """The signs that are flagged."""
        return tuple(sign for sign in self.signs if sign.flagged)


def rated(course: Course, plan: Plan, over: bool) -> Rated | None:
    """The diagnostics of a session; None where nothing is answered, or its task asks nothing (a capture).

    `over` says that every planned trial is owed; else those that the participant has come past.
    """
    practice = {trial.number for trial in plan.trials if trial.practice}
    met = {number: one for number, one in sorted(course.trials.items()) if one.answers is not None}
    if not any(number not in practice for number in met):
        return None
    owed = len(plan.trials) - len(practice) if over else sum(number not in practice for number in _passed(course))
    scale = plan.study.scale
    if scale is not None and all(_numeric(one.answers) for one in met.values()):
        return _ratings(met, practice, (float(scale.low), float(scale.high)), owed)
    return _words(met, practice, owed)


def _passed(course: Course) -> Iterator[int]:
    """Trials that the participant has come past."""
    furthest = max((number for number, met in course.trials.items() if met.done), default=0)
    yield from (number for number in course.trials if number <= furthest)


def _numeric(answers: Mapping[str, Any] | None) -> bool:
    return bool(answers) and all(type(value) in (int, float) for value in (answers or {}).values())


def _ratings(met: Mapping[int, Met], practice: set[int], scale: tuple[float, float], owed: int) -> Rated:
    low, high = scale
    trials = [
        Answered(number, one.stimulus, dict(one.answers or {}), one.seconds, number in practice)
        for number, one in met.items()
    ]
    counted = [each for each in trials if not each.practice]
    values = [float(value) for each in counted for value in each.values.values()]
    signs = diagnose(trials, low, high, owed)
    return Rated("ratings", signs, _seconds(met, practice), _histogram(values, low, high), scale)


def _words(met: Mapping[int, Met], practice: set[int], owed: int) -> Rated:
    trials = [_worded(number, one, number in practice) for number, one in met.items()]
    numbers = [float(len(each.words)) for each in trials if not each.practice]
    most = max([*numbers, 1.0])
    signs = diagnose_words(trials, owed)
    return Rated("words", signs, _seconds(met, practice), _histogram(numbers, 0.0, most), (0.0, most))


def _worded(number: int, met: Met, practice: bool) -> Worded:
    """The words ticked of a list; else those in whatever lists the answers hold."""
    answers = met.answers or {}
    if "ticked" in answers:
        return Worded(number, met.stimulus, tuple(answers["ticked"]), len(met.items), met.seconds, practice)
    words = tuple(str(word) for value in answers.values() if isinstance(value, list) for word in value)
    return Worded(number, met.stimulus, words, 0, met.seconds, practice)


def _seconds(met: Mapping[int, Met], practice: set[int]) -> tuple[float, ...]:
    return tuple(one.seconds for number, one in met.items() if number not in practice and one.seconds is not None)


def _histogram(values: list[float], low: float, high: float) -> tuple[int, ...]:
    counts = [0] * BINS
    for value in values:
        counts[min(int((value - low) / (high - low) * BINS), BINS - 1)] += 1
    return tuple(counts)
