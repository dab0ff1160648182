"""A session's answers as input of the diagnostics, and what is drawn of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.analysis.ratings.diagnostics import Answered, Diagnostic, diagnose
from palpate.analysis.ratings.word_diagnostics import Worded, diagnose_words
from palpate.protocols.events import NS
from palpate.protocols.plan import Plan
from palpate.protocols.session_state import Answer, Pause, SessionState, TrialState, active_ns
from palpate.protocols.tasks import TASKS

BINS = 21


@dataclass(frozen=True)
class Rated:
    """The answers of a session: diagnostics, seconds of each trial in order, and counts of answers by bin.

    `kind` is ratings or words; the bins cut the scale, or the numbers of words, into equal parts.
    """

    kind: str
    signs: tuple[Diagnostic, ...]
    seconds: tuple[float, ...]
    histogram: tuple[int, ...]
    ends: tuple[float, float]

    @property
    def flags(self) -> tuple[Diagnostic, ...]:
        """The flagged diagnostics."""
        return tuple(sign for sign in self.signs if sign.flagged)


@dataclass(frozen=True)
class _Trial:
    """The answer of a trial that counts, and the seconds until it was first given."""

    number: int
    stimulus: str
    practice: bool
    answer: Answer
    seconds: float | None


def rated(state: SessionState, plan: Plan, over: bool) -> Rated | None:
    """Return the diagnostics of a session; None if nothing is answered, or its task has neither ratings nor words.

    With `over` every planned trial is expected, else those that the participant has passed.
    """
    practice = {trial.number for trial in plan.trials if trial.practice}
    trials = [
        _Trial(number, counting.stimulus, number in practice, counting.answer, _seconds_of(trial, state.pauses))
        for number, trial in sorted(state.trials.items())
        if (counting := trial.counting) is not None and counting.answer is not None
    ]
    if all(trial.practice for trial in trials) or TASKS[plan.study.task].answers not in ("ratings", "words"):
        return None
    # Answers are expected to all trials of a session that is over, else to those that the participant has passed.
    furthest = max((number for number, trial in state.trials.items() if trial.counting is not None), default=0)
    passed = sum(number not in practice for number in state.trials if number <= furthest)
    expected = len(plan.trials) - len(practice) if over else passed
    scale = plan.study.scale
    values_of = [trial.answer.values for trial in trials]
    if scale is not None and all(own and all(type(v) in (int, float) for v in own.values()) for own in values_of):
        low, high = float(scale.low), float(scale.high)
        answered = [
            Answered(trial.number, trial.stimulus, dict(trial.answer.values), trial.seconds, trial.practice)
            for trial in trials
        ]
        values = [float(value) for trial in answered if not trial.practice for value in trial.values.values()]
        signs = diagnose(answered, low, high, expected)
        return Rated("ratings", signs, _seconds(trials), _histogram(values, low, high), (low, high))
    # The words ticked of a list; else those in whatever lists the answers hold.
    worded = []
    for trial in trials:
        answer = trial.answer.values
        if "ticked" in answer:
            words, offered = tuple(answer["ticked"]), len(trial.answer.items)
        else:
            words, offered = tuple(str(w) for value in answer.values() if isinstance(value, list) for w in value), 0
        worded.append(Worded(trial.number, trial.stimulus, words, offered, trial.seconds, trial.practice))
    numbers = [float(len(trial.words)) for trial in worded if not trial.practice]
    most = max([*numbers, 1.0])
    signs = diagnose_words(worded, expected)
    return Rated("words", signs, _seconds(trials), _histogram(numbers, 0.0, most), (0.0, most))


def _seconds_of(trial: TrialState, pauses: Sequence[Pause]) -> float | None:
    """Return the time from the first display of the form to the first answer that still counts, without pauses."""
    first = next(attempt for attempt in trial.attempts if attempt.valid)
    if first.form_shown_ns is None or first.done_ns is None:
        return None
    return (active_ns(pauses, first.done_ns) - active_ns(pauses, first.form_shown_ns)) / NS


def _seconds(trials: Sequence[_Trial]) -> tuple[float, ...]:
    return tuple(trial.seconds for trial in trials if not trial.practice and trial.seconds is not None)


def _histogram(values: list[float], low: float, high: float) -> tuple[int, ...]:
    counts = [0] * BINS
    for value in values:
        counts[min(int((value - low) / (high - low) * BINS), BINS - 1)] += 1
    return tuple(counts)
